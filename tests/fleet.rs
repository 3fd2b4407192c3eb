//! A site built in shards is the same bytes for every number of shards and threads; what is finished is never lost; and
//! nothing is merged that is not whole.
#![cfg(feature = "cli")]

#[path = "fleet/forged.rs"]
mod forged;
#[path = "fleet/merging.rs"]
mod merging;
#[allow(dead_code)]
#[path = "support/plant.rs"]
mod plant;
#[allow(dead_code)]
#[path = "planning/sites.rs"]
mod sites;
#[allow(dead_code)]
#[path = "support/warehouse.rs"]
mod warehouse;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::LazyLock;

/// A folder with a site file.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with(site: &str) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("site.toml", site);
        folder
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path().join(name), text).unwrap();
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_posegate"));
        command
            .args(line.split_whitespace())
            .current_dir(self.path())
            .env_remove("POSEGATE_SHARD_INDEX")
            .env_remove("POSEGATE_SHARD_COUNT")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn expect(&self, code: i32, line: &str) -> (String, String) {
        told(code, line, self.command(line).output().unwrap())
    }

    /// Finished pieces of a build: names that are keys.
    fn pieces(&self, output: &str) -> Vec<PathBuf> {
        let mut found: Vec<PathBuf> = self
            .parts(output)
            .into_iter()
            .filter(|name| name.len() == 64)
            .map(|name| self.path().join(output).join("parts").join(name))
            .collect();
        found.sort();
        found
    }

    fn parts(&self, output: &str) -> Vec<String> {
        let Ok(entries) = std::fs::read_dir(self.path().join(output).join("parts")) else {
            return Vec::new();
        };
        entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    fn results(&self, output: &str) -> Results {
        let mut results = Results::new();
        gather(
            &self.path().join(output),
            &self.path().join(output),
            &mut results,
        );
        results
    }

    /// A build of two shards beside the first.
    fn copied(&self, from: &str, to: &str) {
        let to = self.path().join(to).join("parts");
        std::fs::create_dir_all(&to).unwrap();
        for name in self.parts(from) {
            std::fs::copy(
                self.path().join(from).join("parts").join(&name),
                to.join(&name),
            )
            .unwrap();
        }
    }
}

/// Results of a merge: all files outside of `parts`.
type Results = BTreeMap<String, Vec<u8>>;

fn gather(root: &Path, folder: &Path, results: &mut Results) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path
            .strip_prefix(root)
            .unwrap()
            .to_str()
            .unwrap()
            .to_owned();
        if name == "parts" {
            continue;
        }
        if path.is_dir() {
            gather(root, &path, results);
        } else {
            results.insert(name, std::fs::read(&path).unwrap());
        }
    }
}

fn told(code: i32, line: &str, output: Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    // Lines of an error are broken for the reader's screen.
    let joined = |text: String| {
        let words = text.split(|c: char| c.is_whitespace() || c == '\u{2502}');
        words
            .filter(|word| !word.is_empty())
            .collect::<Vec<_>>()
            .join(" ")
    };
    let (out, err) = (text(&output.stdout), joined(text(&output.stderr)));
    assert_eq!(output.status.code(), Some(code), "{line}\n{out}\n{err}");
    (out, err)
}

/// Four endpoints: eight tables, four plans.
static PLANT: LazyLock<String> = LazyLock::new(|| plant::plant(1, 4));

/// Five boxes, which take no time.
fn boxes() -> String {
    let task = |number: usize| {
        format!(
            "[task.dock-{number}]\nkind = \"work\"\ngoal = {{ x = {number}.0, y = 0.0, yaw_deg = 0.0 }}\n\
             success = {{ shape = \"box\", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }}\n"
        )
    };
    (0..5).map(task).collect()
}

/// The boxes, built in two shards.
fn two_shards() -> Folder {
    let folder = Folder::with(&boxes());
    folder.expect(0, "site build site.toml --shard 0/2 -o out");
    folder.expect(0, "site build site.toml --shard 1/2 -o out");
    folder
}

#[test]
fn the_same_bytes_for_every_number_of_shards_and_threads() {
    let folder = Folder::with(&PLANT);
    folder.expect(0, "site build site.toml --threads 1 -o one");
    let (out, _) = folder.expect(0, "site merge one --json");
    let merged: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (&merged["tables"], &merged["plans"]),
        (&8.into(), &4.into())
    );
    assert_eq!(merged["without_plan"], serde_json::json!([]));
    let one = folder.results("one");
    assert_eq!(one.len(), 8 + 8 + 4 + 1);

    folder.expect(0, "site build site.toml --threads 2 -o threads");
    folder.expect(0, "site merge threads");
    assert!(folder.results("threads") == one, "two threads");
    for shard in 0..2 {
        // As an array job says it.
        let line = "site build site.toml --threads 1 -o two";
        let mut command = folder.command(line);
        command
            .env("POSEGATE_SHARD_INDEX", format!("{shard}"))
            .env("POSEGATE_SHARD_COUNT", "2");
        told(0, line, command.output().unwrap());
    }
    folder.expect(0, "site merge two");
    assert!(folder.results("two") == one, "two shards");
    // In any order.
    for shard in [3, 0, 4, 1, 2] {
        let line = format!("site build site.toml --shard {shard}/5 --threads 2 -o five");
        folder.expect(0, &line);
    }
    folder.expect(0, "site merge five");
    assert!(folder.results("five") == one, "five shards");
    // A merge again changes nothing.
    folder.expect(0, "site merge five");
    assert!(folder.results("five") == one, "merged again");

    // The manifest is of exactly these files.
    let manifest: serde_json::Value = serde_json::from_slice(&one["manifest.json"]).unwrap();
    let listed = manifest["files"].as_array().unwrap();
    assert_eq!(listed.len(), 20);
    for file in listed {
        let bytes = &one[file["path"].as_str().unwrap()];
        assert_eq!(file["bytes"], bytes.len());
        assert_eq!(file["sha256"], sha256(bytes));
    }

    // And each is what the command for it alone makes.
    let task = "see-0";
    folder.expect(0, "table build site.toml --task see-0 -o see-0.posegate");
    let alone = std::fs::read(folder.path().join("see-0.posegate")).unwrap();
    assert!(one[&format!("tables/{task}.posegate")] == alone);
    folder.expect(0, "table verify one/tables/see-0.posegate site.toml");
    let plan = one.keys().find(|name| name.starts_with("plans/")).unwrap();
    let (from, task) = plan["plans/".len()..]
        .trim_end_matches(".json")
        .split_once('/')
        .unwrap();
    let (out, _) = folder.expect(
        0,
        &format!("plan site.toml --from {from} --to {task} --json"),
    );
    assert_eq!(String::from_utf8_lossy(&one[plan]), out);
}

/// The digest that `sha256sum` tells.
fn sha256(bytes: &[u8]) -> String {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let output = Command::new("sha256sum").arg(file.path()).output().unwrap();
    String::from_utf8(output.stdout).unwrap()[..64].to_owned()
}

/// Turns a bit near the end of a finished piece over, in what it holds.
fn flip(piece: &Path) {
    let mut bytes = std::fs::read(piece).unwrap();
    let place = bytes.len() - 200;
    bytes[place] ^= 1;
    std::fs::write(piece, bytes).unwrap();
}

/// Changes the files of a finished piece, with all that it says of itself made right again.
fn rewrite(piece: &Path, change: impl FnOnce(&mut Vec<(String, Vec<u8>)>)) {
    let bytes = std::fs::read(piece).unwrap();
    let end = bytes.iter().position(|byte| *byte == b'\n').unwrap();
    let mut head: serde_json::Value = serde_json::from_slice(&bytes[..end]).unwrap();
    let mut rest = &bytes[end + 1..];
    let mut files = Vec::new();
    for listed in head["files"].as_array().unwrap() {
        let (own, others) = rest.split_at(listed["bytes"].as_u64().unwrap() as usize);
        files.push((listed["path"].as_str().unwrap().to_owned(), own.to_vec()));
        rest = others;
    }
    change(&mut files);
    let listed = files.iter().map(|(path, bytes)| {
        serde_json::json!({"path": path, "bytes": bytes.len(), "sha256": sha256(bytes)})
    });
    head["files"] = listed.collect();
    let mut bytes = format!("{head}\n").into_bytes();
    for (_, file) in &files {
        bytes.extend(file);
    }
    std::fs::write(piece, bytes).unwrap();
}

/// Makes the proof in a finished piece longer: blanks are nothing to JSON.
fn forge(piece: &Path) {
    rewrite(piece, |files| files.last_mut().unwrap().1.push(b' '));
}

#[test]
fn a_killed_shard_loses_no_finished_piece() {
    let folder = Folder::with(&plant::plant(1, 6));
    folder.expect(0, "site build site.toml -o whole");
    folder.expect(0, "site merge whole");
    let mut child = folder
        .command("site build site.toml --threads 1 -o out")
        .spawn()
        .unwrap();
    let finished = loop {
        let there = folder.pieces("out").len();
        if there >= 3 {
            break there;
        }
        assert!(child.try_wait().unwrap().is_none(), "it ended before");
        std::thread::sleep(std::time::Duration::from_millis(1));
    };
    child.kill().unwrap();
    child.wait().unwrap();
    let (_, err) = folder.expect(2, "site merge out");
    assert!(err.contains("no shard has ended here"), "{err}");
    // What a kill in the middle of a file leaves, which may as well be what another process writes, and what a bad disk does.
    folder.write("out/parts/.0-of-1.1-1.tmp", "half");
    folder.write("out/parts/.0-of-1.1-2.tmp", "half");
    let old = std::fs::File::options()
        .write(true)
        .open(folder.path().join("out/parts/.0-of-1.1-1.tmp"))
        .unwrap();
    let days = std::time::Duration::from_secs(2 * 24 * 60 * 60);
    old.set_modified(std::time::SystemTime::now() - days)
        .unwrap();
    let pieces = folder.pieces("out");
    let damaged = std::fs::read(&pieces[0]).unwrap();
    std::fs::write(&pieces[0], &damaged[..damaged.len() - 1]).unwrap();
    flip(&pieces[1]);
    let (out, _) = folder.expect(0, "site build site.toml --resume --json -o out");
    let built: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(built["pieces"], 18);
    let kept = built["kept"].as_u64().unwrap() as usize;
    assert!(kept >= finished - 2 && kept < 18, "{kept} of {finished}");
    assert_eq!(kept, pieces.len() - 2, "all but the damaged ones are kept");
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == folder.results("whole"));
    // That of the child that was killed is young too.
    let drafts = folder.parts("out");
    let drafts: Vec<&str> = drafts
        .iter()
        .map(String::as_str)
        .filter(|name| name.ends_with(".tmp"))
        .collect();
    assert!(drafts.contains(&".0-of-1.1-2.tmp"), "{drafts:?}");
    assert!(!drafts.contains(&".0-of-1.1-1.tmp"), "{drafts:?}");
    // Then nothing is left to be done.
    let (out, _) = folder.expect(0, "site build site.toml --resume --json -o out");
    let built: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(built["kept"], 18);
}

#[test]
fn gaps_are_named() {
    let folder = two_shards();
    std::fs::remove_file(folder.path().join("out/parts/shard-1-of-2.json")).unwrap();
    let (_, err) = folder.expect(2, "site merge out");
    assert!(err.contains("shards that have not ended: 1 1/2"), "{err}");
    assert!(!folder.path().join("out/manifest.json").exists());
    let (_, err) = folder.expect(2, "site merge nowhere");
    assert!(err.contains("nowhere: no shard has ended here"), "{err}");
}

#[test]
fn a_piece_that_is_missing_or_changed_is_named() {
    let folder = two_shards();
    folder.copied("out", "untouched");
    folder.expect(0, "site merge untouched");
    let untouched = folder.results("untouched");
    for change in ["remove", "flip", "forge", "swap"] {
        folder.copied("out", change);
        let [piece, other] = &folder.pieces(change)[..2] else {
            panic!("five pieces");
        };
        match change {
            "remove" => std::fs::remove_file(piece).unwrap(),
            "flip" => flip(piece),
            "forge" => forge(piece),
            _ => {
                std::fs::copy(other, piece).unwrap();
            }
        }
        let key = piece.file_name().unwrap().to_str().unwrap();
        let (_, err) = folder.expect(2, &format!("site merge {change}"));
        assert!(
            err.contains("pieces that are missing or damaged: 1 the table of `dock-")
                && err.contains(&key[..16])
                && err.contains("/2, parts/"),
            "{err}"
        );
        assert!(!folder.path().join(change).join("manifest.json").exists());
        assert!(!folder.path().join(change).join("tables").exists());
        // The shard that is named makes it again.
        for shard in ["0/2", "1/2"] {
            folder.expect(
                0,
                &format!("site build site.toml --shard {shard} --resume -o {change}"),
            );
        }
        folder.expect(0, &format!("site merge {change}"));
        assert!(folder.results(change) == untouched, "{change}");
    }
}

#[test]
fn a_list_that_was_changed_is_refused() {
    let folder = two_shards();
    let list = "parts/shard-0-of-2.json";
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&std::fs::read(folder.path().join("out").join(name)).unwrap())
            .unwrap()
    };
    // A piece is left out.
    folder.copied("out", "short");
    let mut changed = read(list);
    changed["pieces"].as_array_mut().unwrap().pop();
    folder.write(&format!("short/{list}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge short");
    assert!(
        err.contains("missing or damaged: 1 the table of `dock-")
            && err.contains("shard 0/2 does not list it"),
        "{err}"
    );
    // Both have one: with the same bytes, then with others.
    let other = "parts/shard-1-of-2.json";
    folder.copied("out", "twice");
    let mut changed = read(other);
    let theirs = read(list)["pieces"][0].clone();
    changed["pieces"].as_array_mut().unwrap().push(theirs);
    folder.write(&format!("twice/{other}"), &changed.to_string());
    let twice = || {
        let (_, err) = folder.expect(2, "site merge twice");
        assert!(
            err.contains("the table of `dock-")
                && err.contains(
                    "is the share of shard-0-of-2.json alone, and is listed by shard-0-of-2.json and by shard-1-of-2.json"
                ),
            "{err}"
        );
    };
    twice();
    let last = changed["pieces"].as_array().unwrap().len() - 1;
    changed["pieces"][last]["sha256"] = "00".into();
    folder.write(&format!("twice/{other}"), &changed.to_string());
    twice();
    // The other one alone, and one twice.
    let mut without = read(list);
    let own = without["pieces"].as_array_mut().unwrap().remove(0);
    folder.write(&format!("twice/{list}"), &without.to_string());
    changed["pieces"][last] = own.clone();
    folder.write(&format!("twice/{other}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge twice");
    assert!(
        err.contains("is the share of shard-0-of-2.json alone, and is listed by shard-1-of-2.json"),
        "{err}"
    );
    folder.copied("out", "doubled");
    let mut doubled = read(list);
    doubled["pieces"].as_array_mut().unwrap().push(own);
    folder.write(&format!("doubled/{list}"), &doubled.to_string());
    let (_, err) = folder.expect(2, "site merge doubled");
    assert!(
        err.contains("listed by shard-0-of-2.json and by shard-0-of-2.json"),
        "{err}"
    );
    // What is no piece of the site.
    folder.copied("out", "more");
    let mut changed = read(list);
    changed["pieces"][0]["key"] = "ab".into();
    folder.write(&format!("more/{list}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge more");
    assert!(err.contains("does not list it"), "{err}");
    let mut changed = read(list);
    let mut own = changed["pieces"][0].clone();
    own["key"] = "ab".into();
    changed["pieces"].as_array_mut().unwrap().push(own);
    folder.write(&format!("more/{list}"), &changed.to_string());
    let (_, err) = folder.expect(2, "site merge more");
    assert!(
        err.contains("lists ab, which is no piece of the site"),
        "{err}"
    );
    // A list or an inventory that is no longer what was written.
    folder.copied("out", "torn");
    folder.write(&format!("torn/{list}"), "{");
    let (_, err) = folder.expect(2, "site merge torn");
    assert!(err.contains("torn/parts/shard-0-of-2.json: EOF"), "{err}");
    folder.copied("out", "inventory");
    let parts = folder.parts("inventory");
    let name = parts
        .iter()
        .find(|name| name.starts_with("inventory-"))
        .unwrap();
    folder.write(&format!("inventory/parts/{name}"), "{}");
    let (_, err) = folder.expect(2, "site merge inventory");
    assert!(err.contains("was changed"), "{err}");
}

#[test]
fn shards_that_do_not_belong_together_are_refused() {
    let folder = two_shards();
    let digest = |site: &str| {
        let (out, _) = folder.expect(0, &format!("site build {site} --json -o digest"));
        let built: serde_json::Value = serde_json::from_str(&out).unwrap();
        built["site_digest"].as_str().unwrap().to_owned()
    };
    // The site changed between the shards.
    folder.write("other.toml", &boxes().replace("0.1]", "0.11]"));
    let (one, other) = (digest("site.toml"), digest("other.toml"));
    folder.copied("out", "changed");
    folder.expect(0, "site build other.toml --shard 1/2 --resume -o changed");
    let (_, err) = folder.expect(2, "site merge changed");
    let said = format!(
        "the site changed between shards: shard-0-of-2.json was built of the site {one}, shard-1-of-2.json of {other}"
    );
    assert!(
        err.replace(' ', "").contains(&said.replace(' ', "")),
        "{err}"
    );
    // Two numbers of shards.
    folder.copied("out", "numbers");
    folder.expect(0, "site build site.toml --shard 2/3 -o numbers");
    let (_, err) = folder.expect(2, "site merge numbers");
    assert!(
        err.contains("shard-0-of-2.json and shard-2-of-3.json are mixed"),
        "{err}"
    );
    // Other plans.
    folder.copied("out", "options");
    folder.expect(
        0,
        "site build site.toml --shard 1/2 --tables-only -o options",
    );
    let (_, err) = folder.expect(2, "site merge options");
    assert!(
        err.contains("shards are not alike: shard-0-of-2.json and shard-1-of-2.json"),
        "{err}"
    );
}

#[test]
fn a_full_disk_leaves_nothing_half() {
    let folder = Folder::with(&PLANT);
    folder.expect(0, "site build site.toml -o whole");
    folder.expect(0, "site merge whole");
    // As much as the inventory takes, and a plan takes more: in blocks of 512 bytes.
    let length = |path: &Path| std::fs::metadata(path).unwrap().len();
    let parts = folder.parts("whole");
    let inventory = parts
        .iter()
        .find(|name| name.starts_with("inventory-"))
        .unwrap();
    let blocks = length(&folder.path().join("whole/parts").join(inventory)).div_ceil(512);
    let most = folder
        .pieces("whole")
        .iter()
        .map(|path| length(path))
        .max()
        .unwrap();
    assert!(most > blocks * 512, "{most} against {blocks} blocks");
    // A limit in place of a full disk: the write fails in the same way.
    let line = "site build site.toml -o out";
    let limited = || {
        let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" {line}");
        let mut command = Command::new("sh");
        command.args(["-c", &limited, env!("CARGO_BIN_EXE_posegate")]);
        command.current_dir(folder.path()).output().unwrap()
    };
    let output = limited();
    let (_, err) = told(2, line, output);
    let squeezed = err.replace(' ', "");
    assert!(
        squeezed.contains("out/parts/")
            && squeezed.contains("Filetoolarge(oserror27)")
            && squeezed.contains("--resume"),
        "{err}"
    );
    let left = folder.parts("out");
    assert!(
        left.iter()
            .all(|name| !name.contains(".tmp") && !name.starts_with("shard-")),
        "{left:?}"
    );
    for piece in folder.pieces("out") {
        let same = folder
            .path()
            .join("whole/parts")
            .join(piece.file_name().unwrap());
        assert!(std::fs::read(&piece).unwrap() == std::fs::read(same).unwrap());
    }
    folder.expect(0, "site build site.toml --resume -o out");
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == folder.results("whole"));
    // What is whole is not given up for what does not fit.
    let output = limited();
    told(2, line, output);
    let same = folder.pieces("out");
    assert_eq!(same.len(), folder.pieces("whole").len());
    for piece in same {
        let other = folder
            .path()
            .join("whole/parts")
            .join(piece.file_name().unwrap());
        assert!(std::fs::read(&piece).unwrap() == std::fs::read(other).unwrap());
    }
}

#[test]
fn what_cannot_be_made_is_named_and_the_rest_is_there() {
    let folder = Folder::with(&format!(
        "{}[task.\"../yard\"]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\n\
         success = {{ shape = \"clear\", footprint = [[0.0, 0.0]], obstacle = [[1.0, 0.0], [2.0, 0.0], [2.0, 1.0]] }}\n",
        boxes()
    ));
    let (_, err) = folder.expect(2, "site build site.toml -o out");
    assert!(
        err.contains(
            "pieces that cannot be made: 1 the table of `../yard`: no extent can be chosen"
        ),
        "{err}"
    );
    assert_eq!(folder.pieces("out").len(), 5);
    let (_, err) = folder.expect(2, "site merge out");
    assert!(err.contains("no shard has ended here"), "{err}");
    // Mended, the five are not of this site any more; the name stays within the folder.
    let site = std::fs::read_to_string(folder.path().join("site.toml")).unwrap();
    folder.write(
        "mended.toml",
        &format!("{site}expected = {{ translation = 0.3, yaw_deg = 5.0 }}\n"),
    );
    folder.expect(0, "site build mended.toml -o out");
    folder.expect(0, "site merge out");
    assert!(
        folder
            .results("out")
            .contains_key("tables/%2E.%2Fyard.posegate")
    );
}

/// A work task without a plan is an answer, and the answer is no.
#[test]
fn a_work_task_without_a_plan_says_so() {
    let folder = Folder::with(&format!(
        "{}from = \"gate\"\n[chain.gate]\nstart = {{ x = -3.0, y = 0.0, yaw_deg = 0.0, bounded = {{ translation = 0.5, yaw_deg = 2.0 }} }}\n",
        boxes()
    ));
    folder.expect(0, "site build site.toml -o out");
    let (out, _) = folder.expect(1, "site merge out");
    assert!(
        out.contains("5 proven tables, 0 plans") && out.contains("no plan: gate: dock-4"),
        "{out}"
    );
    let results = folder.results("out");
    let plan = String::from_utf8_lossy(&results["plans/gate/dock-4.json"]);
    assert!(plan.contains("no localization task"), "{plan}");
    folder.expect(0, "site build site.toml --tables-only -o out");
    folder.expect(0, "site merge out");
    assert!(
        folder
            .results("out")
            .keys()
            .all(|name| !name.starts_with("plans/"))
    );
}

#[test]
fn usage_that_means_nothing_is_refused() {
    let folder = Folder::with(&boxes());
    for (line, says) in [
        ("--shard 3/2 -o out", "counted from 0, the last of 2 is 1/2"),
        ("--shard 0/0 -o out", "one shard at least"),
        ("--shard half -o out", "`half` is no shard"),
        (
            "--shard-index 2 --shard-count 2 -o out",
            "the last of 2 is 1/2",
        ),
        ("--shard-index 1 -o out", "--shard-count"),
        ("--shard +1/2 -o out", "`+1/2` is no shard"),
        ("--shard 1/+2 -o out", "`1/+2` is no shard"),
        (
            "--shard-index +1 --shard-count 2 -o out",
            "`+1` is no number of shards",
        ),
        (
            "--shard 0/1000001 -o out",
            "a site is cut into 1000000 shards at most",
        ),
        (
            "--shard 0/2 --shard-index 1 --shard-count 2 -o out",
            "--shard 0/2, and 1/2 by POSEGATE_SHARD_INDEX",
        ),
        (
            "--shard 1/2 --shard-index 2 --shard-count 2 -o out",
            "the last of 2 is 1/2",
        ),
        ("--threads 0 -o out", "--threads 0 does no work"),
        ("--most-risk nan -o out", "no probability"),
        (
            "-o site.toml",
            "site.toml: is a file, and a folder is needed",
        ),
    ] {
        let (_, err) = folder.expect(2, &format!("site build site.toml {line}"));
        assert!(err.contains(says), "{line}: {err}");
    }
    assert!(!folder.path().join("out").exists());
    let (_, err) = folder.expect(2, "site merge site.toml");
    assert!(err.contains("is a file"), "{err}");
    let (_, err) = folder.expect(2, "site merge out --prove");
    assert!(err.contains("--site"), "{err}");
    // The same said twice.
    folder.expect(
        0,
        "site build site.toml --shard 1/2 --shard-index 1 --shard-count 2 -o same",
    );
    // A folder with tables of somebody's own is left alone.
    std::fs::create_dir_all(folder.path().join("own/tables")).unwrap();
    folder.write("own/tables/mine", "1");
    let (_, err) = folder.expect(2, "site build site.toml -o own");
    assert!(
        err.contains("own: there is a `tables` already that is of no site build"),
        "{err}"
    );
    assert!(folder.path().join("own/tables/mine").exists());
}
