//! Warnings about a site.

/// A warning about a likely mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The kind of warning: a word for scripts.
    pub code: &'static str,
    /// The subject: `tag t7`.
    pub about: String,
    /// The keys of the subject in the site file: `["tag", "t7", "size"]`.
    pub at: Vec<String>,
    /// The finding.
    pub message: String,
    /// Advice on what to check.
    pub help: String,
    /// `true` if, because of this problem, the success set is empty in the range in which the task searches it.
    pub empties: bool,
}

/// Returns a warning about an entry of the site, given by its kind and its name.
pub(super) fn warn(code: &'static str, about: [&str; 2], message: String, help: &str) -> Warning {
    Warning {
        code,
        about: about.join(" "),
        at: about.map(str::to_owned).to_vec(),
        message,
        help: help.into(),
        empties: false,
    }
}
