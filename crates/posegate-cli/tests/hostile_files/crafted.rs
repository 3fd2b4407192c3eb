//! Files with one crafted weakness each.

use crate::Folder;
use crate::bags::Compression;
use crate::child::{End, Run, run};
use crate::formats::bag;
use posegate_testkit::counts;
use posegate_testkit::mcap::op;
use std::fmt::Write as _;

/// Returns the words of an error, without the frame around it.
fn words(text: &str) -> String {
    text.replace(['│', '×'], " ")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

fn answered(folder: &Folder, arguments: &str) -> Run {
    let arguments: Vec<String> = arguments.split(' ').map(String::from).collect();
    let run = run(folder.0.path(), &arguments);
    assert!(
        run.is_good(),
        "{arguments:?}: {:?}, {} MiB, {:.1} s: {}",
        run.end,
        run.mib,
        run.seconds,
        run.stderr
    );
    run
}

/// Returns the summary of a replay of a bag, or the error.
fn replayed(bytes: &[u8]) -> Result<serde_json::Value, String> {
    let folder = Folder::new(None);
    std::fs::write(folder.path("a.mcap"), bytes).unwrap();
    let rest = "--task dock --topic /amcl_pose --cross-terms yaw-unknown";
    let run = answered(&folder, &format!("replay dock.toml a.mcap {rest} --json"));
    if run.end == End::Exit(2) {
        return Err(words(&run.stderr));
    }
    let line = format!("replay dock.toml a.mcap {rest} --json");
    Ok(posegate_testkit::run::run(folder.0.path(), &line)
        .lines()
        .remove(0))
}

/// Returns the records of a bag: where each begins, its opcode and its length.
fn records(bytes: &[u8]) -> Vec<(usize, u8, usize)> {
    let mut at = 8;
    let mut all = Vec::new();
    while at + 9 < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        all.push((at, bytes[at], length));
        at += 9 + length;
    }
    all
}

/// Each length of a bag is made too large in turn, including those of records within chunks. The damaged chunk is skipped
/// and reported. The other chunks are read.
#[test]
fn chunk_with_a_length_beyond_its_end_is_skipped() {
    let whole = bag(None, 30);
    let estimates = replayed(&whole).unwrap()["estimates"].as_u64().unwrap();
    assert_eq!(estimates, 30);
    let chunks: Vec<_> = records(&whole)
        .into_iter()
        .filter(|(_, op, _)| *op == op::CHUNK)
        .collect();
    assert!(chunks.len() > 2, "{}", chunks.len());
    let (start, _, length) = chunks[1];
    // Without a checksum, which would detect the change first.
    let mut plain = whole.clone();
    plain[start + 9 + 24..start + 9 + 28].fill(0);
    let inside = start + 9 + 40;
    let mut places = vec![
        (start + 9 + 16, 8),
        (start + 9 + 28, 4),
        (start + 9 + 32, 8),
    ];
    let mut at = inside;
    while at + 9 <= start + 9 + length {
        places.push((at + 1, 8));
        at += 9 + u64::from_le_bytes(plain[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    assert!(places.len() > 6);
    for (at, width) in places {
        for value in [1_u64 << 26, 1 << 31, 1 << 63, u64::MAX] {
            let mut bad = plain.clone();
            bad[at..at + width].copy_from_slice(&value.to_le_bytes()[..width]);
            if bad == plain || (width == 4 && value as u32 == 0) {
                continue;
            }
            let summary = replayed(&bad).unwrap();
            let recording = &summary["recording"];
            assert_eq!(recording["bad_chunks"], 1, "{at} {value}: {recording}");
            assert!(
                recording["damage"]
                    .as_str()
                    .unwrap()
                    .contains("the chunk is left out"),
                "{recording}"
            );
            let left = summary["estimates"].as_u64().unwrap();
            assert!(left < 30 && left > 10, "{left}");
        }
    }
}

/// Stated lengths in a schema or a channel reserve no memory.
#[test]
fn stated_name_length_reserves_no_memory() {
    let whole = bag(None, 30);
    for (start, opcode, length) in records(&whole) {
        if !matches!(
            opcode,
            op::SCHEMA | op::CHANNEL | op::METADATA | op::STATISTICS | op::CHUNK_INDEX | op::HEADER
        ) {
            continue;
        }
        let places = start + 9..start + 9 + length.saturating_sub(3);
        let (skipped, step) = counts::part(16);
        for at in places.take(64).skip(skipped).step_by(step) {
            let mut bad = whole.clone();
            bad[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
            let summary = replayed(&bad).unwrap();
            assert_eq!(summary["estimates"], 30, "{opcode} {at}");
        }
    }
}

/// A chunk that the index names and that has another opcode is reported as missing.
#[test]
fn indexed_chunk_with_another_opcode_is_reported_missing() {
    let mut bytes = bag(Some(Compression::Zstd), 30);
    let chunks: Vec<_> = records(&bytes)
        .into_iter()
        .filter(|(_, op, _)| *op == op::CHUNK)
        .collect();
    bytes[chunks[1].0] = op::MESSAGE_INDEX;
    let summary = replayed(&bytes).unwrap();
    assert_eq!(summary["recording"]["bad_chunks"], 1, "{summary}");
    assert!(
        summary["recording"]["damage"]
            .as_str()
            .unwrap()
            .contains("its index names")
    );
}

/// Small chunks with very large stated or decompressed sizes.
#[test]
fn chunk_with_a_huge_decompressed_size_is_skipped() {
    let record = |size: u64, compression: &str, data: &[u8]| {
        let mut body = vec![0; 16];
        body.extend(size.to_le_bytes());
        body.extend([0; 4]);
        body.extend((compression.len() as u32).to_le_bytes());
        body.extend(compression.bytes());
        body.extend((data.len() as u64).to_le_bytes());
        body.extend(data);
        let mut record = vec![op::CHUNK];
        record.extend((body.len() as u64).to_le_bytes());
        record.extend(body);
        record
    };
    let good = bag(None, 30);
    let with = |chunks: Vec<u8>| [&good[..8], &chunks, &good[8..]].concat();
    for (size, compression) in [
        (1_u64 << 26, "zstd"),
        (1 << 60, "lz4"),
        (1 << 20, ""),
        (3, "brotli"),
    ] {
        let summary = replayed(&with(record(size, compression, b"abcdefg"))).unwrap();
        assert_eq!(
            summary["recording"]["bad_chunks"], 1,
            "{size} {compression}: {summary}"
        );
        assert_eq!(summary["estimates"], 30);
    }
    // A frame of zstd: no size, blocks of 128 KiB of one byte (`RLE`). Each chunk is 64 MiB, in 2 kB.
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0x00, 0x70];
    for block in 0..512_u32 {
        let head = u32::from(block == 511) | (1 << 1) | ((128 << 10) << 3);
        frame.extend(&head.to_le_bytes()[..3]);
        frame.push(0xff);
    }
    let bombs = record(64 << 20, "zstd", &frame).repeat(200);
    let summary = replayed(&with(bombs)).unwrap();
    assert_eq!(summary["recording"]["bad_chunks"], 200);
    assert_eq!(summary["estimates"], 30);
}

/// Times whose difference is not a finite number are in no span of the timeline.
#[test]
fn infinite_time_differences_are_counted() {
    let folder = Folder::new(None);
    let rows = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n\
        -1.7e308,0,0,0,1e-4,0,0,1e-4,0,1e-4\n1.7e308,0,0,0,1e-4,0,0,1e-4,0,1e-4\n";
    std::fs::write(folder.path("far.csv"), rows).unwrap();
    answered(&folder, "replay dock.toml far.csv --task dock --json");
}

/// An attachment may be of any length: the mcap crate's parser subtracts 4 from it.
#[test]
fn attachment_of_any_length_is_skipped() {
    let good = bag(None, 30);
    for opcode in [op::ATTACHMENT, op::METADATA, op::STATISTICS, 0x80, 0xff] {
        for length in [0_u64, 1, 3, 30, 5 << 20] {
            let mut odd = vec![opcode];
            odd.extend(length.to_le_bytes());
            odd.resize(9 + length as usize, 0x41);
            let summary = replayed(&[&good[..8], &odd, &good[8..]].concat()).unwrap();
            assert_eq!(summary["estimates"], 30);
            assert!(summary["recording"]["damage"].is_null(), "{summary}");
        }
    }
    let mut endless = good[..8].to_vec();
    endless.push(op::ATTACHMENT);
    endless.extend(u64::MAX.to_le_bytes());
    assert!(
        replayed(&endless)
            .unwrap_err()
            .contains("a record of 18446744073709551615")
    );
}

/// Inputs without an end are refused with exit code 2, before they fill the memory.
#[test]
fn endless_input_is_refused() {
    let folder = Folder::new(None);
    let mut tried = 0;
    for arguments in [
        "check /dev/zero",
        "gate dock.posegate --estimates /dev/zero",
        "gate /dev/zero --estimates estimates.csv",
        "contains dock.toml --task dock --poses /dev/zero",
        "table info /dev/zero",
        "table verify /dev/zero dock.toml",
        "replay dock.toml /dev/zero --task dock",
        "replay dock.toml estimates.csv --task dock --truth /dev/zero",
        "metrics /dev/zero /dev/zero",
        "import /dev/zero --format nav2_docks",
        "learn bounds /dev/zero --quantile 0.9 -o out.toml",
        "learn inflation /dev/zero --epsilon 0.9 -o out.toml",
        "learn outcomes /dev/zero --epsilon 0.9",
        "predict /dev/zero --at estimates.csv",
        "table seal /dev/zero -o out.elf",
        "report dock.toml --placement see-t7=/dev/zero -o out.html",
        "cost dock.toml --task see-t7 --covariance-file /dev/zero",
        "plan docks.toml --to dock-1 --costs /dev/zero",
    ] {
        let run = answered(&folder, arguments);
        assert_eq!(run.end, End::Exit(2), "{arguments}: {}", run.stderr);
        tried += 1;
    }
    assert_eq!(tried, 18);
    // A name in a site file must be a regular file: a pipe without a writer would block.
    let pipe = folder.path("pipe");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    for site in ["calibrated.toml", "imported.toml", "learnt.toml"] {
        for (name, end) in [("/dev/zero", "device"), ("pipe", "pipe")] {
            let text = std::fs::read_to_string(folder.path(site)).unwrap();
            let text = text
                .replace("mutant.yaml", name)
                .replace("mutant.toml", name);
            std::fs::write(folder.path("endless.toml"), text).unwrap();
            let run = answered(&folder, "check endless.toml");
            assert_eq!(run.end, End::Exit(2), "{site} {end}: {}", run.stderr);
            assert!(
                words(&run.stderr).contains("regular file"),
                "{site} {end}: {}",
                run.stderr
            );
        }
    }
}

/// The time for maps grows linearly with the number of tags. For this number an import that compares all pairs would
/// take half a minute, and a run may take [`crate::child::MOST_SECONDS`].
#[test]
fn map_is_read_in_linear_time() {
    let folder = Folder::new(None);
    let count = 65_000;
    let mut bundle = String::from("tag_bundles: [ { name: dock, layout: [");
    let mut docks = String::from("docks:\n");
    let mut field = String::from("{ \"tags\": [");
    let mut tables = String::new();
    for k in 0..count {
        // On one line.
        write!(
            bundle,
            "{{id: {k}, size: 0.1, x: 1.0, y: 0, z: 0, qw: 1, qx: 0, qy: 0, qz: 0}}, "
        )
        .unwrap();
        writeln!(
            docks,
            "  dock{k}: {{type: charging_dock, frame: map, pose: [1.0, 2.0, 0.5]}}"
        )
        .unwrap();
        let comma = if k == 0 { "" } else { "," };
        write!(field, "{comma}\n{{ \"ID\": {k}, \"pose\": {{ \"translation\": {{ \"x\": 4.0, \"y\": 1.5, \"z\": 0.5 }}, \"rotation\": {{ \"quaternion\": {{ \"W\": 1.0, \"X\": 0.0, \"Y\": 0.0, \"Z\": 0.0 }} }} }} }}").unwrap();
        writeln!(tables, "[tag.t{k}]\nid = {k}\nfamily = 'a'\nsize = 0.1\npose = {{ x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }}").unwrap();
    }
    bundle += "] } ]\n";
    field += "] }\n";
    for (text, arguments) in [
        (
            &bundle,
            "import map --format apriltag_ros --convention apriltag_ros --family a --pose x=4,z=0.5,yaw_deg=180 -o out.toml",
        ),
        (&docks, "import map --format nav2_docks -o out.toml"),
        (
            &field,
            "import map --format wpilib --size 0.1 --family a -o out.toml",
        ),
        (&tables, "import map --format posegate -o out.toml"),
    ] {
        std::fs::write(folder.path("map"), text).unwrap();
        let run = answered(&folder, arguments);
        assert!(
            matches!(run.end, End::Exit(0 | 2)),
            "{arguments}: {}",
            run.stderr
        );
    }
}

/// A small YAML file names a large value many times. It is refused before readers follow the names.
#[test]
fn aliases_are_counted_as_what_they_name() {
    let folder = Folder::new(None);
    let import = |format: &str| {
        let more = match format {
            "apriltag_ros" => "--convention apriltag_ros --family a --pose x=4",
            _ => "",
        };
        format!("import mutant.yaml --format {format} {more} -o out.toml")
    };
    let check = || "check calibrated.toml".to_owned();
    let members = format!(
        "tag_bundles:\n  - &b {{name: d, layout: [{}]}}\n{}",
        "{}, ".repeat(20_000),
        "  - *b\n".repeat(2_000)
    );
    let keys = format!(
        "k: &k \"a{}\"\nm: [{}]\n",
        "a".repeat(200_000),
        "{*k : 1}, ".repeat(30_000)
    );
    let numbers = format!(
        "camera_matrix: {{data: [&n 0.{}1, {}]}}\n",
        "0".repeat(400_000),
        "*n, ".repeat(100_000)
    );
    let mut docks = format!(
        "docks:\n  h: &h {{type: a, pose: [&n 0.{}1, *n, *n]}}\n",
        "0".repeat(200_000)
    );
    for number in 0..20_000 {
        writeln!(docks, "  a{number}: *h").unwrap();
    }
    let mut merged = format!("e: &e {{}}\nl: &l [{}]\n", "*e, ".repeat(150_000));
    for number in 0..25_000 {
        writeln!(merged, "m{number}: {{<<: *l}}").unwrap();
    }
    for (text, arguments) in [
        (members, import("apriltag_ros")),
        (keys, check()),
        (numbers, check()),
        (docks, import("nav2_docks")),
        (merged, check()),
    ] {
        std::fs::write(folder.path("mutant.yaml"), text).unwrap();
        let arguments: Vec<&str> = arguments.split_whitespace().collect();
        let run = answered(&folder, &arguments.join(" "));
        let error = words(&run.stderr);
        assert_eq!(run.end, End::Exit(2), "{arguments:?}: {error}");
        assert!(
            error.contains("too many values") || error.contains("too long texts"),
            "{arguments:?}: {error}"
        );
    }
}

/// Polygons with thousands of corners are refused. Those with the largest allowed number are read and built.
#[test]
fn polygon_with_too_many_corners_is_refused() {
    let folder = Folder::new(None);
    let circle = |count: u32, radius: f64| {
        let corner = |k: u32| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(count);
            format!("[{:?}, {:?}]", radius * angle.cos(), radius * angle.sin())
        };
        format!(
            "[{}]",
            (0..count).map(corner).collect::<Vec<_>>().join(", ")
        )
    };
    let site = |success: &str| {
        format!(
            "[task.dock]\nkind = 'work'\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\nsuccess = {success}\n\
             [table]\nextent = {{ x = [-2.0, 2.0], y = [-2.0, 2.0], yaw_deg = [-20.0, 20.0] }}\nstep = {{ xy = 0.1, yaw_deg = 2.0 }}\n"
        )
    };
    let footprint = |robot: u32, region: u32| {
        let (robot, region) = (circle(robot, 0.5), circle(region, 2.0));
        format!("{{ shape = 'footprint', footprint = {robot}, region = {region} }}")
    };
    for (success, code) in [
        (footprint(20_000, 4), 2),
        (footprint(4, 20_000), 2),
        (
            format!(
                "{{ shape = 'clear', footprint = [[0.0, 0.0]], obstacle = {} }}",
                circle(20_000, 0.5)
            ),
            2,
        ),
        (footprint(320, 5), 2),
        (footprint(320, 4), 0),
    ] {
        std::fs::write(folder.path("polygons.toml"), site(&success)).unwrap();
        let run = answered(&folder, "check polygons.toml");
        assert_eq!(run.end, End::Exit(code), "{}", run.stderr);
        if code == 2 {
            assert!(words(&run.stderr).contains(" corners"), "{}", run.stderr);
        }
    }
    let run = answered(
        &folder,
        "table build polygons.toml --task dock -o out.posegate",
    );
    assert_ne!(run.end, End::Exit(3), "{}", run.stderr);
}
