//! The smallest firmware with a gate, `examples/docking_gate.rs`, in QEMU: it opens after consecutive permits and its hold
//! time, and closes on a denial and when reports end. With `POSEGATE_FIRMWARE=c` the same tests run with
//! `examples/c/docking_gate.c`.

use posegate_testkit::firmware;

use std::path::Path;
use std::process::Command;

/// The gate is closed for 500 ms after its start and after a denial; three consecutive permits arrive in that time. Reports
/// end at 3000 ms, and a permit is held for 100 ms.
const EXPECTED: &str = "\
500 ms: open
1500 ms: closed, not_contained
2050 ms: open
3110 ms: closed, silent
59 reports
";

#[test]
fn the_smallest_gate_opens_and_closes() {
    let output = Command::new("timeout")
        .args([
            "60",
            "qemu-system-arm",
            "-M",
            "mps2-an386",
            "-display",
            "none",
        ])
        .args(["-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(firmware::in_either("docking_gate"))
        .output()
        .expect("qemu-system-arm is missing: apt-get install -y qemu-system-arm");
    assert_eq!(
        String::from_utf8_lossy(&output.stdout),
        EXPECTED,
        "{output:?}"
    );
    assert!(output.status.success(), "{output:?}");
}

/// Users copy these examples, so neither calls functions that are only for recordings and benches.
#[test]
fn smallest_gates_use_only_the_gate_api() {
    for (path, needs) in [
        (
            "examples/docking_gate.rs",
            ["gate.step(", "gate.tick(", "permits_in_a_row:"],
        ),
        (
            "examples/c/docking_gate.c",
            [
                "posegate_gate_step(",
                "posegate_gate_tick(",
                ".permits_in_a_row =",
            ],
        ),
    ] {
        let text = std::fs::read_to_string(
            Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path),
        )
        .unwrap();
        for need in needs {
            assert!(text.contains(need), "{path}: no {need}");
        }
        for never in ["judge", "Evaluator", "decide(", "of_single"] {
            assert!(!text.contains(never), "{path}: {never}");
        }
    }
}
