//! `paving`, `lenses` and `placement`: comparisons with independent tools, each in a separate Python environment.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, release};
use crate::need;
use crate::shell::{Result, cmd, program_at};
use serde_json::Value;

/// Measures how much of a visibility set is proven, how fast, and codac's paving of the same set. The argument is the smallest box
/// of codac's in metres; 0.02 is the resolution of Posegate's, and takes minutes.
pub fn paving(given: &Arguments) -> Result {
    cmd("cargo run --release -p posegate-site --example paving").print()?;
    let python = need::python("paving-python", "codac", "codac")?;
    program_at(&python)
        .arg("tests/support/paving_codac.py")
        .arg(given.or(0, "0.08"))
        .print()
}

/// Compares the lens models, and the windows that are proven for them, with OpenCV's projections. Prints the largest difference
/// of 1,000 random points of each lens, and how far a point of a window is outside the image.
pub fn lenses(_: &Arguments) -> Result {
    let python = need::python("lenses-venv", "cv2, numpy", "opencv-python-headless numpy")?;
    cmd("cargo build --release -p posegate-site --example lenses").run()?;
    let lines = program_at(&release("examples/lenses")).read()?;
    program_at(&python)
        .arg("tests/support/lenses.py")
        .input(lines)
        .print()
}

/// Compares the best place of a tag by each method of `place`, and by RUNS long runs (20) of SciPy's differential
/// evolution. The cost is the same, for the two pose-sets of Fig. 4. Counts the poses and places that are evaluated per second.
pub fn placement(given: &Arguments) -> Result {
    let (runs, iterations) = (given.or(0, "20"), given.or(1, "1000"));
    let python = need::python("scipy-venv", "scipy", "scipy")?;
    cmd(
        "cargo build --release -p posegate-cli -p posegate-place --bin posegate --example placement",
    )
    .run()?;
    let example = release("examples/placement");
    program_at(&example).arg("rate").print()?;
    let folder = Scratch::new()?;
    for sigma in ["0.1", "0.3"] {
        let write = |name: &str, text: String| {
            files::write(folder.join(format!("{name}-{sigma}.json")), text)
        };
        let evolved = program_at(&python)
            .arg("tests/support/differential_evolution.py")
            .arg(&example)
            .words(&format!(
                "tests/data/reference-a.toml see-t7 {sigma} {sigma} 1 {runs} {iterations}"
            ))
            .read()?;
        // A tenth of the evaluations of SciPy's median run, and the default number.
        let tenth = (median_evaluations(&evolved)? / 10.0) as u64;
        write("scipy", evolved)?;
        let place = |more: &str| {
            program_at(&release("posegate"))
                .words(&format!(
                    "place tests/data/reference-a.toml --task see-t7 --sigma-x {sigma} --sigma-y {sigma} --sigma-yaw-deg 1 \
                     --free x=0.3:7,y=-3:3,z=0:2,yaw_deg=0:360 --json {more}"
                ))
                .read()
        };
        for seed in 1..=20 {
            write(
                &format!("tenth-{seed}"),
                place(&format!("--budget {tenth} --seed {seed}"))?,
            )?;
        }
        for method in ["bobyqa", "cmaes", "ga"] {
            write(method, place(&format!("--method {method}"))?)?;
        }
    }
    program_at(&python)
        .arg("tests/support/placements.py")
        .arg(folder.path())
        .print()
}

/// Returns the median number of evaluations of the runs.
fn median_evaluations(evolved: &str) -> Result<f64> {
    let evolved: Value = serde_json::from_str(evolved)?;
    let numbers = evolved["evaluations"]
        .as_array()
        .into_iter()
        .flatten()
        .map(Value::as_f64);
    let mut numbers = numbers.collect::<Option<Vec<f64>>>().unwrap_or_default();
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    match numbers.len() {
        0 => Err("no evaluations of SciPy".into()),
        length if length % 2 == 0 => Ok(f64::midpoint(numbers[middle - 1], numbers[middle])),
        _ => Ok(numbers[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::median_evaluations;

    #[test]
    fn median_is_of_the_sorted_runs() {
        assert_eq!(
            median_evaluations("{\"evaluations\": [30, 10, 20]}").unwrap(),
            20.0
        );
        assert_eq!(
            median_evaluations("{\"evaluations\": [40, 10, 20, 30]}").unwrap(),
            25.0
        );
        assert!(median_evaluations("{}").is_err());
    }
}
