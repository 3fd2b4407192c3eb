//! A site file to start from.

/// A commented site file: a camera, a tag and a task of each kind of success set.
pub const SAMPLE: &str = include_str!("sample.toml");
