//! Runs the program in a folder with the files of a case.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};

/// A folder with the files of a case.
pub struct Case(tempfile::TempDir);

/// The end of a run.
pub struct Ended {
    pub code: Option<i32>,
    pub out: String,
    /// With single spaces.
    pub err: String,
}

impl Case {
    pub fn new(files: &[(&str, &[u8])]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, bytes) in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, bytes).expect("a file");
        }
        Self(folder)
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn run(&self, arguments: &str) -> Ended {
        let output = Command::new(env!("CARGO_BIN_EXE_posegate"))
            .args(arguments.split_whitespace())
            .current_dir(self.0.path())
            .stdin(Stdio::null())
            .output()
            .expect("the program runs");
        // The frame around an excerpt breaks lines anywhere.
        let err = String::from_utf8_lossy(&output.stderr).replace('│', " ");
        Ended {
            code: output.status.code(),
            out: String::from_utf8_lossy(&output.stdout).into_owned(),
            err: err.split_whitespace().collect::<Vec<_>>().join(" "),
        }
    }
}

impl Ended {
    /// Returns the printed JSON; `code` is the expected exit code.
    pub fn json(&self, code: i32) -> Value {
        assert_eq!(self.code, Some(code), "{}\n{}", self.out, self.err);
        serde_json::from_str(&self.out).expect("JSON")
    }

    /// Checks that the input is refused with all of these words.
    pub fn is_refused_with(&self, words: &[&str]) {
        assert_eq!(self.code, Some(2), "{}\n{}", self.out, self.err);
        for word in words {
            assert!(self.err.contains(word), "{word} is not in {}", self.err);
        }
    }
}
