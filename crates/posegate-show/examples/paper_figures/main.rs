//! Draws Figs. 1 to 3 of the paper as the paper has them: `paper_figures FOLDER`. `posegate demo` draws the same results by the pictures
//! of any site, and Fig. 4.

mod figures;

use posegate_show::draw::study::CaseStudy;
use std::path::PathBuf;

fn main() -> figures::Result<()> {
    let folder = std::env::args_os().nth(1);
    let folder = PathBuf::from(folder.ok_or("usage: paper_figures FOLDER")?);
    std::fs::create_dir_all(&folder)?;
    for (name, text) in figures::all(&CaseStudy::run(&|| ())?)? {
        std::fs::write(folder.join(name), text)?;
    }
    Ok(())
}
