//! `msrv`: the oldest compiler that Cargo.toml names.

use crate::arguments::Arguments;
use crate::files;
use crate::report::Report;
use crate::shell::{Result, cmd, say};

/// Checks the library, without features and with `std`, and the program. Installs the compiler if it is missing.
pub fn msrv(_: &Arguments) -> Result {
    let manifest = files::read("Cargo.toml")?;
    let version = version(&manifest).ok_or("Cargo.toml has no rust-version = \"..\"")?;
    if cmd(&format!("cargo +{version} --version")).quiet()?.code != 0 {
        say(&format!(
            "rustup toolchain install {version} --profile minimal"
        ));
        cmd(&format!(
            "rustup toolchain install {version} --profile minimal"
        ))
        .run()?;
    }
    let checks = [
        "-p posegate",
        "-p posegate --features std",
        "-p posegate-c",
        "-p posegate-cli",
    ];
    for check in checks {
        cmd(&format!("cargo +{version} check --locked {check}")).run()?;
    }
    let mut report = Report::default();
    report.at_least(
        &format!("builds that Rust {version} checks"),
        checks.len(),
        "builds",
        checks.len(),
    );
    report.finish()
}

/// Returns the value of the first `rust-version` of a manifest.
fn version(manifest: &str) -> Option<&str> {
    let mut values = manifest
        .lines()
        .filter_map(|line| line.strip_prefix("rust-version = \""));
    values.next()?.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::version;

    #[test]
    fn version_is_the_value_of_rust_version() {
        let manifest = "[package]\nedition = \"2024\"\nrust-version = \"1.93\"\n";
        assert_eq!(version(manifest), Some("1.93"));
        assert_eq!(version("rust-version.workspace = true"), None);
    }
}
