//! Docks and tags that are not where the site file places them are found and named. Others are not reported.

use crate::command::{Case, lines, run};
use crate::distribution::Random;
use posegate_learn::{Look, OffsetReport, Surveyed, SurveyedSite, acceptance, survey};
use std::fmt::Write;

/// Four docks along a wall, each with its own tag in the wall. Neighbouring docks see the tags too.
fn hall() -> SurveyedSite {
    let docks = (0..4).map(|k| {
        let dock = [2.0 * f64::from(k), 0.0, 0.5 * f64::from(k)];
        (format!("dock-{k}"), dock)
    });
    let tags = (0..5).map(|k| (format!("t{k}"), [2.0 * f64::from(k) - 1.0, 2.0]));
    SurveyedSite {
        docks: docks.collect(),
        tags: tags.collect(),
    }
}

/// The displaced docks and tags, with x, y (m), yaw (rad).
type Off<'a> = &'a [(Surveyed, &'a str, [f64; 3])];

/// Returns the looks of dockings at all docks, each by its two neighbouring tags. The robot is in a dock to within 3 mm and 0.3 deg. A
/// look has errors of 5 mm and 0.5 deg, and `bias`. Poses are those of rigid bodies in the plane, not linearised.
fn dockings(site: &SurveyedSite, each: u32, off: Off<'_>, bias: [f64; 3], seed: u64) -> Vec<Look> {
    let mut random = Random(seed);
    let mut rows = Vec::new();
    let displaced = |kind, name: &str| {
        let known = off.iter().find(|off| (off.0, off.1) == (kind, name));
        known.map_or([0.0; 3], |off| off.2)
    };
    for docking in 0..each {
        for k in 0..4 {
            let dock = format!("dock-{k}");
            let goal = site.docks[&dock];
            let moved = displaced(Surveyed::Dock, &dock);
            let play = [0.003, 0.003, 0.005].map(|sigma| sigma * random.normal());
            let robot = [0, 1, 2].map(|i| goal[i] + moved[i] + play[i]);
            for tag in [format!("t{k}"), format!("t{}", k + 1)] {
                let [tx, ty] = site.tags[&tag];
                let [dx, dy, turn] = displaced(Surveyed::Tag, &tag);
                // The robot in the axes of the true tag, placed by the surveyed one.
                let [x, y] = [robot[0] - tx - dx, robot[1] - ty - dy];
                let (s, c) = (-turn).sin_cos();
                let error = [0.005, 0.005, 0.009].map(|sigma| sigma * random.normal());
                let pose = [
                    tx + c * x - s * y + error[0] + bias[0],
                    ty + s * x + c * y + error[1] + bias[1],
                    robot[2] - turn + error[2] + bias[2],
                ];
                rows.push(Look {
                    run: format!("{docking} at {dock}"),
                    dock: dock.clone(),
                    tag,
                    pose,
                });
            }
        }
    }
    rows
}

fn stale(found: &[OffsetReport]) -> Vec<&str> {
    let stale = found.iter().filter(|report| report.stale);
    stale.map(|report| report.name.as_str()).collect()
}

#[test]
fn false_alarms_are_as_rare_as_stated() {
    const SURVEYS: u64 = 400;
    let site = hall();
    let confidence = 0.9;
    let calm = |seed: &u64| {
        let rows = dockings(&site, 8, &[], [0.0; 3], 7000 + seed);
        stale(&survey(&rows, &site, confidence).unwrap()).is_empty()
    };
    let count = (0..SURVEYS).filter(calm).count() as u64;
    let [least, _] = acceptance(SURVEYS, confidence, 0.99);
    println!("{count} of {SURVEYS} surveys call nothing off");
    assert!(count >= least, "{count} of {SURVEYS}");
    // A camera with a bias breaks the assumption.
    let biased = |seed: &u64| {
        let rows = dockings(&site, 8, &[], [0.0, 0.0, 0.02], 7000 + seed);
        stale(&survey(&rows, &site, confidence).unwrap()).is_empty()
    };
    assert!((0..50).filter(biased).count() < 5);
    // Rows of one docking that are given as several dockings break it too.
    let repeated = |seed: &u64| {
        let once = dockings(&site, 8, &[], [0.0; 3], 7000 + seed);
        let again = |copy: u32| {
            let named = once.iter().cloned();
            named.map(move |look| Look {
                run: format!("{} again {copy}", look.run),
                ..look
            })
        };
        let rows: Vec<Look> = (0..10).flat_map(again).collect();
        stale(&survey(&rows, &site, confidence).unwrap()).is_empty()
    };
    let count = (0..100).filter(repeated).count() as u64;
    assert!(count < acceptance(100, confidence, 0.99)[0], "{count}");
}

/// A dock that was knocked, a tag that was moved, and both: named, and each true offset in its region.
#[test]
fn displaced_dock_or_tag_is_named_with_its_offset() {
    let site = hall();
    let dock = (Surveyed::Dock, "dock-3", [0.02, 0.015, 0.0628]);
    let tag = (Surveyed::Tag, "t1", [-0.03, 0.01, 0.05]);
    for off in [&[dock][..], &[tag], &[dock, tag]] {
        let mut named = 0;
        let mut inside = [0u64; 2];
        for seed in 0..100 {
            let rows = dockings(&site, 12, off, [0.0; 3], 100 + seed);
            let found = survey(&rows, &site, 0.99).unwrap();
            let mut expected: Vec<&str> = off.iter().map(|off| off.1).collect();
            expected.sort_unstable();
            named += u32::from(stale(&found) == expected);
            for report in found.iter().filter(|report| report.stale) {
                assert!(report.or.is_empty(), "{report:?}");
                let Some((_, _, truth)) = off.iter().find(|off| off.1 == report.name) else {
                    continue;
                };
                let (offset, region) = (report.offset.unwrap(), report.region.unwrap());
                inside[0] += u64::from((0..3).all(|i| (offset[i] - truth[i]).abs() <= region[i]));
                inside[1] += 1;
            }
        }
        println!("{off:?}: named in {named} of 100, {inside:?} in the region");
        assert!(named >= 90, "{off:?}: {named}");
        assert!(inside[0] * 100 >= inside[1] * 95, "{off:?}: {inside:?}");
    }
}

/// A dock and a tag that are only seen together cannot be distinguished, and both are named.
#[test]
fn dock_and_tag_seen_only_together_are_both_named() {
    let site = hall();
    let off = [(Surveyed::Tag, "t0", [0.03, 0.0, 0.04])];
    let rows: Vec<Look> = dockings(&site, 12, &off, [0.0; 3], 5)
        .into_iter()
        .filter(|look| look.tag == "t0")
        .collect();
    let found = survey(&rows, &site, 0.99).unwrap();
    let report = found.iter().find(|report| report.stale).unwrap();
    let names = [report.name.as_str(), report.or[0].1.as_str()];
    assert!(
        names.contains(&"t0") && names.contains(&"dock-0"),
        "{report:?}"
    );
    assert_eq!(stale(&found).len(), 1);
    // Too few dockings give no result.
    let few = survey(&rows[..4], &site, 0.99).unwrap();
    assert!(
        few.iter()
            .all(|report| report.offset.is_none() && !report.stale)
    );
    assert!(survey(&rows, &site, 1.0).is_err());
}

#[test]
fn survey_command_names_a_displaced_dock() {
    let folder = Case::new(&[]);
    let site = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/sites/dock.toml"
    );
    let rows = |yaw: f64| {
        let mut random = Random(12);
        let mut text = "run,dock,tag,x_m,y_m,yaw_rad\n".to_owned();
        for docking in 0..20 {
            let [x, y, turn] = [0; 3].map(|_| 0.004 * random.normal());
            writeln!(text, "{docking},dock,t7,{x},{},{}", y + 0.025, turn + yaw).unwrap();
        }
        text
    };
    folder.write("off.csv", rows(3.6f64.to_radians()));
    let (out, _err) = folder.expect(1, &format!("learn survey {site} off.csv"));
    assert!(
        out.contains("re-survey dock or tag t7: 3.") && out.contains("cm off"),
        "{out}"
    );
    let (code, out, _) = run(&folder, &format!("learn survey {site} off.csv --json"));
    let report = &lines(&out)[0];
    assert_eq!((code, &report["docks"][0]["resurvey"]), (1, &true.into()));
    let offset = &report["docks"][0]["offset"];
    let near =
        |key: &str, value: f64, off: f64| (offset[key].as_f64().unwrap() - value).abs() < off;
    assert!(
        near("y_m", 0.025, 0.004) && near("yaw_deg", 3.6, 0.3),
        "{offset}"
    );
    // A column with equal values in all dockings is not a measurement.
    let mut constant = "run,dock,tag,x_m,y_m,yaw_rad\n".to_owned();
    for docking in 0..6 {
        let off = 0.001 * f64::from(docking * docking % 5);
        writeln!(
            constant,
            "{docking},dock,t7,0.1,{off},{}",
            0.5 * off - 1e-4 * f64::from(docking)
        )
        .unwrap();
    }
    folder.write("constant.csv", &constant);
    let (code, out, err) = run(&folder, &format!("learn survey {site} constant.csv"));
    assert!(
        code == 0 && out.matches("do not scatter").count() == 2 && !out.contains("re-survey"),
        "{out} {err}"
    );
    let (_, out, _) = run(&folder, &format!("learn survey {site} constant.csv --json"));
    let report = &lines(&out)[0]["docks"][0];
    assert!(
        report["region"].is_null() && report["resurvey"] == false,
        "{report}"
    );
    let good = rows(0.0);
    for (from, to, place) in [
        ("3,dock,t7", "3,doc,t7", "bad.csv:5:2"),
        ("3,dock,t7", "3,dock,t8", "bad.csv:5:3"),
        ("3,dock,t7", ",dock,t7", "bad.csv:5:1"),
    ] {
        folder.write(
            "bad.csv",
            good.replacen(&format!("\n{from}"), &format!("\n{to}"), 1),
        );
        folder
            .run(&format!("learn survey {site} bad.csv"))
            .is_refused_with(&[place]);
    }
}
