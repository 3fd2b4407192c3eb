//! `no_panic`: checks that no panic can be reached from the functions that a controller calls.

use crate::arguments::Arguments;
use crate::board;
use crate::files::target_folder;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd};

/// Makes links that fail if a panic can be reached, at level 3 and for size, and checks that one fails with an added panic.
pub fn no_panic(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    let mut report = Report::default();
    for target in THUMBS {
        board::build(target, "no_panic")?;
        let seeded = cmd(&format!("cargo build -p posegate --profile firmware --target {target} --features firmware --example no_panic"))
            .env("RUSTFLAGS", "--cfg seeded_panic")
            .arg("--target-dir")
            .arg(target_folder().join("seeded"))
            .quiet()?;
        if seeded.code == 0 {
            return Err(format!("the link test does not see a panic on {target}").into());
        }
        if !seeded
            .text
            .contains("undefined symbol: a_panic_is_reachable")
        {
            return Err(format!(
                "{}\nthe build with a panic failed otherwise on {target}",
                seeded.text
            )
            .into());
        }
        report.at_most(&format!("panics reachable, {target}"), 0, "panics", 0);
        board::build_small(target, "no_panic")?;
        report.at_most(
            &format!("panics reachable for size, {target}"),
            0,
            "panics",
            0,
        );
    }
    report.finish()
}
