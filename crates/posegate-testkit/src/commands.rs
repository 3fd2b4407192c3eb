//! A folder with an input for every subcommand, and a command line for each subcommand that runs there.

use crate::bags::{Bag, Pose};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// The program itself and all leaves of the tree of commands, each followed by its arguments that name files: `COMMAND` and `COMMAND ARGUMENT ROLE`. A test of the
/// program compares it with the tree.
const LIST: &str = include_str!("../../../tests/data/file_arguments.txt");

/// A command line of each leaf. Names in braces are arguments of the list. Every option that names a file is in one of the lines.
pub const LINES: [(&str, &str); 33] = [
    ("posegate", "--man {man}"),
    ("init", "init {file}"),
    ("check", "check {site} --draw {draw}"),
    (
        "import",
        "import {file} --format wpilib --size 0.1651 --family tag36h11 -o {output}",
    ),
    ("contains", "contains {site} --task dock --poses {poses}"),
    ("table build", "table build {site} --task dock -o {output}"),
    ("table info", "table info {table}"),
    (
        "table cost",
        "table cost {table} --core cortex-m4f --tracker",
    ),
    ("table verify", "table verify {table} {site}"),
    (
        "table export",
        "table export {table} --format c -o {output}",
    ),
    ("table seal", "table seal {firmware} -o {output}"),
    ("gate", "gate {table} --estimates {estimates}"),
    ("chain", "chain {site} --name back-to-dock -o {output}"),
    (
        "plan",
        "plan {site} --from back-to-dock --to dock --costs {costs} --rules {rules} -o {output}",
    ),
    (
        "cover",
        "cover {site} --from back-to-dock --sheet {sheet} -o {output}",
    ),
    (
        "metrics",
        "metrics {reference} {estimate} --site {site} --task dock --times {times}",
    ),
    (
        "learn bounds",
        "learn bounds {detections} --quantile 0.9 --camera rear --site {site} --tag-size 0.2 --family tag36h11 --truth {truth} --times {times} -o {output}",
    ),
    (
        "learn inflation",
        "learn inflation {estimates} --epsilon 0.9 -o {output}",
    ),
    (
        "learn inflation",
        "learn inflation drive.mcap --topic /pose --epsilon 0.5 --site {site} --truth {truth} --times {times} -o {output}",
    ),
    ("learn outcomes", "learn outcomes {outcomes} --epsilon 0.9"),
    (
        "learn check",
        "learn check {model} {detections} --site {site} --truth {truth} --times {times}",
    ),
    ("learn survey", "learn survey {site} {dockings}"),
    ("predict", "predict {model} --at {at}"),
    (
        "replay",
        "replay {site} {log} --task dock --truth {truth} --times {times} --odom {odom} --max-speed 1 --max-yaw-rate 90 --table {table} --rows {rows} --csv {csv} --mcap {mcap} -o {output}",
    ),
    (
        "replay",
        "replay {site} {log} --task dock --inflation-model {inflation_model}",
    ),
    (
        "cost",
        "cost {site} --task see-t7 --covariance-file {covariance_file}",
    ),
    (
        "place",
        "place {site} --task see-near --covariance-file {covariance_file} --free x=40:50 --budget 20 -o {output} --sheet {sheet}",
    ),
    (
        "place",
        "place {site} --task see-near --covariance-file {covariance_file} --candidates {candidates}",
    ),
    ("site build", "site build {site} --tables-only -o {output}"),
    (
        "site merge",
        "site merge {folder} --site {site} --picture {picture}",
    ),
    (
        "draw",
        "draw {site} --task dock --table {table} --estimates {estimates} -o {output}",
    ),
    (
        "report",
        "report {site} --placement see-t7={placement} --picture {picture} -o {output}",
    ),
    ("explain", "explain"),
];

/// Returns the exit code of a leaf's lines. `place` searches a region where no place sees the tag, because that is quick.
pub fn code_of(leaf: &str) -> i32 {
    i32::from(leaf == "place")
}

/// `demo` takes seconds, so only one test runs it.
pub const DEMO: (&str, &str) = ("demo", "demo -o {output}");

/// Files that the fixture's site file names.
pub const NAMED_BY_SITE: [&str; 3] = ["front.yaml", "hall.json", "model.toml"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Input,
    Output,
    OutputFolder,
}

/// Returns the leaves, each with its arguments that name files.
pub fn listed() -> BTreeMap<String, Vec<(String, Role)>> {
    let mut all: BTreeMap<String, Vec<(String, Role)>> = BTreeMap::new();
    let mut leaf = String::new();
    for line in LIST.lines() {
        let Some(argument) = line.strip_prefix("  ") else {
            leaf = line.into();
            all.entry(leaf.clone()).or_default();
            continue;
        };
        let (name, role) = argument.split_once(' ').unwrap();
        let role = match role {
            "Input" | "NamedInput" => Role::Input,
            "Output" => Role::Output,
            "OutputFolder" => Role::OutputFolder,
            other => panic!("{other}"),
        };
        all.get_mut(&leaf).unwrap().push((name.into(), role));
    }
    all
}

/// Returns the arguments in braces of a line, with their roles.
pub fn arguments(leaf: &str, line: &str) -> Vec<(String, Role)> {
    let all = &listed()[leaf];
    let has = |(name, _): &&(String, Role)| line.contains(&format!("{{{name}}}"));
    let found: Vec<_> = all.iter().filter(has).cloned().collect();
    assert_eq!(found.len(), line.matches('{').count(), "{line}: {all:?}");
    found
}

/// Returns the fixture's file for an input.
pub fn file_of(leaf: &str, argument: &str) -> &'static str {
    match (leaf, argument) {
        ("import", "file") => "hall.json",
        ("predict" | "learn check", "model") => "model.toml",
        ("learn inflation", "estimates") => "scored.csv",
        ("metrics", "estimate") => "estimate.tum",
        ("replay", "inflation_model") => "filter.toml",
        (_, "site") => "site.toml",
        (_, "table") => "dock.posegate",
        (_, "poses" | "estimates" | "log") => "estimates.csv",
        (_, "reference" | "truth" | "odom" | "times") => "truth.tum",
        (_, "costs") => "costs.csv",
        (_, "detections") => "detections.csv",
        (_, "outcomes") => "outcomes.csv",
        (_, "dockings") => "dockings.csv",
        (_, "at") => "at.csv",
        (_, "firmware") => "firmware",
        (_, "covariance_file") => "covariance.csv",
        (_, "candidates") => "candidates.csv",
        (_, "placement") => "placement.json",
        (_, "picture") => "picture.svg",
        (_, "folder") => "built",
        other => panic!("no input for {other:?}"),
    }
}

/// Returns a line's arguments. Those not in `given` become the fixture's inputs, and `out-ARGUMENT` for outputs.
pub fn filled(leaf: &str, line: &str, given: &[(&str, &str)]) -> Vec<String> {
    let mut line = line.to_string();
    for (name, role) in arguments(leaf, &line) {
        let given = given.iter().find(|(known, _)| *known == name);
        let value = match (given, role) {
            (Some((_, value)), _) => (*value).to_string(),
            (None, Role::OutputFolder) if leaf == "site merge" => "built".into(),
            (None, Role::Input) => file_of(leaf, &name).into(),
            (None, _) => format!("out-{name}"),
        };
        line = line.replace(&format!("{{{name}}}"), &value);
    }
    line.split(' ').map(str::to_string).collect()
}

/// A fresh folder with all inputs.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        static FIXTURE: OnceLock<Folder> = OnceLock::new();
        let folder = Self(tempfile::tempdir().unwrap());
        copy(FIXTURE.get_or_init(fixture).path(), folder.path());
        folder
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path().join(name), bytes).unwrap();
    }

    pub fn command<T: AsRef<str>>(&self, arguments: &[T]) -> Command {
        let mut command = Command::new(crate::program());
        command
            .args(arguments.iter().map(AsRef::as_ref))
            .current_dir(self.path())
            .env_remove("RUST_BACKTRACE")
            .stdin(Stdio::null());
        command
    }

    pub fn run<T: AsRef<str>>(&self, arguments: &[T]) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// Returns the content of the folder: paths, links and bytes.
    pub fn snapshot(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut found = BTreeMap::new();
        let mut open = vec![self.path().to_path_buf()];
        while let Some(path) = open.pop() {
            let data = path.symlink_metadata().unwrap();
            if data.is_dir() {
                open.extend(
                    fs::read_dir(&path)
                        .unwrap()
                        .map(|entry| entry.unwrap().path()),
                );
            }
            let bytes = if data.is_symlink() {
                let to = fs::read_link(&path).unwrap();
                format!("link to {}", to.display()).into_bytes()
            } else if data.is_dir() {
                b"folder".to_vec()
            } else {
                fs::read(&path).unwrap()
            };
            found.insert(path.strip_prefix(self.path()).unwrap().into(), bytes);
        }
        found
    }
}

fn copy(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if from.is_dir() {
            fs::create_dir(&to).unwrap();
            copy(&from, &to);
        } else {
            fs::copy(&from, &to).unwrap();
        }
    }
}

/// Appended to the site of the paper's chain, so that the site names other files and every subcommand can use it.
const MORE: &str = r#"
table = { step = { xy = 0.25, yaw_deg = 5.0 } }

[planner]
look = { camera = "front", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }
r = [[0.05, 2.0]]

[candidate.c1]
family = "tag36h11"
size = 0.30
pose = { x = 4.0, y = 0.5, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }

[camera.rear]
calibration = "front.yaml"
image = "rect"
mount = { x = -0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }

[import.hall]
file = "hall.json"
format = "wpilib"
family = "tag36h11"
size = 0.1651

[error_model.tags]
file = "model.toml"
"#;

/// A localization task whose set has an error model, and one that sees nothing from its goal, for `place`.
const SEE_WELL: &str = r#"
[error_model.simple]
translation = [0.01, 0.0, 0.0, 0.0]
yaw_deg = [0.5, 0.0, 0.0, 0.0]

[task.see-well]
kind = "localization"
goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }
success = { shape = "visibility", camera = "front", tag = "t7", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0, error_model = "simple", r = { translation = 0.02, yaw_deg = 1.0 } }
error_bound = { translation = 0.02, yaw_deg = 1.0 }
table = { step = { xy = 0.25, yaw_deg = 5.0 } }

[task.see-near]
kind = "localization"
goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }
success = { shape = "visibility", camera = "front", tag = "t7", d_max = 2.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }
error_bound = { translation = 0.05, yaw_deg = 2.0 }"#;

const CALIBRATION: &str = "image_width: 640
image_height: 480
camera_name: front
camera_matrix: {rows: 3, cols: 3, data: [410.5, 0.0, 325.25, 0.0, 411.75, 236.5, 0.0, 0.0, 1.0]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.0, 0.0, 0.0, 0.0, 0.0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [380.5, 0, 324.0, 0.0, 0.0, 384.25, 235.0, 0.0, 0.0, 0.0, 1.0, 0.0]}
";

const FIELD: &str = r#"{"tags": [{"ID": 1, "pose": {"translation": {"x": 9.0, "y": 9.0, "z": 1.0}, "rotation": {"quaternion": {"W": 1.0, "X": 0.0, "Y": 0.0, "Z": 0.0}}}}]}"#;

/// Returns an estimate with these errors, near the true pose of a row.
fn near(t_s: f64, row: i32, [x, y, yaw]: [f64; 3]) -> Pose {
    Pose {
        t_s,
        logged_s: None,
        frame: "map",
        x: 1.5 + x,
        y: 0.2 + 1e-3 * f64::from(row) + y,
        yaw,
        roll: 0.0,
        length: 1.0,
        covariance: [1e-4; 3],
    }
}

fn fixture() -> Folder {
    let folder = Folder(tempfile::tempdir().unwrap());
    let chain = include_str!("../../../examples/sites/paper-chain.toml");
    folder.write("site.toml", [chain, SEE_WELL, MORE].concat());
    folder.write("front.yaml", CALIBRATION);
    folder.write("hall.json", FIELD);
    folder.write(
        "detections.csv",
        include_str!("../../../tests/data/apriltag_errors_sample.csv"),
    );
    folder.write("costs.csv", "from,to,cost\nstart,dock,5\n");
    folder.write("at.csv", "d_m,phi_deg,psi_deg\n3,10,30\n");
    folder.write("covariance.csv", "0.01,0,0\n0,0.01,0\n0,0,0.0003\n");
    folder.write(
        "candidates.csv",
        "x,y,z,yaw_deg\n40,0,0.5,180\n40,0.2,0.5,180\n",
    );
    folder.write("outcomes.csv", ["success\n", &"1\n".repeat(50)].concat());
    let mut estimates =
        "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n".to_string();
    let mut scored = estimates.replace('\n', ",true_x_m,true_y_m,true_yaw_rad\n");
    let mut tum = String::new();
    // The middle bits of a linear congruential generator.
    let mut state = 1u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24) - 0.5
    };
    let mut bag = Bag::new(None, true);
    for i in 0..400 {
        let t = f64::from(i) * 0.1;
        let row = format!(
            "{t:.1},{:.5},{:.5},{:.5},1e-4,0,0,1e-4,0,1e-5",
            1.5 + 0.02 * random(),
            0.2 + 0.02 * random(),
            0.005 * random()
        );
        if i < 50 {
            estimates += &format!("{row}\n");
            tum += &format!("{t:.1} 1.5 0.2{i:02} 0 0 0 0 1\n");
            bag.pose("/pose", &near(t, i, [(); 3].map(|()| 0.02 * random())));
        }
        scored += &format!("{row},1.5,0.2,0\n");
    }
    let dockings = (0..8).map(|docking| {
        let [x, y, yaw] = [0; 3].map(|_| 0.01 * random());
        format!(
            "{docking},dock,t7,{:.5},{:.5},{:.5}\n",
            1.5 + x,
            0.2 + y,
            yaw
        )
    });
    let dockings: String = dockings.collect();
    folder.write(
        "dockings.csv",
        format!("run,dock,tag,x_m,y_m,yaw_rad\n{dockings}"),
    );
    folder.write("drive.mcap", bag.finish());
    folder.write("estimates.csv", estimates);
    folder.write("scored.csv", scored);
    folder.write("truth.tum", &tum);
    folder.write("estimate.tum", &tum);
    folder.write("firmware", firmware());
    for line in [
        "learn bounds detections.csv --quantile 0.9 -o model.toml",
        "learn inflation scored.csv --epsilon 0.99 --confidence 0.5 -o filter.toml",
        "table build site.toml --task dock -o dock.posegate",
        "chain site.toml --name back-to-dock -o picture.svg",
        "site build site.toml --tables-only -o built",
    ] {
        let output = folder.run(&line.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{line}: {output:?}");
    }
    let line = "place site.toml --task see-near --covariance-file covariance.csv --candidates candidates.csv --json";
    let output = folder.run(&line.split(' ').collect::<Vec<_>>());
    assert_eq!(
        output.status.code(),
        Some(code_of("place")),
        "{line}: {output:?}"
    );
    folder.write("placement.json", output.stdout);
    folder
}

/// An ELF file of one segment with the record of a seal in it.
fn firmware() -> Vec<u8> {
    let magic = &posegate::gate::Seal::MAGIC;
    elf(
        0x0800_0000,
        &[&[7; 100][..], magic, &[0xff; 12], &[7; 60]].concat(),
    )
}

/// Returns an ELF file of one segment at an address.
pub fn elf(address: u32, image: &[u8]) -> Vec<u8> {
    let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x28\0".to_vec();
    let mut words =
        |values: &[u32]| file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    words(&[1, 0, 52, 0, 0, 52 | 32 << 16, 1 | 40 << 16, 0]);
    let length = image.len() as u32;
    words(&[1, 84, address, address, length, length, 5, 4]);
    file.extend(image);
    file
}
