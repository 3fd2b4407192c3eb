//! The arguments of a job.

use crate::shell::Result;
use std::path::PathBuf;

/// What follows the name of a job on the command line.
pub struct Arguments {
    given: Vec<String>,
    /// The folder that relative paths are relative to: where the command was given.
    start: PathBuf,
    usage: String,
}

impl Arguments {
    /// # Errors
    /// If there are more arguments than `usage` names. One that ends in `..]` takes any number.
    pub fn new(given: Vec<String>, start: PathBuf, job: &str, usage: &str) -> Result<Self> {
        let usage_line = format!("usage: cargo xtask {job} {usage}");
        if !usage.contains("..") && given.len() > usage.split_whitespace().count() {
            return Err(usage_line.trim_end().into());
        }
        Ok(Self {
            given,
            start,
            usage: usage_line,
        })
    }

    pub fn all(&self) -> &[String] {
        &self.given
    }

    pub fn get(&self, index: usize) -> Option<&str> {
        self.given.get(index).map(String::as_str)
    }

    /// Returns an argument, or the default if it is not given.
    pub fn or<'a>(&'a self, index: usize, default: &'a str) -> &'a str {
        self.get(index).unwrap_or(default)
    }

    /// Returns a number, or the default if it is not given.
    pub fn number(&self, index: usize, default: u64) -> Result<u64> {
        let Some(text) = self.get(index) else {
            return Ok(default);
        };
        text.parse()
            .map_err(|_| format!("`{text}` is not a whole number; {}", self.usage).into())
    }

    /// Returns an argument that the job cannot do without.
    pub fn required(&self, index: usize, what: &str) -> Result<&str> {
        self.get(index)
            .ok_or_else(|| format!("{} ({what})", self.usage).into())
    }

    /// Returns a path as an absolute one.
    pub fn path(&self, index: usize) -> Option<PathBuf> {
        self.get(index).map(|path| self.start.join(path))
    }

    /// Returns a folder that exists, as an absolute path.
    pub fn folder(&self, index: usize, what: &str) -> Result<PathBuf> {
        let given = self.required(index, what)?;
        let path = self.start.join(given);
        match path.canonicalize() {
            Ok(path) if path.is_dir() => Ok(path),
            _ => Err(format!("no folder {given}; {}", self.usage).into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(given: &[&str], usage: &str) -> Result<Arguments> {
        let given = given.iter().map(ToString::to_string).collect();
        Arguments::new(given, "/start".into(), "faults", usage)
    }

    #[test]
    fn arguments_beyond_the_usage_are_refused() {
        assert!(arguments(&["7", "1"], "[N [SEED]]").is_ok());
        let error = arguments(&["7", "1", "2"], "[N [SEED]]").err().unwrap();
        assert_eq!(error.to_string(), "usage: cargo xtask faults [N [SEED]]");
        assert!(arguments(&["7", "a", "b"], "SECONDS [TARGET..]").is_ok());
    }

    #[test]
    fn defaults_replace_missing_arguments() {
        let given = arguments(&["7", "x/y"], "[N [SEED]]").unwrap();
        assert_eq!(given.number(0, 3).unwrap(), 7);
        assert_eq!(given.number(2, 3).unwrap(), 3);
        assert!(given.number(1, 3).is_err());
        assert_eq!(given.path(1).unwrap(), PathBuf::from("/start/x/y"));
        assert!(given.required(2, "a folder").is_err());
    }
}
