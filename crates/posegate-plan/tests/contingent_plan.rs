//! A contingent plan on the controller: the firmware example under emulation makes the same steps as the host,
//! through a lost tag and a surprise. The committed rules and tables equal those made from the committed site.
//!
//! `POSEGATE_BLESS=1 cargo test -p posegate-plan --test contingent_plan` rewrites them.

#[path = "../../../examples/support/contingent_run.rs"]
mod contingent_run;
use posegate_testkit::firmware;

use posegate::bake::BakeInput;
use posegate::verify::build;
use posegate_plan::{Options, Prepared};
use posegate_site::Site;
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn firmware_makes_the_same_steps() {
    let mut here = String::new();
    contingent_run::run(&mut here).unwrap();
    let elf = firmware::build_with("contingent_plan", "firmware");
    let output = Command::new("qemu-system-arm")
        .args(["-M", "mps2-an386", "-display", "none", "-monitor", "none"])
        .args(["-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(elf)
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|e| panic!("qemu-system-arm: {e}: apt-get install -y qemu-system-arm"));
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::str::from_utf8(&output.stdout).unwrap(), here);
    println!("{here}");
    let lines: Vec<&str> = here.lines().collect();
    // The tag on the left is tried twice, then skipped.
    assert!(lines[1].contains("look at tag 7") && lines[2].contains("look at tag 7"));
    assert!(lines[3].contains("drive") && lines[4].contains("look at tag 9"));
    // The slip is a surprise: the robot looks again, then docks, and the plan ends.
    assert!(lines[6].contains("look at tag 9") && lines[6].ends_with("surprises 1"));
    assert!(lines[8].contains("work (dock), permitted"), "{here}");
    assert!(lines[9].contains("inhibit (Done)") && lines[10].contains("inhibit (Done)"));
    assert!(!here.contains("DENIED"));
}

#[test]
fn committed_rules_are_made_from_the_committed_site() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("examples");
    let site = Site::read(root.join("sites/contingent.toml")).unwrap();
    let mut made = Vec::new();
    for (task, file) in [
        ("see-left", "see-left.posegate"),
        ("see-right", "see-right.posegate"),
        ("dock", "contingent-dock.posegate"),
    ] {
        let found = site.task(task).unwrap();
        let order = BakeInput {
            task,
            success: &found.success,
            spec: site.chosen_table(found).unwrap(),
            epsilon: site.epsilon,
        };
        made.push((file, build(&order, &|| ()).unwrap().0));
    }
    let options = Options {
        survive_a_lost_tag: true,
        ..Options::default()
    };
    let start = &site.chains["anywhere"].start;
    let planned = Prepared::of(&site, None)
        .unwrap()
        .plan(start, "dock", &options)
        .unwrap();
    assert_eq!(planned.contingencies.len(), 1);
    made.push(("contingent.rules", planned.rules(&site).unwrap()));
    for (file, bytes) in made {
        let path = root.join("tables").join(file);
        if std::env::var_os("POSEGATE_BLESS").is_some() {
            std::fs::write(&path, &bytes).unwrap();
        }
        assert!(
            std::fs::read(&path).unwrap() == bytes,
            "{file}: differs; POSEGATE_BLESS=1 cargo test -p posegate-plan --test contingent_plan"
        );
    }
}
