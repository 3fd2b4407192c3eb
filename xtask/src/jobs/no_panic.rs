//! `no_panic`: checks that no panic can be reached from the functions that a controller calls.

use crate::arguments::Arguments;
use crate::board::{self, Level};
use crate::files::target_folder;
use crate::need::{self, THUMBS};
use crate::report::Report;
use crate::shell::{Result, cmd};

/// The linker's message for a panic that can be reached.
const SEEN: &str = "undefined symbol: a_panic_is_reachable";

/// Makes links that fail if a panic can be reached, at level 3 and for size, and checks that one fails with an added panic.
pub fn no_panic(_: &Arguments) -> Result {
    need::targets(&THUMBS)?;
    board::build_all(Level::Fast, &THUMBS, &["no_panic"])?;
    board::build_all(Level::Small, &THUMBS, &["no_panic"])?;
    let mut report = Report::default();
    for target in THUMBS {
        // What the example depends on stays as it was built above.
        let seeded = cmd(
            "cargo rustc -p posegate --profile firmware --features firmware --example no_panic",
        )
        .args(["--target", target])
        .arg("--target-dir")
        .arg(target_folder())
        .words("-- --cfg seeded_panic")
        .quiet()?;
        if !sees_panic(&seeded.text, target) {
            return Err(format!(
                "{}\nthe link test does not see a panic on {target}",
                seeded.text
            )
            .into());
        }
        report.at_most(&format!("panics reachable, {target}"), 0, "panics", 0);
        report.at_most(
            &format!("panics reachable for size, {target}"),
            0,
            "panics",
            0,
        );
    }
    report.finish()
}

/// Returns `true` if the link for a target has failed by the added panic.
fn sees_panic(text: &str, target: &str) -> bool {
    text.split("error: linking with").skip(1).any(|link| {
        let link = link.split("error: could not compile").next().unwrap_or("");
        link.contains(&format!("/{target}/")) && link.contains(SEEN)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_target_needs_its_own_failed_link() {
        let text = format!(
            "Compiling\nerror: linking with `rust-lld` failed\n-o /t/{}/a\n{SEEN}\n",
            THUMBS[0]
        );
        assert!(sees_panic(&text, THUMBS[0]));
        assert!(!sees_panic(&text, THUMBS[1]));
        let more = format!(
            "{text}error: could not compile\nerror in /t/{}/a\n",
            THUMBS[1]
        );
        assert!(!sees_panic(&more, THUMBS[1]));
        let otherwise = text.replace(SEEN, "undefined symbol: memcpy");
        assert!(!sees_panic(&otherwise, THUMBS[0]));
        assert!(!sees_panic(SEEN, THUMBS[0]));
    }
}
