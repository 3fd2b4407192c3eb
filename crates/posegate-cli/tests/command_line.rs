//! The contract of the command line: exit codes, places in files, no partly written files.

use posegate_site::SAMPLE;
use posegate_testkit::commands::elf;
use posegate_testkit::run::{Case, cases, command};
use serde_json::{Value, json};
use std::process::{Command, Stdio};

/// Returns a folder with the sample site.
fn sample() -> Case {
    Case::new(&[("site.toml", SAMPLE.as_bytes())])
}

const HEADER: &str = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";

/// A table tells the share of the set that it holds, and what it lacks on stderr: of a union the set that it lacks.
#[test]
fn table_build_warns_of_what_table_lacks() {
    let folder = sample();
    let build = |success: &str, xy: f64, options: &str| {
        let site = format!(
            "[task.t]\nkind = \"work\"\ngoal = {{ x = 1.0, y = 0.0, yaw_deg = 90.0 }}\nsuccess = {success}\n[confidence]\nepsilon = 0.99\n\
             [table]\nextent = {{ x = [-1.0, 1.0], y = [-1.0, 1.0], yaw_deg = [-10.0, 10.0] }}\nstep = {{ xy = {xy:?}, yaw_deg = 1.0 }}\n"
        );
        folder.write("t.toml", site);
        folder.expect(
            0,
            &format!("table build t.toml --task t -o t.posegate {options}"),
        )
    };
    let covered = |out: &str| {
        let built: Value = serde_json::from_str(out).unwrap();
        built["covered"].as_f64().unwrap()
    };
    let large = "{ shape = \"box\", x = [-0.8, 0.4], y = [-0.53, 0.5], yaw_deg = [-8.0, 8.0] }";
    let (out, err) = build(large, 0.02, "--json");
    assert!(covered(&out) > 0.99 && err.is_empty(), "{out} {err}");
    let (out, _) = build(large, 0.02, "");
    assert!(
        out.contains("% of the success set within its extent, by 2"),
        "{out}"
    );
    // Cells of 10 cm: the strips of 3 cm and more at the border are lost.
    let (out, err) = build(large, 0.1, "--json --layout grid");
    assert!((covered(&out) - 1.0 / 1.03).abs() < 0.01, "{out}");
    assert!(
        err.contains("of the success set within its extent; most are missing at x "),
        "{err}"
    );
    assert!(err.contains("y -0.53 to -0.2"), "{err}");
    // A small set between the cells next to a large one.
    let small = "{ shape = \"box\", x = [0.61, 0.69], y = [0.61, 0.69], yaw_deg = [-8.0, 8.0] }";
    let aligned = "{ shape = \"box\", x = [-0.8, 0.4], y = [-0.5, 0.5], yaw_deg = [-8.0, 8.0] }";
    let both = format!("{{ any = [{aligned}, {small}] }}");
    let (out, err) = build(&both, 0.1, "--json --layout grid");
    assert!(covered(&out) > 0.98, "{out}");
    assert!(
        err.contains("of the poses in set 2 of the union 0.0 %"),
        "{err}"
    );
    let (out, err) = build(&both, 0.02, "--json");
    assert!(covered(&out) > 0.98 && err.is_empty(), "{out} {err}");
}

#[test]
fn site_becomes_a_table_that_decides() {
    let folder = sample();
    folder.expect(0, "check site.toml");
    let built = folder.json(
        0,
        "table build site.toml --task dock -o dock.posegate --json --layout grid",
    );
    assert_eq!(built["proven"]["cells"], 384);
    let info = folder.json(0, "table info dock.posegate --json");
    assert_eq!(
        (&info["task"], &info["epsilon"]),
        (&"dock".into(), &0.99.into())
    );
    assert_eq!(info["task_digest"], built["task_digest"]);
    assert_eq!(info["table_digest"], built["table_digest"]);
    let task_digest = info["task_digest"].clone();
    // The site file is at hand only where the table is built.
    assert!(info["site_digest"].is_null());
    assert_eq!(built["site_digest"].as_str().unwrap().len(), 64);
    assert_ne!(built["site_digest"], built["task_digest"]);
    assert_eq!(info["parts"], json!(["cells"]));
    // The table's own bound on the instructions of a decision.
    let bytes = folder.read("dock.posegate");
    let worst = posegate::table::Table::parse(&bytes).unwrap().worst_case();
    assert_eq!(
        info["worst_case"],
        json!({"m4f": worst.instructions_m4f(), "m0plus": worst.instructions_m0_plus()})
    );
    assert!(worst.runs > 0 && info["worst_case"] == built["worst_case"]);
    let (out, _) = folder.expect(
        0,
        "table build site.toml --task dock -o text.posegate --layout grid",
    );
    let bound = format!(
        "at most {} instructions on a Cortex-M4F, {} on a Cortex-M0+",
        worst.instructions_m4f(),
        worst.instructions_m0_plus()
    );
    assert!(out.contains(&bound), "{out}");
    assert!(info["sight"].is_null());
    folder.expect(0, "table verify dock.posegate site.toml");
    folder.expect(0, "table build site.toml --task see-t7 -o see-t7.posegate");
    let info = folder.json(0, "table info see-t7.posegate --json");
    let sight = &info["sight"];
    assert_eq!((&sight["tag"], &sight["d_max"]), (&7.into(), &5.5.into()));
    assert_eq!(info["parts"], json!(["headings", "sight"]));
    assert_eq!(sight["tag_position"], json!([4.0, 0.0, 0.5]));
    assert_eq!(sight["camera"]["fx"], 615.0);
    assert!((sight["phi_max_deg"].as_f64().unwrap() - 25.0).abs() < 1e-6);
    for (layout, made) in [("facets", "facets"), ("both", "facets"), ("auto", "facets")] {
        let line = format!(
            "table build site.toml --task dock -o {layout}.posegate --layout {layout} --json"
        );
        let built = folder.json(0, &line);
        assert_eq!(built["layout"], made);
        assert!(
            built["proven"]["corners"].as_u64().unwrap() > 0
                && built["facets"]["count"].as_u64().unwrap() > 0
        );
        folder.expect(0, &format!("table verify {layout}.posegate site.toml"));
    }
    let permit = format!("{HEADER}0,0,0,0,1e-4,0,0,1e-4,0,1e-5\n");
    folder.write("permit.csv", &permit);
    for layout in ["facets", "both", "auto"] {
        folder.expect(0, &format!("gate {layout}.posegate --estimates permit.csv"));
    }
    let line = folder.json(0, "gate dock.posegate --estimates permit.csv --json");
    assert_eq!(
        (&line["verdict"], &line["reason"]),
        (&"permit".into(), &Value::Null)
    );
    assert_eq!(line["task_digest"], task_digest);
    folder.write(
        "both.csv",
        format!("{permit}0,0.07,0,0,1e-4,0,0,1e-4,0,1e-5\n"),
    );
    let (out, _) = folder.expect(1, "gate dock.posegate --estimates both.csv --json");
    let denied: Value = serde_json::from_str(out.lines().nth(1).unwrap()).unwrap();
    assert_eq!(
        (&denied["index"], &denied["reason"]),
        (&1.into(), &"not_contained".into())
    );
    assert!(
        denied["margin"].as_f64().unwrap() < 1.0
            && denied["worst_pose"][0].as_f64().unwrap() > 0.07
    );
    let line = folder.json(
        0,
        "contains site.toml --task see-t7 --poses permit.csv --json",
    );
    assert_eq!(
        (&line["inside"], &line["visible"], &line["d"]),
        (&true.into(), &true.into(), &3.75.into())
    );
    // A change of the task changes the claim, also if the table's poses are all in the changed set; a comment does not.
    for (x, why) in [("0.07", "cell (slab"), ("0.09", "task digest")] {
        let changed = SAMPLE.replace("0.08, 0.08", &format!("0.08, {x}"));
        folder.write("changed.toml", &changed);
        let (out, _) = folder.expect(1, "table verify dock.posegate changed.toml");
        assert!(out.contains("NOT proven") && out.contains(why), "{out}");
    }
    folder.write("commented.toml", format!("# a comment\n{SAMPLE}"));
    folder.expect(0, "table verify dock.posegate commented.toml");
}

#[test]
fn epsilon_option_changes_the_verdict() {
    let folder = sample();
    folder.expect(0, "table build site.toml --task dock -o dock.posegate");
    folder.write(
        "e.csv",
        format!("{HEADER}0,0,0,0,2.5e-4,0,0,2.5e-4,0,1e-5\n"),
    );
    folder.expect(0, "gate dock.posegate --estimates e.csv");
    folder.expect(1, "gate dock.posegate --estimates e.csv --epsilon 0.9999");
    for epsilon in ["0", "1", "-1", "nan", "inf", "1e-9", "2"] {
        folder
            .run(&format!(
                "gate dock.posegate --estimates e.csv --epsilon={epsilon}"
            ))
            .is_refused_with(&["epsilon"]);
    }
    for age in ["0", "2147483648"] {
        folder.expect(
            2,
            &format!("gate dock.posegate --estimates e.csv --max-age-ms {age}"),
        );
    }
    folder.expect(2, "gate dock.posegate --estimates e.csv --set bounded");
    folder.expect(
        0,
        "gate dock.posegate --estimates e.csv --set bounded --translation 0.05 --yaw-deg 2",
    );
    for bad in ["0", "-1", "nan", "inf"] {
        let line = format!(
            "gate dock.posegate --estimates e.csv --set bounded --translation={bad} --yaw-deg 2"
        );
        assert!(folder.expect(1, &line).0.contains("bound_invalid"));
    }
}

/// Returns the sample with the first `from` outside of comments replaced.
fn changed(from: &str, to: &str) -> String {
    let mut done = false;
    let lines = SAMPLE.lines().map(|line| {
        let is_changed = !done && line.split('#').next().unwrap_or("").contains(from);
        done |= is_changed;
        if is_changed {
            line.replacen(from, to, 1)
        } else {
            line.to_string()
        }
    });
    let text: Vec<String> = lines.collect();
    assert!(done, "the sample has no {from}");
    text.join("\n")
}

/// Each bad site file is named with its line and column, exits with 2, and leaves nothing behind.
#[test]
fn bad_site_is_reported_with_line_and_column() {
    let changes = "
        fx = 615.0 => fx = 0.0 => above 0
        fx = 615.0 => fx = \"615\" => is a string
        fx = 615.0 => fx = nan => fx
        fx = 615.0 => focal = 615.0 => unknown key
        yaw_deg = 180.0 => yaw = 3.14 => yaw_deg
        shape = \"box\" => shape = \"circle\" => circle
        kind = \"work\" => kind = \"wrok\" => wrok
        tag = \"t7\" => tag = \"t8\" => t8
        epsilon = 0.99 => epsilon = 1.0 => epsilon
        x = [-0.08, 0.08] => x = [0.08, -0.08] => 0.08
        [[2.25, 0.75], [-2.25, 0.75], [-2.25, -0.75], [2.25, -0.75]] => [[2.25, 0.75], [2.25, -0.75], [-2.25, -0.75], [-2.25, 0.75]] => clockwise
        [[2.5, 1.5], [-2.5, 1.5], [-2.5, -1.5], [2.5, -1.5]] => [[2.5, 1.5], [0.0, -0.1], [-2.5, -1.5], [2.5, -1.5]] => convex";
    for [from, to, fragment] in cases(changes) {
        let folder = sample();
        let text = changed(from, to);
        folder.write("bad.toml", &text);
        for line in [
            "check bad.toml",
            "table build bad.toml --task dock -o out.posegate",
        ] {
            let (_, err) = folder.expect(2, line);
            // Whitespace and line breaks of the report do not matter.
            assert!(
                err.contains("bad.toml:") && err.contains(fragment),
                "{to}: {err}"
            );
            let number = text
                .lines()
                .position(|l| l.contains(to.split(", [").next().unwrap()))
                .unwrap()
                + 1;
            assert!(
                err.contains(&format!("bad.toml:{number}:")),
                "{to}, line {number}: {err}"
            );
        }
        assert_eq!(folder.names(), ["bad.toml", "site.toml"]);
    }
}

#[test]
fn bad_tables_and_recordings_are_refused() {
    let folder = sample();
    folder.expect(
        0,
        "table build site.toml --task dock -o dock.posegate --layout both",
    );
    folder.write("e.csv", format!("{HEADER}0,0,0,0,1e-4,0,0,1e-4,0,1e-5\n"));
    let good = folder.read("dock.posegate");
    let mut flipped = good.clone();
    flipped[200] ^= 4;
    let mut version = good.clone();
    version[8] = 9;
    // Without its checksum a table with another version is a damaged one.
    let (content, crc) = version.split_last_chunk_mut().unwrap();
    *crc = posegate::table::checksum(content).to_le_bytes();
    for (name, bytes, word) in [
        ("flipped", flipped, "checksum"),
        ("cut", good[..200].to_vec(), "length"),
        ("version", version, "format"),
        ("empty", Vec::new(), "fewer"),
        (
            "text",
            b"this is a text of more than a hundred and eighty bytes. ".repeat(5),
            "POSEGATE",
        ),
    ] {
        folder.write(name, bytes);
        for line in [
            format!("gate {name} --estimates e.csv"),
            format!("table info {name}"),
            format!("table verify {name} site.toml"),
            format!("table export {name} --format c -o out.h"),
        ] {
            folder.run(&line).is_refused_with(&[word, name]);
        }
    }
    assert!(!folder.path().join("out.h").exists());
    for (text, fragment) in [
        ("x_m,y_m\n0,0\n".to_string(), "yaw_rad"),
        (HEADER.replace("cov_yy,", ""), "cov_yy"),
        (format!("{HEADER}0,0,zero,0,1,0,0,1,0,1\n"), "zero"),
        (
            format!("{HEADER}0,0,0,0,1,0,0\n"),
            "bad.csv:2:8: 7 fields; the header has 10",
        ),
        (
            format!("{HEADER}0,0,0,0,1e-4,0,0,1e-4,0,\"1e-5\n"),
            "\"1e-5",
        ),
    ] {
        folder.write("bad.csv", &text);
        folder
            .run("gate dock.posegate --estimates bad.csv")
            .is_refused_with(&["bad.csv", fragment]);
    }
    folder.expect(2, "gate dock.posegate --estimates missing.csv");
    // An unclosed quote hides no row.
    let row = "9,9,9,9,1,0,0,1,0,1";
    let header = HEADER.trim_end();
    folder.write("note.csv", format!("{header},note\n{row},\"a\n{row},b\n"));
    let (out, _) = folder.expect(1, "gate dock.posegate --estimates note.csv --json");
    assert!(out.contains("\"index\":1"), "{out}");
    // NaN is a number that is denied, not bad input.
    folder.write(
        "nan.csv",
        format!("{HEADER}0,nan,0,0,1e-4,0,0,1e-4,0,1e-5\n"),
    );
    assert!(
        folder
            .expect(1, "gate dock.posegate --estimates nan.csv")
            .0
            .contains("estimate_not_finite")
    );
}

#[test]
fn failed_command_writes_no_file() {
    let folder = sample();
    folder.expect(2, "table build site.toml --task nothing -o out.posegate");
    folder.expect(
        2,
        "table build site.toml --task dock -o missing/out.posegate",
    );
    folder.expect(
        2,
        "table build site.toml --task dock -o out.posegate --layout bits",
    );
    folder.write(
        "wide.toml",
        SAMPLE.replace("x = 4.0, y = 0.0, z = 0.5", "x = 200.0, y = 0.0, z = 0.5"),
    );
    folder
        .run("table build wide.toml --task see-t7 -o out.posegate --layout facets")
        .is_refused_with(&["facets"]);
    folder.write("large.toml", SAMPLE.replace("xy = 0.02", "xy = 0.00001"));
    folder
        .run("table build large.toml --task dock -o out.posegate")
        .is_refused_with(&["400000", "65535"]);
    assert_eq!(folder.names(), ["large.toml", "site.toml", "wide.toml"]);
    folder.expect(2, "init site.toml");
    assert_eq!(folder.text("site.toml"), SAMPLE);
}

/// An output that is a link replaces the linked file, and the link stays. An output that is not a regular file is written to
/// and stays what it is.
#[cfg(unix)]
#[test]
fn links_and_pipes_are_kept_as_outputs() {
    use std::os::unix::fs::FileTypeExt;
    let folder = sample();
    let path = |name: &str| folder.path().join(name);
    folder.expect(0, "table build site.toml --task dock -o plain.posegate");
    let table = folder.read("plain.posegate");
    folder.write("old.posegate", "old");
    std::os::unix::fs::symlink("old.posegate", path("link.posegate")).unwrap();
    folder.expect(0, "table build site.toml --task dock -o link.posegate");
    assert!(path("link.posegate").is_symlink());
    assert_eq!(folder.read("old.posegate"), table);
    let made = Command::new("mkfifo").arg(path("pipe")).status().unwrap();
    assert!(made.success());
    let mut reader = Command::new("cat")
        .arg(path("pipe"))
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut build = command(folder.path(), "table build site.toml --task dock -o pipe");
    let output = build.output().unwrap();
    let is_pipe = path("pipe").metadata().unwrap().file_type().is_fifo();
    if !is_pipe || !output.status.success() {
        // It would wait forever.
        reader.kill().unwrap();
    }
    assert!(is_pipe && output.status.success(), "{output:?}");
    assert_eq!(reader.wait_with_output().unwrap().stdout, table);
    std::os::unix::fs::symlink("nowhere.posegate", path("astray")).unwrap();
    folder
        .run("table build site.toml --task dock -o astray")
        .is_refused_with(&["a link to a file that does not exist"]);
    std::fs::remove_file(path("astray")).unwrap();
    assert_eq!(
        folder.names(),
        [
            "link.posegate",
            "old.posegate",
            "pipe",
            "plain.posegate",
            "site.toml"
        ]
    );
}

/// An output that is open already is appended to, even if the file no longer has a name.
#[cfg(target_os = "linux")]
#[test]
fn open_output_is_appended_to() {
    use std::io::{Read, Seek, Write};
    let folder = sample();
    folder.expect(0, "table build site.toml --task dock -o plain.posegate");
    let table = folder.read("plain.posegate");
    let path = |name: &str| folder.path().join(name);
    let open = |name: &str| {
        let mut options = std::fs::File::options();
        options.append(true).create(true).read(true);
        options.open(path(name)).unwrap()
    };
    let nameless = open("nameless");
    std::fs::remove_file(path("nameless")).unwrap();
    for mut log in [open("log"), nameless] {
        log.write_all(b"before").unwrap();
        let line = "table build site.toml --task dock --json -o /proc/self/fd/1";
        let mut command = command(folder.path(), line);
        let status = command.stdout(log.try_clone().unwrap()).status().unwrap();
        assert!(status.success());
        let mut all = Vec::new();
        log.rewind().unwrap();
        log.read_to_end(&mut all).unwrap();
        assert!(all.starts_with(b"before"));
        assert!(all.windows(table.len()).any(|part| part == table));
    }
    assert_eq!(folder.names(), ["log", "plain.posegate", "site.toml"]);
}

#[test]
fn exported_array_equals_the_table() {
    let folder = sample();
    folder.expect(0, "table build site.toml --task see-t7 -o t.posegate");
    let bytes = folder.read("t.posegate");
    for format in ["c", "rust"] {
        folder.expect(
            0,
            &format!("table export t.posegate --format {format} -o out"),
        );
        let text = folder.text("out");
        let body = text.split(['{', '[']).next_back().unwrap();
        let values: Vec<u8> = body
            .split("0x")
            .skip(1)
            .map(|hex| u8::from_str_radix(&hex[..2], 16).unwrap())
            .collect();
        assert_eq!(values, bytes, "{format}");
        assert!(text.contains("GENERATED by posegate") && text.contains("see-t7"));
        let worst = posegate::table::Table::parse(&bytes).unwrap().worst_case();
        let bound = format!("at most {} instructions", worst.instructions_m4f());
        assert!(text.contains(&bound), "{text}");
        assert!(text.contains("headings, sight"), "{text}");
    }
}

#[test]
fn version_starts_with_the_program_name() {
    let (out, _) = sample().expect(0, "--version");
    assert_eq!(out.trim(), concat!("posegate ", env!("CARGO_PKG_VERSION")));
}

#[test]
fn every_subcommand_has_help_with_an_example() {
    let folder = sample();
    for command in [
        "",
        "init",
        "check",
        "contains",
        "cost",
        "metrics",
        "table build",
        "table info",
        "table verify",
        "table export",
        "gate",
        "explain",
        "demo",
        "draw",
        "chain",
        "plan",
        "learn check",
        "learn survey",
    ] {
        let (out, _) = folder.expect(0, &format!("{command} --help"));
        assert!(out.contains("Example:\n  posegate"), "{command}: {out}");
    }
    folder.expect(2, "");
    folder.expect(2, "nonsense");
    folder
        .run("explain nonsense")
        .is_refused_with(&["the reasons are"]);
    folder
        .run("explain not_contaned")
        .is_refused_with(&["did you mean `not_contained`?"]);
    let (out, _) = folder.expect(0, "explain");
    for reason in posegate::gate::Reason::ALL {
        assert!(out.contains(reason.name()) && out.contains(reason.action()));
    }
}

/// Two runs of one build give the same bytes.
#[test]
fn builds_are_reproducible() {
    let folder = sample();
    folder.expect(0, "table build site.toml --task see-t7 -o a --threads 1");
    folder.expect(0, "table build site.toml --task see-t7 -o b --threads 2");
    let read = |name| folder.read(name);
    assert!(read("a") == read("b"));
}

/// Sites that `check` calls valid can be built, whatever their angles and steps.
#[test]
fn valid_site_with_unusual_numbers_is_built() {
    let folder = sample();
    let site = |goal: &str, yaw: &str, x: &str, extent: &str, xy: &str| {
        format!(
            "[task.t]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = {goal} }}\n\
             success = {{ shape = \"box\", x = {x}, y = {x}, yaw_deg = {yaw} }}\n\
             [table]\nextent = {{ x = {x}, y = {x}, yaw_deg = {extent} }}\nstep = {{ xy = {xy}, yaw_deg = 7.0 }}\n"
        )
    };
    for (goal, yaw, x, extent, xy, cells) in [
        (
            "1e6",
            "[-180, 180]",
            "[-0.1, 0.1]",
            "[-180, 180]",
            "0.02",
            10 * 10 * 52,
        ),
        (
            "-270.0",
            "[152.3, 512.3]",
            "[-0.1, 0.1]",
            "[152.3, 512.3]",
            "0.02",
            10 * 10 * 52,
        ),
        (
            "12.3",
            "[152.2, 512.2]",
            "[-0.1, 0.1]",
            "[152.2, 512.2]",
            "0.02",
            10 * 10 * 52,
        ),
        (
            "0.0",
            "[-7, 7]",
            "[-40.0, 40.0]",
            "[-7, 7]",
            "20.0",
            4 * 4 * 2,
        ),
        (
            "0.0",
            "[-7, 7]",
            "[-0.9999999999, 0.9999999999]",
            "[-7, 7]",
            "0.0333333",
            60 * 60 * 2,
        ),
    ] {
        folder.write("odd.toml", site(goal, yaw, x, extent, xy));
        folder.expect(0, "check odd.toml");
        let line = "table build odd.toml --task t -o odd.posegate --json --layout grid";
        let built = folder.json(0, line);
        let proven = built["proven"]["cells"].as_u64().unwrap();
        // The last row and column may lie half outside.
        assert!(
            proven <= cells && proven * 100 >= cells * 93,
            "{yaw} {xy}: {proven} of {cells}"
        );
    }
    // Sites that cannot be built are refused by `check`, with the task.
    for [from, to, fragment] in cases(
        "
        x = 0.0, y = 0.0, yaw_deg = 0.0 } => x = 5000.0, y = 0.0, yaw_deg = 0.0 } => 2000 m
        epsilon = 0.99 => epsilon = 0.001 => 0.001
        step = { xy = 0.02 => step = { xy = 0.0001 => 40000 rows
        ",
    ) {
        folder.write("bad.toml", changed(from, to));
        folder
            .run("check bad.toml")
            .is_refused_with(&["bad.toml: task `", fragment]);
    }
    folder.expect(2, "table build site.toml --task dock -o - --json");
    folder.expect(2, "table build site.toml --task dock -o t --threads 0");
}

#[test]
fn firmware_is_sealed_or_left_unchanged() {
    use posegate::gate::Seal;
    let folder = sample();
    let path = |name: &str| folder.path().join(name);
    let code: Vec<u8> = (0..100).collect();
    let image = [&code[..], &Seal::MAGIC, &[0xff; 12], &code[..60]].concat();
    folder.write("firmware", elf(0x0800_0000, &image));
    let report = folder.json(0, "table seal firmware -o sealed --json");
    assert_eq!(
        (report["start"].as_u64(), report["length"].as_u64()),
        (Some(0x0800_0000), Some(180))
    );
    let sealed = folder.read("sealed");
    assert_eq!(posegate::table::checksum(&sealed[84..]), Seal::SUM);
    // In place, and again.
    for _ in 0..2 {
        folder.expect(0, "table seal firmware");
        assert_eq!(folder.read("firmware"), sealed);
    }
    // A file that cannot be sealed is not changed.
    folder.write("bare", elf(0, &code));
    for (name, expected) in [
        ("bare", "no seal record"),
        ("site.toml", "not a 32-bit little-endian ELF file"),
        ("missing", "missing"),
    ] {
        let before = std::fs::read(path(name)).ok();
        let names = folder.names();
        folder
            .run(&format!("table seal {name}"))
            .is_refused_with(&[expected, "help"]);
        assert_eq!(std::fs::read(path(name)).ok(), before);
        assert_eq!(folder.names(), names);
    }
}

/// All sigmas zero, or a covariance of zeros, give the cost of the goal. A single zero is refused.
#[test]
fn exact_pose_costs_as_much_as_its_goal() {
    let folder = sample();
    folder.write("zero.csv", "0,0,0\n0,0,0\n0,0,0\n");
    folder.write("flat.csv", "0.01,0,0\n0,0,0\n0,0,0.0003\n");
    let see = "cost site.toml --task see-t7";
    for exact in [
        "--sigma-x 0 --sigma-y 0 --sigma-yaw-deg 0",
        "--covariance-file zero.csv",
    ] {
        let report = folder.json(0, &format!("{see} {exact} --json"));
        for (name, value) in [
            ("integral", 1406.25),
            ("mass", 1.0),
            ("mean", 1406.25),
            ("outside_mass", 0.0),
            ("p_miss", 0.0),
        ] {
            assert!(
                (report[name].as_f64().unwrap() - value).abs() < 1e-9,
                "{report}"
            );
            assert_eq!(report[format!("{name}_error")], 0.0, "{report}");
        }
        assert_eq!(report.as_object().unwrap().len(), 10, "{report}");
    }
    for [line, fragment] in cases(
        "
        --sigma-x 0.1 --sigma-y 0 --sigma-yaw-deg 1 => sigma_y is 0
        --covariance-file flat.csv => not positive definite
        --covariance-file zero.csv --sigma-x 0 => cannot be used with
        --sigma-x 0 --sigma-y 0 --sigma-yaw-deg 0 --c2 inf => c2 is inf
        ",
    ) {
        let ended = folder.run(&format!("{see} {line}"));
        ended.is_refused_with(&[fragment]);
        assert!(!ended.err.contains("posegate place"), "{}", ended.err);
    }
}

/// Invalid pose-sets, costs and views are named, and nothing is printed for them.
#[test]
fn invalid_input_of_cost_is_refused() {
    let folder = sample();
    let sigmas = "--sigma-x 0.3 --sigma-y 0.3 --sigma-yaw-deg 1";
    let line = folder.json(0, &format!("cost site.toml --task see-t7 {sigmas} --json"));
    for key in ["integral", "mass", "mean", "outside_mass", "p_miss"] {
        assert!(
            line[key].is_f64() && line[format!("{key}_error")].is_f64(),
            "{line}"
        );
    }
    // The site's epsilon is the default.
    assert!((line["mass"].as_f64().unwrap() - 0.99).abs() < 1e-12);
    let (out, _) = folder.expect(0, &format!("cost site.toml --task see-t7 {sigmas}"));
    assert!(out.contains("p_miss") && out.lines().count() == 6, "{out}");
    assert!(
        out.starts_with("cost of a view: 100 d^2 + 50 phi^2 + 50 psi^2 (m, rad), "),
        "{out}"
    );
    folder.write("p.csv", "0.09,0,0\n0,0.09,0\n0,0,0.0003\n");
    folder.expect(0, "cost site.toml --task see-t7 --covariance-file p.csv");
    let see = "cost site.toml --task see-t7";
    for [line, fragment] in cases(
        "
        dock SIGMAS => task `dock`
        dock SIGMAS => no view of a tag
        see-t8 SIGMAS => see-t7
        see-t7 --sigma-x 0.3 --sigma-y 0.3 => --sigma-yaw-deg
        see-t7 => --covariance-file
        see-t7 SIGMAS --covariance-file p.csv => cannot be used with
        see-t7 --sigma-x 0 --sigma-y 0.3 --sigma-yaw-deg 1 => sigma_x is 0
        see-t7 --sigma-x 0.3 --sigma-y -0.3 --sigma-yaw-deg 1 => sigma_y is -0.3
        see-t7 --sigma-x 0.3 --sigma-y 0.3 --sigma-yaw-deg nan => sigma_yaw is NaN
        see-t7 --sigma-x 0.3 --sigma-y 0.3 --sigma-yaw-deg 1e5 => turns
        see-t7 SIGMAS --epsilon 0 => epsilon is 0
        see-t7 SIGMAS --epsilon 1 => epsilon is 1
        see-t7 SIGMAS --epsilon -0.5 => epsilon is -0.5
        see-t7 SIGMAS --epsilon nan => epsilon is NaN
        see-t7 SIGMAS --c-high -1 => c_high is -1
        see-t7 SIGMAS --c2 inf => c2 is inf
        see-t7 SIGMAS --accuracy 0 => accuracy is 0
        see-t7 --covariance-file missing.csv => missing.csv
        ",
    ) {
        let line = line.replace("SIGMAS", sigmas);
        let ended = folder.run(&format!("cost site.toml --task {line}"));
        ended.is_refused_with(&[fragment]);
    }
    for (text, fragment) in [
        ("0.09,0,0\n0,0.09,0\n", "p.csv:2: 2 rows"),
        ("0.09,0\n0,0.09\n", "p.csv:1: 2 numbers"),
        (
            "x,y,yaw\n0.09,0,0\n0,0.09,0\n0,0,0.0003\n",
            "p.csv:1:1: `x`",
        ),
        ("0.09,0.01,0\n0.02,0.09,0\n0,0,0.0003\n", "not symmetric"),
        (
            "0.09,0.09,0\n0.09,0.09,0\n0,0,0.0003\n",
            "not positive definite",
        ),
        ("0.09,0,0\n0,-0.09,0\n0,0,0.0003\n", "not positive definite"),
        ("0.09,0,0\n0,nan,0\n0,0,0.0003\n", "row 2, column 2 is NaN"),
        ("", "p.csv:1: 0 rows"),
    ] {
        folder.write("p.csv", text);
        folder
            .run(&format!("{see} --covariance-file p.csv"))
            .is_refused_with(&[fragment, "p.csv"]);
    }
}

#[test]
fn metrics_compares_or_refuses_trajectories() {
    let folder = sample();
    let line = |k: u32, y: f64| format!("{k}.0 {}.5 {y} 0 0 0 0 1\n", k / 4);
    let truth: String = (0..20).map(|k| line(k, f64::from(k % 3))).collect();
    let estimate: String = (0..20).map(|k| line(k, f64::from(k % 3) + 0.07)).collect();
    folder.write(
        "truth.txt",
        format!("# truth\r\n\r\n{}", truth.replace('\n', "\r\n")),
    );
    folder.write("estimate.txt", &estimate);
    let get = |line: &str| folder.json(0, line);
    let found = get("metrics truth.txt estimate.txt --json");
    assert_eq!(found["pairs"], 20);
    assert!((found["ape"]["translation"]["rmse"].as_f64().unwrap() - 0.07).abs() < 1e-12);
    assert_eq!(found["rpe"]["delta_1_frame"]["translation"]["count"], 19);
    assert_eq!(found["correct_rate"].as_array().unwrap().len(), 5);
    assert!(found.get("task_rate").is_none());
    // 7 cm to the side: not within the dock's 6 cm, but within the 8 cm of the Correct Rate.
    let found = get(
        "metrics truth.txt estimate.txt --json --correct-rate 0.08,1 --correct-rate 0.05,1 --site site.toml --task dock",
    );
    let rates = found["correct_rate"].as_array().unwrap();
    assert_eq!(
        (&rates[0]["rate"], &rates[1]["rate"]),
        (&1.0.into(), &0.0.into())
    );
    assert_eq!(found["task_rate"]["errors_inside"], 0.0);
    let found =
        get("metrics truth.txt estimate.txt --align se3 --json --site site.toml --task dock");
    assert_eq!(found["task_rate"]["errors_inside"], 1.0);
    let (out, _) = folder.expect(0, "metrics truth.txt estimate.txt");
    assert!(
        out.contains("20 pairs") && out.contains("APE, translation"),
        "{out}"
    );
    // A path of less than half a metre has no pairs by its length.
    let still: String = (0..20)
        .map(|k| line(k % 4 + 4 * (k / 4), 0.0).replacen(&format!("{}.5", k / 4), "0.01", 1))
        .collect();
    folder.write("still.txt", &still);
    assert!(get("metrics still.txt still.txt --json")["rpe"]["delta_0.5_m"].is_null());
    let files = [
        ("later.txt", "100.0 0 0 0 0 0 0 1\n101.0 0 0 0 0 0 0 1\n"),
        ("one.txt", "1.0 0 0 0 0 0 0 1\n"),
        ("back.txt", "1.0 0 0 0 0 0 0 1\n0.0 0 0 0 0 0 0 1\n"),
        ("twice.txt", "1.0 0 0 0 0 0 0 1\n1.0 0 0 0 0 0 0 1\n"),
        ("turned.txt", "1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 1 1\n"),
        ("short.txt", "1.0 0 0 0 0 0 0\n"),
        ("word.txt", "1.0 0 here 0 0 0 0 1\n"),
        ("empty.txt", "# nothing\n"),
    ];
    for (name, text) in files {
        folder.write(name, text);
    }
    for (arguments, fragment) in [
        ("truth.txt later.txt", "same clock"),
        ("truth.txt one.txt", "1 pair of poses only"),
        ("truth.txt back.txt", "back.txt:2:1: the time 0 is before"),
        // A time that is there twice is used once.
        ("twice.txt truth.txt", "1 pair of poses only"),
        (
            "truth.txt turned.txt",
            "turned.txt:2:11: the quaternion's length is 1.41",
        ),
        ("truth.txt short.txt", "short.txt:1:16: 7 numbers"),
        ("truth.txt word.txt", "word.txt:1:7: `here`"),
        ("truth.txt empty.txt", "empty.txt:1:1: no pose"),
        ("truth.txt missing.txt", "missing.txt"),
        ("still.txt still.txt --align se3", "on a line"),
        ("truth.txt estimate.txt --max-diff -1", "is -1 s"),
        ("truth.txt estimate.txt --max-diff nan", "is NaN s"),
        ("truth.txt estimate.txt --align icp", "icp"),
        (
            "truth.txt estimate.txt --correct-rate 0.05",
            "metres and degrees",
        ),
        (
            "truth.txt estimate.txt --correct-rate -1,2",
            "metres and degrees",
        ),
        ("truth.txt estimate.txt --site site.toml", "--task"),
        (
            "truth.txt estimate.txt --site site.toml --task dokc",
            "dock",
        ),
        ("- -", "standard input"),
    ] {
        folder
            .run(&format!("metrics {arguments} --json"))
            .is_refused_with(&[fragment]);
    }
}

/// A command of an earlier version answers in one line that has a command of today, and writes nothing.
#[test]
fn earlier_commands_tell_what_to_type() {
    let folder = sample();
    let before = folder.names();
    for [line, instead] in cases(
        "
        completions bash => posegate --completions SHELL
        doctor site.toml -o out => posegate check SITE --draw DIR
        family site.toml --tag t7 --r 0.02 => posegate table build
        inscribe site.toml --task dock => posegate contains SITE --task TASK --box
        man -o pages => posegate --man DIR
        seal firmware => posegate table seal FIRMWARE
        seal --help => posegate table seal FIRMWARE
        ",
    ) {
        let ended = folder.run(line);
        ended.is_refused_with(&[instead]);
        assert_eq!(ended.err.lines().count(), 1, "{}", ended.err);
    }
    assert_eq!(folder.names(), before);
}

#[test]
fn box_is_inside_the_set_and_about_the_goal() {
    let folder = sample();
    let found = folder.json(0, "contains site.toml --task dock --box --json");
    for axis in ["x", "y", "yaw_deg"] {
        let [low, high] = [0, 1].map(|end| found[axis][end].as_f64().unwrap());
        assert!(low < 0.0 && high > 0.0, "{found}");
    }
    let (text, _) = folder.expect(0, "contains site.toml --task dock --box --yaw-deg 1");
    assert!(text.contains("yaw_deg = [-1.0, 1.0]"), "{text}");
    folder.expect(2, "contains site.toml --task dock");
    folder.expect(2, "contains site.toml --task dock --box --yaw-deg 45");
    folder.expect(2, "contains site.toml --task dock --box --poses poses.csv");
}

#[test]
fn completions_and_manuals_list_every_command() {
    let folder = sample();
    let (help, _) = folder.expect(0, "--help");
    let (_, commands) = help.split_once("Commands:\n").unwrap();
    let names: Vec<&str> = commands
        .lines()
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
        .filter(|name| !name.is_empty() && *name != "help")
        .collect();
    assert!(names.len() == 20 && names.contains(&"report"), "{names:?}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let (text, _) = folder.expect(0, &format!("--completions {shell}"));
        for name in &names {
            assert!(text.contains(name), "{shell}: {name}");
        }
        assert!(text.contains("survive-lost-tags"), "{shell}");
    }
    folder.expect(2, "--completions tcsh");
    folder.expect(0, "--man pages");
    for name in &names {
        let page = folder.text(&format!("pages/posegate-{name}.1"));
        assert!(
            page.contains(".SH SYNOPSIS") && page.contains(&format!("posegate\\-{name}"))
                || page.contains(&format!("posegate {name}")),
            "{name}:\n{page}"
        );
    }
    let below = folder.text("pages/posegate-table-build.1");
    assert!(below.contains("Example"), "{below}");
    folder.expect(2, "--man site.toml");
    // They stand alone.
    folder.expect(2, "--man pages --completions bash");
    folder.expect(2, "--man pages check site.toml");
}

/// `check` prints all warnings about a site, with the line of the file.
#[test]
fn check_prints_warnings_with_their_lines() {
    let folder = sample();
    let site = folder.text("site.toml");
    let wall = "\n[wall.north]\nfrom = [0.0, 3.0]\nto = [6.0, 3.0]\nz = [0.0, 2.5]\n";
    let rows = "\n[candidates.row]\nwall = \"north\"\nevery = 1.5\nz = [1.0]\nfamily = \"tag36h1\"\nsize = 0.2\n";
    let into = "\n[candidate.into]\nfamily = \"tag36h11\"\nsize = 300\npose = { x = 3.0, y = 2.99, z = 1.0, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }\n";
    let text = site + wall + rows + into;
    folder.write("site.toml", &text);
    let line = |wanted: &str| 1 + text.lines().position(|line| line == wanted).unwrap();
    let found = folder.json(0, "check site.toml --json");
    let warnings = found["warnings"].as_array().unwrap();
    let at = |wanted: &str, words: &str| {
        let number = line(wanted);
        let here = |warning: &Value| {
            warning["line"] == number && warning["message"].as_str().unwrap().contains(words)
        };
        assert!(
            warnings.iter().any(here),
            "{words} at {number}: {warnings:?}"
        );
    };
    at("[candidates.row]", "did you mean `tag36h1");
    at("size = 300", "candidate into: it is 300 m wide");
    at("[candidate.into]", "into the wall north");
    let (words, _) = folder.expect(0, "check site.toml");
    let last = words.lines().rev().nth(1).unwrap();
    assert!(last.starts_with("WARNING site.toml:"), "{words}");
    // A warning for all candidates of a row is printed once.
    let unknown = words.lines().filter(|line| line.contains("family_unknown"));
    let unknown: Vec<&str> = unknown.collect();
    assert_eq!(unknown.len(), 1, "{words}");
    assert!(unknown[0].contains(" more of this line"), "{words}");
}

/// A site that names its controller is warned of each table that may take too long, and only of those.
#[test]
fn check_warns_of_tables_beyond_the_cycle_budget() {
    let folder = sample();
    let site = folder.text("site.toml");
    let advice = |site: &str, keys: &str| {
        folder.write("site.toml", format!("{site}\n[controller]\n{keys}\n"));
        let found = folder.json(0, "check site.toml --json");
        let warnings = found["warnings"].as_array().unwrap().iter();
        let of_cost = warnings.filter(|one| one["code"] == "decision_too_long");
        let all: Vec<_> = of_cost.map(|one| one["help"].to_string()).collect();
        assert!(!all.is_empty(), "{found}");
        all.concat()
    };
    // What the file already says is not advised.
    let few = "core = \"cortex-m4f\"\ncycles_per_decision = 10";
    let cells = site.replace("layout = \"auto\"", "layout = \"grid\"");
    let layout = "layout = \\\"facets";
    assert!(advice(&cells, few).contains(layout));
    assert!(!advice(&site, few).contains(layout));
    assert!(advice(&site, few).contains("cycles_per_instruction"));
    let measured = format!("{few}\ncycles_per_instruction = 2.0");
    assert!(!advice(&site, &measured).contains("cycles_per_instruction"));
    let costly = |keys: &str| {
        folder.write("site.toml", format!("{site}\n[controller]\n{keys}\n"));
        let found = folder.json(0, "check site.toml --json");
        let warnings = found["warnings"].as_array().unwrap().iter();
        let of_cost = warnings.filter(|one| one["code"] == "decision_too_long");
        of_cost
            .map(|one| one["about"].as_str().unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    folder.expect(0, "table build site.toml --task see-t7 -o t.posegate");
    let bytes = folder.read("t.posegate");
    let table = posegate::table::Table::parse(&bytes).unwrap();
    // The bound of a step with both evaluations, as `table cost` prints it.
    let step = |core: &str| {
        let cost = folder.json(0, &format!("table cost t.posegate --core {core} --json"));
        cost["cycle"]["with_fix"].as_u64().unwrap()
    };
    assert!(step("cortex-m4f") > u64::from(table.worst_case().instructions_m4f()));
    for core in ["cortex-m4f", "cortex-m0plus", "rv32imc"] {
        let bound = step(core);
        let core = format!("core = \"{core}\"\ncycles_per_instruction = 1.5\n");
        let enough = (bound as f64 * 1.5).ceil();
        let with = |cycles: f64| costly(&format!("{core}cycles_per_decision = {cycles}"));
        assert_eq!(with(enough), Vec::<String>::new(), "{core}");
        assert_eq!(with(enough - 2.0), ["task see-t7"], "{core}");
    }
    // A tracker, and the archive for size, take more.
    let tracker = "--core cortex-m4f --tracker --level s --json";
    let cost = folder.json(0, &format!("table cost t.posegate {tracker}"));
    let enough = 2 * cost["cycle"]["with_fix"].as_u64().unwrap();
    let with = |cycles: u64| {
        costly(&format!(
            "core = \"cortex-m4f\"\ntracker = true\nlevel = \"s\"\ncycles_per_decision = {cycles}"
        ))
    };
    assert!(!with(enough).contains(&"task see-t7".to_owned()));
    assert!(with(enough - 1).contains(&"task see-t7".to_owned()));
    // Without a stated number, an instruction counts as two cycles.
    let enough = 2 * step("cortex-m4f");
    let with = |cycles: u64| {
        costly(&format!(
            "core = \"cortex-m4f\"\ncycles_per_decision = {cycles}"
        ))
    };
    assert_eq!(with(enough), Vec::<String>::new());
    assert_eq!(with(enough - 1), ["task see-t7"]);

    folder.write(
        "site.toml",
        format!("{site}\n[controller]\ncore = \"cortex-m4\"\ncycles_per_decision = 9\n"),
    );
    folder
        .run("check site.toml")
        .is_refused_with(&["cortex-m4f"]);
    folder.write(
        "site.toml",
        format!("{site}\n[controller]\ncore = \"cortex-m4f\"\ncycles_per_decision = 0\n"),
    );
    folder.expect(2, "check site.toml");
}

/// The set is empty because its tag faces away, so finer steps are not the advice.
#[test]
fn empty_table_is_refused_with_the_cause() {
    let folder = sample();
    let site = folder.text("site.toml");
    let seen = "yaw_deg = 180.0 }";
    assert!(site.contains(seen));
    folder.write("site.toml", site.replace(seen, "yaw_deg = 0.0 }"));
    let ended = folder.run("table build site.toml --task see-t7 -o t.posegate");
    ended.is_refused_with(&["away from every camera"]);
    assert!(!ended.words().contains("make the steps finer"));
}

/// `place` prints the pose as the site file has it. A reserve is in metres, and it is also an error of every pose from that tag.
#[test]
fn place_prints_the_pose_in_site_file_syntax() {
    let folder = sample();
    let place = "place site.toml --task see-t7 --sigma-x 0.05 --sigma-y 0.05 --sigma-yaw-deg 1 --free x=3.9:4 --budget 10";
    let (out, err) = folder.expect(0, &format!("{place} --reserve 0.001,0.1"));
    let pose = out
        .lines()
        .find(|line| line.starts_with("in the site  pose = { x = "));
    assert!(
        pose.is_some_and(|line| line.ends_with("yaw_deg = 180.0 }")),
        "{out}"
    );
    assert!(!err.contains("off by the reserve"), "{err}");
    let (_, err) = folder.expect(0, &format!("{place} --reserve 0.02,1"));
    assert!(
        err.contains("off by the reserve") && err.contains("task see-t7"),
        "{err}"
    );
    folder
        .run(&format!("{place} --reserve 20,1"))
        .is_refused_with(&["20 m is more than 1 m"]);
}
