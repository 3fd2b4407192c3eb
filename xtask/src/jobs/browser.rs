//! `browser`: the page of `posegate report` in Debian's chromium.

use crate::arguments::Arguments;
use crate::files::{self, Scratch, release};
use crate::jobs::wasm::wasm;
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd, program_at};
use std::fmt::Write;
use std::time::Instant;

/// Tasks added to the sample site.
const MORE_TASKS: &str = include_str!("browser_tasks.toml");

/// Tests the page: the vector file, dragging, keys, the command line's verdicts, nothing fetched, and no WebAssembly. Measures the
/// size and the time of a page of 50 tasks. Screenshots go to FOLDER, if one is given.
pub fn browser(given: &Arguments) -> Result {
    need::command("chromium", "chromium")?;
    let python = need::python("browser-venv", "playwright", "playwright")?;
    wasm(given)?;
    cmd("cargo build --release -p posegate-cli -p posegate-site --bin posegate --example plant")
        .run()?;
    let program = release("posegate");
    let posegate = || program_at(&program);
    let own = Scratch::new()?;
    let folder = given.path(0).unwrap_or_else(|| own.path().into());
    files::make_folder(&folder)?;
    let site = folder.join("site.toml");
    posegate().words("init --force").arg(&site).run()?;
    let mut text = files::read(&site)?;
    text.push_str(MORE_TASKS);
    files::write(&site, &text)?;
    files::write(
        folder.join("tasks.json"),
        "{\"task\": \"dock-b\", \"compared\": [[\"dock-b\", 0.1], [\"dock-c\", 0.1], [\"see-t7\", 2.5]]}\n",
    )?;
    let places = folder.join("places.svg");
    let placed = posegate()
        .arg("place")
        .arg(&site)
        .words("--task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1 --free x=0.3:7,y=-3:3,yaw_deg=0:360 --budget 300 --json -o")
        .arg(&places)
        .read()?;
    let placement = folder.join("place.json");
    files::write(&placement, placed)?;
    let page = folder.join("report.html");
    posegate()
        .arg("report")
        .arg(&site)
        .words("--title")
        .arg("Sample site")
        .arg("--placement")
        .arg(format!("see-t7={}", placement.display()))
        .arg("--picture")
        .arg(&places)
        .arg("-o")
        .arg(&page)
        .run()?;
    // A hall of six docks: from candidates to tags, a sheet and a page.
    let (hall, sheet) = (folder.join("hall.toml"), folder.join("sheet.html"));
    posegate()
        .words("cover examples/sites/hall.toml -o")
        .arg(&hall)
        .arg("--sheet")
        .arg(&sheet)
        .run()?;
    posegate()
        .arg("report")
        .arg(&hall)
        .arg("-o")
        .arg(folder.join("hall.html"))
        .run()?;
    program_at(&python)
        .arg("tests/support/browser.py")
        .arg(&page)
        .arg(&site)
        .arg(&program)
        .arg(&folder)
        .print()?;

    let text = with_fifty_tasks(&text)?;
    files::write(&site, text)?;
    // Also the page of a plant, with its walls, tags and plans.
    let plant = program_at(&release("examples/plant")).arg("25").read()?;
    files::write(folder.join("plant.toml"), plant)?;
    let mut report = Report::default();
    for name in ["site", "plant"] {
        let begun = Instant::now();
        let page = folder.join(format!("fifty-{name}.html"));
        posegate()
            .arg("report")
            .arg(folder.join(format!("{name}.toml")))
            .arg("-o")
            .arg(&page)
            .run()?;
        let took = begun.elapsed().as_millis();
        report.at_most(&format!("report of 50 tasks, {name}"), took, "ms", 5000);
        report.at_most(
            &format!("page of 50 tasks, {name}"),
            files::size(&page)?,
            "B",
            5_000_000,
        );
    }
    report
        .finish()
        .map_err(|error| format!("a page of 50 tasks takes too long, or too much: {error}").into())
}

/// Adds tasks up to fifty. Half of them are boxes, half are visibility sets, as those of the sample.
fn with_fifty_tasks(site: &str) -> Result<String> {
    let mut text = site.to_owned();
    for k in 1..=17 {
        let side = k % 9 + 1;
        write!(
            text,
            "\n[task.bay-{k}]\nkind = \"work\"\ngoal = {{ x = {k}.0, y = -4.0, yaw_deg = {k}.0 }}\n\
             success = {{ shape = \"box\", x = [-0.1, 0.1], y = [-0.0{side}, 0.1], yaw_deg = [-4.0, 5.0] }}\n"
        )?;
    }
    let seen = site
        .lines()
        .skip_while(|line| !line.starts_with("[task.see-t7]"))
        .skip(1);
    let seen: Vec<&str> = seen.take_while(|line| !line.starts_with('[')).collect();
    for k in 1..=24 {
        write!(text, "\n[task.see-{k}]\n{}\n", seen.join("\n"))?;
    }
    let tasks = text.lines().filter(|line| is_task(line)).count();
    if tasks != 50 {
        return Err(format!("the site has {tasks} tasks, not 50").into());
    }
    Ok(text)
}

/// Returns `true` for the heading of a task itself, not of one of its tables.
fn is_task(line: &str) -> bool {
    let name = line
        .strip_prefix("[task.")
        .and_then(|rest| rest.strip_suffix(']'));
    name.is_some_and(|name| {
        let quoted = name
            .strip_prefix('"')
            .and_then(|rest| rest.strip_suffix('"'));
        !name.is_empty() && quoted.map_or(!name.contains('.'), |inner| !inner.contains('"'))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_are_counted_by_their_headings() {
        assert!(is_task("[task.dock]") && is_task("[task.\" lead\"]") && is_task("[task.\"a.b\"]"));
        assert!(!is_task("[task.dock.table]") && !is_task("[tag.t7]"));
        let own = "[task.a]\n[task.b]\n[task.see-t7]\nkind = \"see\"\n\n[tag.t7]\nx = 1\n[task.c]\n[task.d]\n[task.e]\n[task.f]\n[task.g]\n[task.h]\n";
        let text = with_fifty_tasks(own).unwrap();
        assert_eq!(text.matches("kind = \"see\"").count(), 25);
        assert_eq!(text.matches("x = 1\n").count(), 1);
    }
}
