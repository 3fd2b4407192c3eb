//! Forged parts are not kept and not merged. A forgery with a matching proof file is found only by a new proof.

use super::{Folder, boxes, rewrite, sha256, two_shards};
use posegate::bake::BakeInput;
use posegate::table::{Table, checksum};
use posegate::verify::build;
use posegate_site::Site;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Returns the finished piece of the table of a task.
fn piece_of(folder: &Folder, output: &str, task: &str) -> PathBuf {
    let wanted = format!("\"task\":\"{task}\"");
    let is_wanted = |piece: &PathBuf| {
        let bytes = std::fs::read(piece).unwrap();
        let end = bytes.iter().position(|byte| *byte == b'\n').unwrap();
        String::from_utf8_lossy(&bytes[..end]).contains(&wanted)
    };
    let pieces = folder.pieces(output);
    pieces.into_iter().find(is_wanted).unwrap()
}

/// Returns a table of a wider box that claims to be of the first box of the site.
fn wider() -> Vec<u8> {
    let own = Site::parse(&boxes(), "site.toml").unwrap();
    let text = boxes().replace("x = [-0.1, 0.1]", "x = [-0.5, 0.5]");
    let wide = Site::parse(&text, "wide.toml").unwrap();
    let task = &wide.tasks["dock-0"];
    let order = BakeInput {
        task: "dock-0",
        success: &task.success,
        spec: wide.chosen_table(task).unwrap(),
        epsilon: wide.epsilon,
    };
    let mut forged = build(&order, &|| ()).unwrap().0;
    // The forger writes the digest of the task, and the checksum of the result.
    let claimed = own.task_digest(&own.tasks["dock-0"]);
    forged[96..128].copy_from_slice(&claimed);
    let (content, crc) = forged.split_last_chunk_mut().unwrap();
    *crc = checksum(content).to_le_bytes();
    forged
}

/// Returns a proof file with the size and checksums of another table.
fn proof_for(original: &[u8], table: &[u8]) -> Vec<u8> {
    let mut proof: Value = serde_json::from_slice(original).unwrap();
    proof["bytes"] = table.len().into();
    proof["sha256"] = sha256(table).into();
    proof["crc32c"] = format!("{:08x}", Table::parse(table).unwrap().crc()).into();
    format!("{proof}\n").into_bytes()
}

/// Changes the files of a piece so that they do not belong together.
fn mismatched(piece: &Path, how: &str) {
    rewrite(piece, |files| match how {
        "table" => files[0].1 = wider(),
        "proof alone" => drop(files.remove(0)),
        "table alone" => drop(files.pop()),
        "twice" => files.push(files[1].clone()),
        "turned" => files.swap(0, 1),
        member => {
            let mut proof: Value = serde_json::from_slice(&files[1].1).unwrap();
            assert!(!proof[member].is_null(), "{member}");
            proof[member] = match &proof[member] {
                Value::String(_) => "other".into(),
                _ => 7.into(),
            };
            files[1].1 = format!("{proof}\n").into_bytes();
        }
    });
}

/// A piece whose table and proof do not match is not merged. A resumed shard builds it again.
#[test]
fn mismatched_table_and_proof_are_neither_kept_nor_merged() {
    let folder = two_shards();
    folder.copied("out", "untouched");
    folder.expect(0, "site merge untouched");
    let untouched = folder.results("untouched");
    let changes = [
        "table",
        "proof alone",
        "table alone",
        "twice",
        "turned",
        "sha256",
        "bytes",
        "crc32c",
        "task",
        "task_digest",
        "site_digest",
        "tool_version",
        "layout",
    ];
    for (number, how) in changes.into_iter().enumerate() {
        let copy = format!("copy-{number}");
        folder.copied("out", &copy);
        mismatched(&piece_of(&folder, &copy, "dock-0"), how);
        folder
            .run(&format!("site merge {copy}"))
            .is_refused_with(&["pieces that are missing or damaged: 1 the table of `dock-0`"]);
        let mut kept = 0;
        for shard in 0..2 {
            let line = format!("site build site.toml --shard {shard}/2 --resume --json -o {copy}");
            let built = folder.run(&line).json(0);
            kept += built["kept"].as_u64().unwrap();
        }
        assert_eq!(kept, 4, "{how}");
        folder.expect(0, &format!("site merge {copy}"));
        assert!(folder.results(&copy) == untouched, "{how}");
    }
}

/// A forgery with a matching proof file is accepted, but not with `--prove`.
#[test]
fn proving_merge_finds_a_forgery_with_a_matching_proof_file() {
    let folder = two_shards();
    folder.copied("out", "honest");
    folder.expect(0, "site merge honest");
    let honest = folder.results("honest");
    let merged = folder
        .run("site merge honest --site site.toml --prove --json")
        .json(0);
    assert_eq!(
        (&merged["tables"], &merged["proven_again"]),
        (&json!(5), &json!(true))
    );
    assert!(folder.results("honest") == honest);

    let piece = piece_of(&folder, "honest", "dock-0");
    rewrite(&piece, |files| {
        files[0].1 = wider();
        files[1].1 = proof_for(&files[1].1, &files[0].1);
    });
    for json in ["", " --json"] {
        let line = format!("site merge honest --site site.toml --prove{json}");
        let (out, _) = folder.expect(1, &line);
        assert!(
            out.contains("the table of `dock-0`: ") && out.contains("not proven"),
            "{out}"
        );
        assert!(folder.results("honest") == honest, "what was there stays");
    }
    folder.expect(0, "site merge honest --site site.toml");
    assert!(folder.results("honest") != honest);

    // A valid table with wrong counts in its proof.
    folder.copied("out", "counts");
    let piece = piece_of(&folder, "counts", "dock-1");
    rewrite(&piece, |files| {
        let mut proof: Value = serde_json::from_slice(&files[1].1).unwrap();
        proof["proven"]["runs"] = 7.into();
        files[1].1 = format!("{proof}\n").into_bytes();
    });
    let (out, _) = folder.expect(1, "site merge counts --site site.toml --prove");
    assert!(
        out.contains("NOT proven: the table of `dock-1`: its proof counts other"),
        "{out}"
    );
    assert!(!folder.path().join("counts/manifest.json").exists());
    assert!(!folder.path().join("counts/tables").exists());
}

/// An incomplete inventory is found if the site is given.
#[test]
fn incomplete_inventory_is_refused_if_the_site_is_given() {
    let folder = two_shards();
    let parts = folder.path().join("out/parts");
    let read = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(parts.join(name)).unwrap()).unwrap()
    };
    let names = folder.parts("out");
    let name = names
        .iter()
        .find(|name| name.starts_with("inventory-"))
        .unwrap();
    let mut inventory = read(name);
    inventory["pieces"].as_array_mut().unwrap().pop();
    let bytes = inventory.to_string();
    let digest = sha256(bytes.as_bytes());
    std::fs::write(parts.join(format!("inventory-{digest}.json")), bytes).unwrap();
    for shard in 0..2 {
        let name = format!("shard-{shard}-of-2.json");
        let mut record = read(&name);
        record["inventory"] = digest.clone().into();
        std::fs::write(parts.join(&name), record.to_string()).unwrap();
    }
    folder
        .run("site merge out --site site.toml")
        .is_refused_with(&["does not list the pieces of the site that is named"]);
    let (out, _) = folder.expect(0, "site merge out");
    assert!(out.contains("4 proven tables"), "{out}");
}

/// Another build of the program is another program: its pieces are not kept, not mixed, and merged only with `--any-program`.
#[test]
fn parts_of_another_program_are_neither_kept_nor_mixed() {
    let folder = two_shards();
    let other = folder.path().join("other-posegate");
    std::fs::copy(env!("CARGO_BIN_EXE_posegate"), &other).unwrap();
    // Bytes after the end of a program are not run.
    let mut file = std::fs::File::options().append(true).open(&other).unwrap();
    std::io::Write::write_all(&mut file, b"\n").unwrap();
    drop(file);
    let by_other = |code, line: &str| {
        let mut command = std::process::Command::new(&other);
        command
            .args(line.split_whitespace())
            .current_dir(folder.path());
        super::checked(code, line, command.output().unwrap())
    };
    let (out, _) = by_other(0, "site build site.toml --shard 1/2 --resume --json -o out");
    let built: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&built["pieces"], &built["kept"]), (&json!(2), &json!(0)));
    folder
        .run("site merge out --any-program")
        .is_refused_with(&["shards are of different sites, programs or options"]);
    by_other(0, "site build site.toml --shard 0/2 -o out");
    by_other(0, "site merge out");
    let theirs = folder.results("out");
    folder
        .run("site merge out --site site.toml --prove")
        .is_refused_with(&["the parts are by the program 0.1.0", "--any-program"]);
    folder.expect(0, "site merge out --site site.toml --prove --any-program");
    assert!(folder.results("out") == theirs);
    // Only the manifest depends on the program.
    folder.expect(0, "site build site.toml -o own");
    folder.expect(0, "site merge own");
    let own = folder.results("own");
    let differ: Vec<&String> = own
        .keys()
        .filter(|name| own[*name] != theirs[*name])
        .collect();
    assert_eq!(differ, ["manifest.json"]);
}
