//! Arguments of a command that name files. Each type is one role, so every such argument is known before the command
//! runs.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Declares a path in one role.
macro_rules! role {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Eq)]
        pub struct $name(PathBuf);

        impl $name {
            /// Returns the path as it was given.
            #[must_use]
            pub fn as_path(&self) -> &Path {
                &self.0
            }

            /// Returns the path for messages.
            #[must_use]
            pub fn display(&self) -> std::path::Display<'_> {
                self.0.display()
            }

            /// Returns `true` if it is standard input or output.
            #[must_use]
            pub fn is_standard(&self) -> bool {
                self.0.as_os_str() == "-"
            }
        }

        impl From<OsString> for $name {
            fn from(text: OsString) -> Self {
                Self(text.into())
            }
        }
    };
}

role! {
    /// A file that a command reads; `-` is standard input.
    Input
}
role! {
    /// A file that a command writes; `-` is standard output.
    Output
}
role! {
    /// A folder that a command writes files into.
    OutputFolder
}

/// An input of a task: `TASK=FILE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedInput {
    /// The name.
    pub name: String,
    /// The file.
    pub input: Input,
}

impl FromStr for NamedInput {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (name, file) = text.split_once('=').ok_or("expected TASK=FILE")?;
        Ok(Self {
            name: name.to_owned(),
            input: OsString::from(file).into(),
        })
    }
}
