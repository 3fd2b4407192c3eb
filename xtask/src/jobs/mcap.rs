//! `mcap`: the MCAP file that `replay` writes, opened by the Python package mcap, which shares no code with the writer.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, release};
use crate::need;
use crate::shell::{Result, cmd, program_at};

/// Compares every message with the rows of the same run.
pub fn mcap(_: &Arguments) -> Result {
    let python = need::python("mcap-venv", "mcap", "mcap")?;
    cmd("cargo build --release --bin posegate").run()?;
    let folder = Scratch::new()?;
    let [estimates, rows, verdicts, summary] = [
        "estimates.csv",
        "rows.jsonl",
        "verdicts.mcap",
        "summary.json",
    ]
    .map(|name| folder.join(name));
    files::write(
        &estimates,
        with_truth(&files::read("tests/data/estimates.csv")?)?,
    )?;
    let replay = program_at(&release("posegate"))
        .words("replay examples/sites/dock.toml")
        .arg(&estimates)
        .words("--task dock --json --rows")
        .arg(&rows)
        .arg("--mcap")
        .arg(&verdicts)
        .outcome()?;
    // The exit code may be 1: permits may be false here.
    if !matches!(replay.code, 0 | 1) {
        return Err(format!("posegate replay failed with {}", replay.code).into());
    }
    files::write(&summary, replay.text)?;
    program_at(&python)
        .arg("tests/support/read_mcap.py")
        .arg(&verdicts)
        .arg(&rows)
        .arg(&summary)
        .print()
}

/// Gives every other row a truth near its estimate, so that no channel is empty.
fn with_truth(estimates: &str) -> Result<String> {
    let mut lines = estimates.lines();
    let header = lines.next().ok_or("no header")?;
    let column = |name: &str| {
        header
            .split(',')
            .position(|column| column == name)
            .ok_or(format!("no column {name}"))
    };
    let (x, y) = (column("x_m")?, column("y_m")?);
    let mut text = format!("{header},true_x_m,true_y_m,true_yaw_rad\n");
    for (index, line) in lines.enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |column: usize| {
            fields
                .get(column)
                .and_then(|field| field.parse::<f64>().ok())
                .unwrap_or(0.0)
        };
        text.push_str(line);
        // The first row has a truth.
        if index % 2 == 0 {
            text.push_str(&format!(
                ",{},{},0.01\n",
                number(x) + 0.01,
                number(y) - 0.02
            ));
        } else {
            text.push_str(",,,\n");
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::with_truth;

    #[test]
    fn every_second_row_has_a_truth() {
        let text = with_truth("stamp_ms,x_m,y_m\n0,1,2\n1,3,4\n").unwrap();
        assert_eq!(
            text,
            "stamp_ms,x_m,y_m,true_x_m,true_y_m,true_yaw_rad\n0,1,2,1.01,1.98,0.01\n1,3,4,,,\n"
        );
        assert!(with_truth("stamp_ms,x_m\n").is_err());
    }
}
