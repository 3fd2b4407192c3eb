//! A site built in shards has the same bytes for any number of shards and threads. No finished piece is lost. A merge with a
//! missing or damaged piece is refused.

#[path = "site_build/disk.rs"]
mod disk;
#[path = "site_build/forged.rs"]
mod forged;
#[path = "site_build/merging.rs"]
mod merging;
#[path = "site_build/mixed.rs"]
mod mixed;
use posegate_testkit::plant;
use posegate_testkit::run::{self, Ended, cases};
use serde_json::{Value, json};
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
        let mut command = run::command(self.path(), line);
        command
            .env_remove("POSEGATE_SHARD_INDEX")
            .env_remove("POSEGATE_SHARD_COUNT")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn expect(&self, code: i32, line: &str) -> (String, String) {
        checked(code, line, self.command(line).output().unwrap())
    }

    fn run(&self, line: &str) -> Ended {
        Ended::of(&mut self.command(line))
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

    /// Copies the parts of a build to another output folder.
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

/// Checks the exit code. Returns stdout, and the words of stderr.
fn checked(code: i32, line: &str, output: Output) -> (String, String) {
    let ended = Ended::new(output, line.to_owned()).with(code);
    let words = ended.words();
    (ended.out, words)
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
fn bytes_are_equal_for_any_number_of_shards_and_threads() {
    let folder = Folder::with(&PLANT);
    folder.expect(0, "site build site.toml --threads 1 -o one");
    let merged = folder.run("site merge one --json").json(0);
    assert_eq!(
        (&merged["tables"], &merged["plans"]),
        (&8.into(), &4.into())
    );
    assert_eq!(merged["without_plan"], json!([]));
    let one = folder.results("one");
    assert_eq!(one.len(), 8 + 8 + 4 + 1);

    folder.expect(0, "site build site.toml --threads 2 -o threads");
    folder.expect(0, "site merge threads");
    assert!(folder.results("threads") == one, "two threads");
    for shard in 0..2 {
        // As an array job states the shard.
        let line = "site build site.toml --threads 1 -o two";
        let mut command = folder.command(line);
        command
            .env("POSEGATE_SHARD_INDEX", format!("{shard}"))
            .env("POSEGATE_SHARD_COUNT", "2");
        checked(0, line, command.output().unwrap());
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

    // The picture of the routes is of the results alone, and changes none of them.
    for output in ["one", "five"] {
        folder.expect(
            0,
            &format!("site merge {output} --site site.toml --picture {output}.svg"),
        );
        assert!(folder.results(output) == one, "{output} with a picture");
    }
    // No picture replaces a result, and none is written among them.
    for file in ["manifest.json", "tables/new.svg", "proofs/a.svg"] {
        let before = folder.results("one");
        folder.expect(
            2,
            &format!("site merge one --site site.toml --picture one/{file}"),
        );
        assert!(folder.results("one") == before, "{file}");
    }
    let picture = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let routes = picture("one.svg");
    assert!(routes == picture("five.svg"), "pictures");
    assert!(
        routes.contains(">The site, with the routes of its 4 plans</text>")
            && routes.matches(": worst margin 1.").count() == 4
            && routes.contains("looks: every place where the robot may be"),
        "{routes}"
    );
    // A disc and a dotted line of sight for each look, and one of each in the legend.
    let plans = one.iter().filter(|(name, _)| name.starts_with("plans/"));
    let looks = plans.map(|(_, bytes)| {
        let plan: Value = serde_json::from_slice(bytes).unwrap();
        let steps = plan["steps"].as_array().unwrap().iter();
        steps.filter(|step| step["type"] == "localization").count()
    });
    let count: usize = looks.sum();
    assert!(count >= 4);
    assert_eq!(
        routes.matches("stroke-dasharray=\"4 2\"").count(),
        count + 1
    );

    // The manifest is of exactly these files.
    let manifest: Value = serde_json::from_slice(&one["manifest.json"]).unwrap();
    let listed = manifest["files"].as_array().unwrap();
    assert_eq!(listed.len(), 20);
    for file in listed {
        let bytes = &one[file["path"].as_str().unwrap()];
        assert_eq!(file["bytes"], bytes.len());
        assert_eq!(file["sha256"], sha256(bytes));
    }

    // Each result equals the output of the single command.
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

/// Returns the digest that `sha256sum` prints.
fn sha256(bytes: &[u8]) -> String {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let output = Command::new("sha256sum").arg(file.path()).output().unwrap();
    String::from_utf8(output.stdout).unwrap()[..64].to_owned()
}

/// Flips a bit in the content of a finished piece, near its end.
fn flip(piece: &Path) {
    let mut bytes = std::fs::read(piece).unwrap();
    let place = bytes.len() - 200;
    bytes[place] ^= 1;
    std::fs::write(piece, bytes).unwrap();
}

/// Changes the files of a finished piece, and corrects its header for them.
fn rewrite(piece: &Path, change: impl FnOnce(&mut Vec<(String, Vec<u8>)>)) {
    let bytes = std::fs::read(piece).unwrap();
    let end = bytes.iter().position(|byte| *byte == b'\n').unwrap();
    let mut head: Value = serde_json::from_slice(&bytes[..end]).unwrap();
    let mut rest = &bytes[end + 1..];
    let mut files = Vec::new();
    for listed in head["files"].as_array().unwrap() {
        let (own, others) = rest.split_at(listed["bytes"].as_u64().unwrap() as usize);
        files.push((listed["path"].as_str().unwrap().to_owned(), own.to_vec()));
        rest = others;
    }
    change(&mut files);
    let listed = files
        .iter()
        .map(|(path, bytes)| json!({"path": path, "bytes": bytes.len(), "sha256": sha256(bytes)}));
    head["files"] = listed.collect();
    let mut bytes = format!("{head}\n").into_bytes();
    for (_, file) in &files {
        bytes.extend(file);
    }
    std::fs::write(piece, bytes).unwrap();
}

#[test]
fn impossible_piece_is_named_and_the_others_are_built() {
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
    assert!(
        err.contains(
            "pieces that are missing or damaged: 1 the table of `../yard`: shard 0/1, parts/"
        ),
        "{err}"
    );
    // The five pieces do not belong to the corrected site. The name stays within the folder.
    let site = std::fs::read_to_string(folder.path().join("site.toml")).unwrap();
    folder.write(
        "corrected.toml",
        &format!("{site}expected = {{ translation = 0.3, yaw_deg = 5.0 }}\n"),
    );
    folder.expect(0, "site build corrected.toml -o out");
    folder.expect(0, "site merge out");
    assert!(
        folder
            .results("out")
            .contains_key("tables/%2E.%2Fyard.posegate")
    );
}

/// A work task without a plan is the answer no.
#[test]
fn work_task_without_a_plan_is_reported() {
    let folder = Folder::with(&format!(
        "{}from = \"gate\"\n[chain.gate]\nstart = {{ x = -3.0, y = 0.0, yaw_deg = 0.0, bounded = {{ translation = 0.5, yaw_deg = 2.0 }} }}\n",
        boxes()
    ));
    folder.expect(0, "site build site.toml -o out");
    let (out, _) = folder.expect(1, "site merge out --site site.toml --picture routes.svg");
    let routes = std::fs::read_to_string(folder.path().join("routes.svg")).unwrap();
    assert!(
        routes.contains(">The site: 0 of 1 plans found</text>")
            && routes.contains(">dock-4 from gate: NO PLAN: "),
        "{routes}"
    );
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
fn site_without_tasks_is_refused() {
    let folder = Folder::with("");
    let (_, error) = folder.expect(2, "site build site.toml -o built");
    assert!(error.contains("the site has no task"), "{error}");
    assert!(!folder.path().join("built").exists());
}

#[test]
fn invalid_usage_is_refused() {
    let folder = Folder::with(&boxes());
    for [line, expected] in cases(
        "
        --shard 3/2 -o out => counted from 0, the last of 2 is 1/2
        --shard 0/0 -o out => one shard at least
        --shard half -o out => `half` is no shard
        --shard-index 2 --shard-count 2 -o out => the last of 2 is 1/2
        --shard-index 1 -o out => --shard-count
        --shard +1/2 -o out => `+1/2` is no shard
        --shard 1/+2 -o out => `1/+2` is no shard
        --shard-index +1 --shard-count 2 -o out => `+1` is no number of shards
        --shard 0/1000001 -o out => a site is cut into 1000000 shards at most
        --shard 0/2 --shard-index 1 --shard-count 2 -o out => --shard 0/2, and 1/2 by POSEGATE_SHARD_INDEX
        --shard 1/2 --shard-index 2 --shard-count 2 -o out => the last of 2 is 1/2
        --threads 0 -o out => --threads 0 does no work
        --most-risk nan -o out => not a probability
        -o site.toml => site.toml: is a file, and a folder is needed
        ",
    ) {
        folder.run(&format!("site build site.toml {line}")).is_refused_with(&[expected]);
    }
    assert!(!folder.path().join("out").exists());
    folder
        .run("site merge site.toml")
        .is_refused_with(&["is a file"]);
    folder
        .run("site merge out --prove")
        .is_refused_with(&["--site"]);
    // The same shard by both options.
    folder.expect(
        0,
        "site build site.toml --shard 1/2 --shard-index 1 --shard-count 2 -o same",
    );
    // A folder with foreign tables is left unchanged.
    std::fs::create_dir_all(folder.path().join("own/tables")).unwrap();
    folder.write("own/tables/mine", "1");
    folder
        .run("site build site.toml -o own")
        .is_refused_with(&["own: there is a `tables` already that is of no site build"]);
    assert!(folder.path().join("own/tables/mine").exists());
}
