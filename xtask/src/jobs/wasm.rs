//! `wasm` and `wasm_bytes`: the core as WebAssembly, which the page of `posegate report` contains.

use crate::arguments::Arguments;
use crate::files::{self, target_folder};
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd};
use std::path::PathBuf;

const TARGET: &str = "wasm32-unknown-unknown";
/// The committed module.
const COMMITTED: &str = "crates/posegate-show/src/page/core.wasm";
const MOST_BYTES: u64 = 150_000;

/// Builds the module. It imports nothing (a panic that can be reached would be an import), and is small.
pub fn wasm(_: &Arguments) -> Result {
    build().map(drop)
}

/// Checks that the committed module is what the pinned compiler makes from the source, byte for byte.
pub fn wasm_bytes(_: &Arguments) -> Result {
    let core = build()?;
    if files::bytes(&core)? != files::bytes(COMMITTED)? {
        // Another compiler makes other bytes: those of the page are from the compiler in rust-toolchain.toml.
        let compiler = cmd("rustc --version").read()?;
        let (core, compiler) = (core.display(), compiler.trim());
        return Err(format!(
            "{COMMITTED} is not what {compiler} makes of the source: cp {core} {COMMITTED}"
        )
        .into());
    }
    Ok(())
}

fn build() -> Result<PathBuf> {
    need::targets(&[TARGET])?;
    // The page is better small than fast.
    cmd(&format!("cargo rustc -p posegate-c --lib --crate-type cdylib --profile firmware --target {TARGET} -- -C strip=symbols"))
        .env("CARGO_PROFILE_FIRMWARE_OPT_LEVEL", "s")
        .run()?;
    let core = target_folder()
        .join(TARGET)
        .join("firmware/posegate_c.wasm");
    let mut report = Report::default();
    report.at_most("core as WebAssembly", files::size(&core)?, "B", MOST_BYTES);
    for (name, path) in [
        ("the module that was built", core.as_path()),
        (COMMITTED, COMMITTED.as_ref()),
    ] {
        let ids = sections(&files::bytes(path)?)
            .ok_or_else(|| format!("{name} is not a WebAssembly module"))?;
        report.require(!ids.contains(&IMPORTS), format_args!("imports of {name}"));
    }
    report.finish()?;
    Ok(core)
}

/// The number of the section of imports.
const IMPORTS: u8 = 2;

/// Returns the numbers of a module's sections, or nothing if it is not a module.
fn sections(module: &[u8]) -> Option<Vec<u8>> {
    let mut rest = module.strip_prefix(b"\0asm\x01\0\0\0")?;
    let mut ids = Vec::new();
    while let [id, after @ ..] = rest {
        let mut length = 0_usize;
        let mut used = 0;
        loop {
            let byte = *after.get(used)?;
            length |= usize::from(byte & 0x7f).checked_shl(7 * used as u32)?;
            used += 1;
            if byte & 0x80 == 0 {
                break;
            }
        }
        ids.push(*id);
        rest = after.get(used..)?.get(length..)?;
    }
    Some(ids)
}

#[cfg(test)]
mod tests {
    use super::sections;

    #[test]
    fn sections_are_listed_by_their_numbers() {
        let mut module = b"\0asm\x01\0\0\0\x01\x02ab\x02\x81\x01".to_vec();
        module.extend([0; 129]);
        assert_eq!(sections(&module), Some(vec![1, 2]));
        module.pop();
        assert_eq!(sections(&module), None);
        assert_eq!(sections(b"\x7fELF"), None);
    }
}
