//! `figures`: draws every picture.

use crate::arguments::Arguments;
use crate::files::{self, name, release};
use crate::report::Report;
use crate::shell::{Result, cmd, program_at};

const SITE: &str = "examples/sites/loading-bay.toml";
/// The least number of pictures.
const DRAWN: usize = 15;

/// Draws every picture into a folder: the case study's, those of the loading bay, of which two are in docs/, and a plan's. Fails if one in docs/ is
/// not what the program draws.
pub fn figures(given: &Arguments) -> Result {
    given.required(0, "the folder for the pictures")?;
    let folder = given.path(0).unwrap_or_default();
    cmd("cargo build --release --bin posegate").run()?;
    let posegate = || program_at(&release("posegate"));
    posegate().words("demo -o").arg(&folder).run()?;
    for task in ["see-bay", "enter-bay"] {
        let table = folder.join(format!("{task}.posegate"));
        posegate()
            .words(&format!("table build {SITE} --task {task} -o"))
            .arg(&table)
            .run()?;
        posegate()
            .words(&format!("draw {SITE} --task {task} --expected --table"))
            .arg(&table)
            .arg("-o")
            .arg(folder.join(format!("{task}-sections.svg")))
            .print()?;
        posegate()
            .words(&format!(
                "draw {SITE} --task {task} --kind plan --expected -o"
            ))
            .arg(folder.join(format!("{task}-plan.svg")))
            .print()?;
    }
    posegate()
        .words(&format!(
            "draw {SITE} --task see-bay --kind image --expected -o"
        ))
        .arg(folder.join("see-bay-image.svg"))
        .print()?;
    posegate()
        .words(&format!("check {SITE} --draw"))
        .arg(folder.join("check"))
        .run()?;
    posegate()
        .words("plan examples/sites/paper-chain.toml --from back-to-dock --to dock -o")
        .arg(folder.join("plan.svg"))
        .run()?;
    let pictures = files::files_ending("docs", ".svg")?;
    for picture in &pictures {
        let name = name(picture);
        // Measurements, which are drawn by `cargo xtask planning docs/planning-growth.svg` and `cargo xtask scale docs/scale-endpoints.svg
        // docs/scale-nodes.svg`; and one that was drawn by hand.
        if name == "planning-growth.svg"
            || name.starts_with("scale-")
            || name == "first-picture.svg"
        {
            files::copy(picture, folder.join(name))?;
        }
    }
    for picture in &pictures {
        let drawn = folder.join(name(picture));
        if !drawn.is_file() || files::bytes(picture)? != files::bytes(&drawn)? {
            let (picture, drawn) = (picture.display(), drawn.display());
            return Err(
                format!("{picture} is not what the program draws: cp {drawn} {picture}").into(),
            );
        }
    }
    let drawn = files::files_below(&folder);
    let count = drawn
        .iter()
        .filter(|path| path.extension().is_some_and(|end| end == "svg"))
        .count();
    let mut report = Report::default();
    report.at_least("pictures drawn", count, "pictures", DRAWN);
    report.finish()
}
