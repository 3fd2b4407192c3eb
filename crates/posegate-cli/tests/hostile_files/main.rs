//! For any content of a file the program ends with 0, 1 or 2, without a panic, within 512 MiB and 20 s of processor time.
//! (3 is an internal error.)
//!
//! Files are bags with one flipped bit, and mutants of good files of every format. Each gets its own process. A share of
//! them is tried here; `./ci.sh hostile [FLIPS] [MUTANTS] [SEED]` tries thousands. Files that fail are kept in `target/tmp/hostile`.
#![cfg(unix)]

#[allow(dead_code)]
use posegate_testkit::bags;
mod chance;
mod child;
mod crafted;
mod formats;
mod mutate;

use chance::Chance;
use child::{End, MOST_MIB, MOST_SECONDS, Run, run};
use formats::{COMPANIONS, Format, SITES};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The results of a format.
#[derive(Debug, Default)]
struct Tally {
    files: u64,
    aborts_and_panics: u64,
    renderer_panics: u64,
    other_exits: u64,
    internal: u64,
    mib: u64,
    seconds: f64,
    failures: Vec<String>,
}

impl Tally {
    fn note(&mut self, run: &Run, words: impl FnOnce() -> String) {
        self.files += 1;
        match run.end {
            End::Exit(code) => self.internal += u64::from(code == 3),
            End::OtherExit(_) => self.other_exits += 1,
            End::PanicOfRenderer => self.renderer_panics += 1,
            End::Panic | End::Killed(_) => self.aborts_and_panics += 1,
        }
        self.mib = self.mib.max(run.mib);
        self.seconds = self.seconds.max(run.seconds);
        if !run.is_good() {
            let stderr: String = run.stderr.chars().take(300).collect();
            let line = format!(
                "{:?}, {} MiB, {:.1} s: {}: {stderr}",
                run.end,
                run.mib,
                run.seconds,
                words()
            );
            eprintln!("{line}");
            self.failures.push(line);
        }
    }

    /// Prints the results as JSON lines.
    fn print(&self, name: &str) {
        for (what, value, unit, goal) in [
            ("files tried", self.files as f64, "files", None),
            (
                "aborts and panics",
                self.aborts_and_panics as f64,
                "files",
                Some(0.0),
            ),
            (
                "panics of the renderer of errors",
                self.renderer_panics as f64,
                "files",
                Some(0.0),
            ),
            (
                "exits other than 0 to 3",
                self.other_exits as f64,
                "files",
                Some(0.0),
            ),
            ("exits with 3", self.internal as f64, "files", Some(0.0)),
            (
                "worst memory",
                self.mib as f64,
                "MiB",
                Some(MOST_MIB as f64),
            ),
            ("worst time", self.seconds, "s", Some(MOST_SECONDS)),
        ] {
            let line = serde_json::json!({"name": format!("hostile: {name}: {what}"), "value": value, "unit": unit, "goal": goal});
            println!("{line}");
        }
    }
}

/// A folder with the files that commands need in addition to a mutant.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new(from: Option<&Path>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let companions = COMPANIONS.iter().copied();
        let sites = SITES.iter().map(|(name, text)| (*name, text.as_bytes()));
        for (name, bytes) in companions.chain(sites) {
            std::fs::write(folder.path().join(name), bytes).expect("a file");
        }
        std::fs::write(folder.path().join("trajectory.txt"), formats::tum()).expect("a file");
        std::fs::write(folder.path().join("times.txt"), formats::times()).expect("a file");
        let bag = folder.path().join("bag");
        std::fs::create_dir(&bag).expect("a folder");
        for name in ["a_0.mcap", "a_1.mcap"] {
            std::fs::write(bag.join(name), formats::bag(None, 4)).expect("a file");
        }
        if let Some(from) = from {
            for entry in std::fs::read_dir(from).expect("a folder") {
                let path = entry.expect("a file").path();
                if path.is_file() {
                    let to = folder.path().join(path.file_name().expect("a name"));
                    std::fs::copy(&path, to).expect("a copy");
                }
            }
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("a file").path();
        let to = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            copied(&path, &to);
        } else {
            std::fs::copy(&path, &to).expect("a copy");
        }
    }
}

/// Runs the program on mutant number `index` of a format.
fn trial(
    format: &Format,
    own: &Folder,
    made: &Folder,
    seed: u64,
    index: usize,
    tally: &Mutex<Tally>,
) {
    let mut chance = Chance(seed ^ (index as u64).wrapping_mul(0x2545_f491_4f6c_dd1d));
    for byte in format.name.bytes() {
        chance.0 = chance.0.wrapping_mul(31).wrapping_add(byte.into());
    }
    let which = chance.below(format.seeds.len());
    let mutant = mutate::mutant(&mut chance, &format.seeds[which], format.kind);
    let command = format.commands[chance.below(format.commands.len())];
    let mut file = format.file.to_owned();
    if file.contains("{part}") {
        let _ = std::fs::remove_dir_all(own.path("built"));
        copied(&made.path("built"), &own.path("built"));
        let parts = std::fs::read_dir(own.path("built/parts")).expect("parts");
        let mut names: Vec<String> = parts
            .map(|part| {
                part.expect("a part")
                    .file_name()
                    .to_string_lossy()
                    .into_owned()
            })
            .collect();
        names.sort();
        file = format.file.replace("{part}", &names[which]);
    }
    for left in [
        "out",
        "out.toml",
        "out.posegate",
        "out.h",
        "out.html",
        "out.elf",
    ] {
        let _ = std::fs::remove_dir_all(own.path(left));
        let _ = std::fs::remove_file(own.path(left));
    }
    std::fs::write(own.path(&file), &mutant).expect("a mutant");
    let arguments: Vec<String> = command
        .split(' ')
        .map(|word| word.replace("{}", &file))
        .collect();
    let run = run(own.0.path(), &arguments);
    tally.lock().expect("a tally").note(&run, || {
        let kept = keep(
            &format!("{}-{index}", format.name.replace(' ', "-")),
            &file,
            &mutant,
        );
        format!("posegate {command}, {kept}")
    });
}

/// Keeps a file that failed. Returns its path.
fn keep(name: &str, file: &str, bytes: &[u8]) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hostile");
    std::fs::create_dir_all(&folder).expect("a folder");
    let end = Path::new(file)
        .extension()
        .map_or("bin".into(), |end| end.to_string_lossy());
    let path = folder.join(format!("{name}.{end}"));
    std::fs::write(&path, bytes).expect("a file");
    path.display().to_string()
}

/// Runs `count` trials on two threads, each in a separate folder.
fn shared(count: usize, made: &Folder, trial: impl Fn(&Folder, usize) + Sync) {
    let next = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let own = Folder::new(Some(made.0.path()));
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= count {
                        break;
                    }
                    trial(&own, index);
                }
            });
        }
    });
}

/// Runs the program on bags with one flipped bit each.
fn flips(bag: &[u8], count: usize, seed: u64, made: &Folder) -> Tally {
    let tally = Mutex::new(Tally::default());
    shared(count, made, |own, index| {
        let mut chance = Chance(seed.wrapping_add((index as u64) << 32));
        let bit = chance.below(bag.len() * 8);
        let mut flipped = bag.to_vec();
        flipped[bit / 8] ^= 1 << (bit % 8);
        std::fs::write(own.path("flipped.mcap"), &flipped).expect("a bag");
        let arguments = "replay dock.toml flipped.mcap --task dock --topic /amcl_pose --cross-terms yaw-unknown --fast --table dock.posegate --json";
        let arguments: Vec<String> = arguments.split(' ').map(String::from).collect();
        let run = run(own.0.path(), &arguments);
        tally.lock().expect("a tally").note(&run, || {
            format!(
                "bit {bit}, {}",
                keep(&format!("bit-{bit}"), "f.mcap", &flipped)
            )
        });
    });
    tally.into_inner().expect("a tally")
}

/// Tries flips and mutants, and prints the results.
fn tried(
    count_flips: usize,
    count_mutants: usize,
    seed: u64,
    recorded: Option<&[u8]>,
) -> Vec<String> {
    let made = Folder::new(None);
    let formats = formats::all(made.0.path(), recorded);
    let own = formats::bag(Some(bags::Compression::Zstd), 300);
    let mut failures = Vec::new();
    let flipped = flips(recorded.unwrap_or(&own), count_flips, seed, &made);
    flipped.print("bits of a bag flipped");
    failures.extend(flipped.failures);
    for (place, format) in formats.iter().enumerate() {
        let share =
            count_mutants / formats.len() + usize::from(place < count_mutants % formats.len());
        let tally = Mutex::new(Tally::default());
        shared(share, &made, |own, index| {
            trial(format, own, &made, seed, index, &tally)
        });
        let tally = tally.into_inner().expect("a tally");
        assert_eq!(tally.files, share as u64);
        tally.print(format.name);
        failures.extend(tally.failures);
    }
    failures
}

/// A share of the cases of `./ci.sh hostile`.
#[test]
fn some_hostile_files_end_with_a_valid_exit_code() {
    let failures = tried(40, 216, 1, None);
    assert!(
        failures.is_empty(),
        "{} files:\n{}",
        failures.len(),
        failures.join("\n")
    );
}

/// The test of the job `hostile`.
#[test]
#[ignore = "./ci.sh hostile"]
fn hostile_files_end_with_a_valid_exit_code() {
    let number = |name: &str, otherwise: usize| {
        std::env::var(name).map_or(otherwise, |text| text.parse().expect("a whole number"))
    };
    let recorded = std::env::var_os("POSEGATE_RECORDED").map(|folder| {
        let path = Path::new(&folder).join("nav2/nav2_turtlebot.mcap");
        std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    });
    let failures = tried(
        number("POSEGATE_FLIPS", 2_000),
        number("POSEGATE_MUTANTS", 20_000),
        number("POSEGATE_SEED", 1) as u64,
        recorded.as_deref(),
    );
    assert!(
        failures.is_empty(),
        "{} files:\n{}",
        failures.len(),
        failures.join("\n")
    );
}
