//! Runs the program in a folder, one command line at a time.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The end of a run.
pub struct Ended {
    pub code: i32,
    pub out: String,
    pub err: String,
    /// The command, for the messages of failed checks.
    command: String,
}

impl Ended {
    /// Returns what a command printed, and its exit code.
    pub fn new(output: Output, command: String) -> Self {
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Self {
            code: output.status.code().expect("an exit code"),
            out: text(output.stdout),
            err: text(output.stderr),
            command,
        }
    }

    /// Runs a command to its end.
    pub fn of(command: &mut Command) -> Self {
        let output = command.output().expect("the program");
        Self::new(output, format!("{command:?}"))
    }

    /// Checks the exit code.
    pub fn with(self, code: i32) -> Self {
        self.check(code);
        self
    }

    fn check(&self, code: i32) {
        let Self {
            out, err, command, ..
        } = self;
        assert_eq!(self.code, code, "{command}\n{out}\n{err}");
    }

    /// Returns the lines of JSON on stdout.
    pub fn lines(&self) -> Vec<Value> {
        lines(&self.out)
    }

    /// Returns the only line of JSON on stdout; `code` is the expected exit code.
    pub fn json(&self, code: i32) -> Value {
        self.check(code);
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {}", self.out))
    }

    /// Returns stderr with single spaces: errors are wrapped into lines, and an excerpt has a frame.
    pub fn words(&self) -> String {
        let err = self.err.replace('│', " ");
        err.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Checks that the input is refused with all of these words, and that nothing is printed on stdout.
    pub fn is_refused_with(&self, words: &[&str]) {
        self.check(2);
        assert_eq!(self.out, "", "{}", self.command);
        let err = self.words();
        for word in words {
            assert!(
                err.contains(word),
                "{}: {word} is not in {err}",
                self.command
            );
        }
    }
}

/// Returns the values of lines of JSON.
pub fn lines(text: &str) -> Vec<Value> {
    let parsed =
        |line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
    text.lines().map(parsed).collect()
}

/// Returns the command of a line that has spaces between its words.
pub fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(crate::program());
    let words = line.split(' ').filter(|word| !word.is_empty());
    command.args(words).current_dir(folder).stdin(Stdio::null());
    command
}

/// Runs a line in a folder.
pub fn run(folder: &Path, line: &str) -> Ended {
    Ended::of(&mut command(folder, line))
}

/// A fresh folder in which the program runs.
pub struct Case(tempfile::TempDir);

impl Case {
    /// Returns a folder with these files.
    pub fn new(files: &[(&str, &[u8])]) -> Self {
        let case = Self(tempfile::tempdir().expect("a folder"));
        for (name, content) in files {
            case.write(name, content);
        }
        case
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, content).expect("a file");
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("UTF-8")
    }

    /// Returns the names in the folder.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path()).expect("a folder");
        let name = |entry: std::io::Result<std::fs::DirEntry>| entry.expect("a name").file_name();
        let mut names: Vec<String> = entries
            .map(|entry| name(entry).into_string().expect("UTF-8"))
            .collect();
        names.sort();
        names
    }

    pub fn run(&self, line: &str) -> Ended {
        run(self.path(), line)
    }

    /// Runs a line, and checks the exit code. Returns stdout, and the words of stderr.
    pub fn expect(&self, code: i32, line: &str) -> (String, String) {
        let ended = self.run(line).with(code);
        let words = ended.words();
        (ended.out, words)
    }

    /// Runs a line, and checks the exit code. Returns the printed JSON.
    pub fn json(&self, code: i32, line: &str) -> Value {
        self.run(line).json(code)
    }
}

/// Returns the cells of a table that has a case in each line, and ` => ` between cells.
pub fn cases<const N: usize>(table: &str) -> impl Iterator<Item = [&str; N]> {
    let lines = table.lines().map(str::trim_start);
    lines.filter(|line| !line.is_empty()).map(|line| {
        let cells: Vec<&str> = line.split(" => ").collect();
        cells.try_into().unwrap_or_else(|_| panic!("{line}"))
    })
}
