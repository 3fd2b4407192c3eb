//! `include/posegate.h` equals what cbindgen generates from `posegate-c`, and its reasons equal `posegate::gate::Reason`.
//!
//! `POSEGATE_BLESS=1 cargo test -p posegate-c --test c_header` rewrites it.

use posegate::gate::Reason;
use std::path::{Path, PathBuf};

const HEADER: &str = "include/posegate.h";

fn at_root(path: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)
}

/// Returns the header that cbindgen generates from the crate and the reasons.
fn generated() -> String {
    let config = cbindgen::Config::from_file(at_root("cbindgen.toml")).expect("cbindgen.toml");
    let bindings = cbindgen::Builder::new()
        .with_config(config)
        .with_src(at_root("crates/posegate-c/src/lib.rs"))
        .with_src(at_root("src/gate/reason.rs"))
        .with_src(at_root("src/report/mavlink.rs"))
        .with_src(at_root("src/report/ros.rs"))
        .with_src(at_root("src/track/model.rs"))
        .generate()
        .unwrap_or_else(|error| panic!("cbindgen: {error}"));
    let mut header = Vec::new();
    bindings.write(&mut header);
    let header = String::from_utf8(header).expect("a header is UTF-8");
    header.lines().map(as_c).collect()
}

/// Returns a line with the suffix U that cbindgen omits: numbers are unsigned, as are their fields.
fn as_c(line: &str) -> String {
    let is_number = line.starts_with("#define ") && line.ends_with(|c: char| c.is_ascii_digit());
    let suffix = if is_number { "U" } else { "" };
    format!("{line}{suffix}\n")
}

/// Returns the committed header. With `POSEGATE_BLESS=1` it is first replaced by the generated one.
fn committed() -> String {
    if std::env::var_os("POSEGATE_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(at_root(HEADER), generated()).expect("the header is written");
    }
    std::fs::read_to_string(at_root(HEADER)).unwrap_or_else(|error| panic!("{HEADER}: {error}"))
}

#[test]
fn header_equals_cbindgen_output() {
    assert!(
        committed() == generated(),
        "{HEADER} differs: POSEGATE_BLESS=1 cargo test -p posegate-c --test c_header"
    );
}

/// The header has every reason with its number, and no other reason.
#[test]
fn header_reasons_equal_crate_reasons() {
    let header = committed();
    let found: Vec<(&str, u8)> = header
        .lines()
        .filter_map(|line| line.trim().strip_prefix("POSEGATE_REASON_"))
        .map(|line| {
            let (name, code) = line.split_once(" = ").expect("a number");
            (name, code.trim_end_matches(',').parse().expect("a code"))
        })
        .collect();
    let names: Vec<String> = Reason::ALL
        .iter()
        .map(|reason| reason.name().to_ascii_uppercase())
        .collect();
    let expected: Vec<(&str, u8)> = names
        .iter()
        .zip(Reason::ALL)
        .map(|(name, reason)| (name.as_str(), reason.code()))
        .collect();
    assert_eq!(found, expected);
}

/// Two rules of MISRA C:2012 that a compiler does not check: no function-like macro (directive 4.9), and no integer type
/// whose size depends on the compiler (directive 4.6).
#[test]
fn header_has_only_plain_c() {
    let header = committed();
    let code: String = without_comments(&header);
    for line in code.lines() {
        let macro_name = line.strip_prefix("#define ").unwrap_or_default();
        let name = macro_name.split_whitespace().next().unwrap_or_default();
        assert!(!name.contains('('), "a function-like macro: {line}");
        for kind in ["int", "long", "short", "unsigned", "signed", "enum", "bool"] {
            let used = line
                .split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .any(|word| word == kind);
            // The fields that hold an enum have a type of fixed size.
            let declares = line.starts_with("enum ") || line.starts_with("typedef enum ");
            assert!(!used || declares, "{kind}: {line}");
        }
    }
    for function in code
        .lines()
        .filter(|line| line.contains("posegate_") && line.contains('('))
    {
        assert!(!function.contains("()"), "no prototype: {function}");
    }
    assert!(code.matches("(").count() >= 20, "few functions");
}

/// A C program may use each macro and each constant: the compiler knows every word in them.
#[test]
fn every_macro_and_constant_compiles() {
    let code = without_comments(&committed());
    let macros = code
        .lines()
        .filter_map(|line| line.strip_prefix("#define ")?.split_once(' '))
        .map(|(name, _)| name);
    let constants = code
        .lines()
        .filter_map(|line| line.strip_prefix("    POSEGATE_")?.split_once(" = "))
        .map(|(name, _)| format!("POSEGATE_{name}"));
    let mut program = String::from("#include \"posegate.h\"\n");
    let mut count = 0;
    for name in macros.map(str::to_owned).chain(constants) {
        program += &format!("const long long value_{count} = (long long)({name});\n");
        count += 1;
    }
    assert!(count > 100, "only {count} macros and constants");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("constants.c");
    std::fs::write(&file, program).expect("the program is written");
    let output = std::process::Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"])
        .arg("-I")
        .arg(at_root("include"))
        .arg(&file)
        .output()
        .expect("a C compiler `cc`");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

/// Every name of a type, a function or a constant in a comment is declared.
#[test]
fn comments_name_what_is_declared() {
    let header = committed();
    let code = without_comments(&header);
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let declared: std::collections::BTreeSet<&str> = code.split(|c| !is_word(c)).collect();
    // Names in backquotes; one that ends with `_` is the beginning of several.
    let named = header.split('`').skip(1).step_by(2).filter(|name| {
        let is_own = name.starts_with("posegate_") || name.starts_with("POSEGATE_");
        is_own && name.chars().all(is_word) && !name.ends_with('_')
    });
    let (unknown, known): (Vec<&str>, Vec<&str>) = named.partition(|name| !declared.contains(name));
    assert!(unknown.is_empty(), "{unknown:?}");
    assert!(known.len() > 100, "{}", known.len());
}

fn without_comments(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("/*") {
        code.push_str(before);
        rest = after.split_once("*/").map_or("", |(_, rest)| rest);
    }
    code.push_str(rest);
    code
}
