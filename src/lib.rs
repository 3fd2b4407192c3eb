//! On these pages: **firmware** starts with [`gate::Gate`], **programs on a PC** start with [`Site`] of `posegate-site`.
//!
// Overrides links of the README on these pages: of two definitions of a link the first counts.
//! [`Site`]: ../posegate_site/struct.Site.html
//! [assumptions]: crate::gate::assumptions
//! [estimates]: #pages-and-examples
//! [recorded]: #pages-and-examples
//! [docking_gate]: #pages-and-examples
//! [controller]: #pages-and-examples
//! [for-c]: #pages-and-examples
//! [updating]: #pages-and-examples
//! [for-ros]: #pages-and-examples
//! [for-python]: #pages-and-examples
//! [for-sites]: #pages-and-examples
//! [host]: #pages-and-examples
//! [examples]: #pages-and-examples
//! [measured]: #pages-and-examples
//! [architecture]: #pages-and-examples
//! [contributing]: #pages-and-examples
//! [changelog]: #pages-and-examples
#![doc = include_str!("../docs/first-picture.uri")]
//!
#![doc = include_str!("../README.md")]
//!
//! # Features
//!
//! | feature | adds |
//! |---|---|
//! | `cells` | on by default: decisions on the cells of a table |
//! | `headings` | on by default: facets that turn with the robot are decided heading by heading: wide turns, and tight decisions |
//! | `sight` | on by default: the predicted view of a tag from a pose, by the tag's table |
//! | `unions` | on by default: pose-sets that only several pieces contain together, such as a lane and a bay |
//! | `std` | lookup tables on a PC: success sets (`shape`), tables (`bake`) and their proofs (`verify`) |
//! | `defmt` | `defmt::Format` on every public type of the core |
//! | `firmware` | nothing for users: the project's own Cortex-M examples |
//!
//! Without `std` this is the core for a motion controller: `no_std`, no heap, no float on the decision path. Without one of the features that
//! are on by default firmware is smaller, and the gate denies more, never less (`./ci.sh costs`).
//!
//! Related packages: `posegate-site` (site files), `-plan`, `-place`, `-learn`, `-replay` and `-show` for the tools of the same names, `posegate-cli` (the program
//! `posegate`) and `posegate-c` (the C boundary, `include/posegate.h`).
//!
//! # Pages and examples
//!
//! The pages (`docs/`, `ARCHITECTURE.md`, `CONTRIBUTING.md`, `CHANGELOG.md`) and the examples (`examples/`) are files of this
//! package, at the paths that the README gives.
#![cfg_attr(not(any(feature = "std", test)), no_std)]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
// The core must not panic, compute with floats or wrap a number by accident. Every build without `std` checks this for
// the whole core. The modules behind feature `std` are exempt.
#![cfg_attr(
    not(any(feature = "std", test)),
    deny(
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::float_arithmetic,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::unreachable,
        clippy::unwrap_used
    )
)]

/// Returns the number of rounds of a test: `all`, or `interpreted` under the interpreter Miri, which is slower
/// (`./ci.sh miri`).
#[cfg(test)]
pub(crate) const fn test_iterations(all: u32, interpreted: u32) -> u32 {
    if cfg!(miri) { interpreted } else { all }
}

/// Returns the number of rounds of a test that takes seconds: `all` in the deep job (`./ci.sh deep` sets `POSEGATE_DEEP`), a fifth of
/// them in the fast suite, and `interpreted` under Miri.
#[cfg(test)]
pub(crate) fn test_share(all: u32, interpreted: u32) -> u32 {
    let is_deep = std::env::var_os("POSEGATE_DEEP").is_some();
    test_iterations(if is_deep { all } else { all / 5 }, interpreted)
}

#[cfg(test)]
mod error_budget;

/// Implements `Display`, and `Error` unless `no error` is given, for an enum whose every variant has a constant text. Firmware that formats no error
/// does not link it.
macro_rules! messages {
    (no error $name:ident { $($variant:ident => $message:literal,)+ }) => {
        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(match self {
                    $(Self::$variant => $message,)+
                })
            }
        }
    };
    ($name:ident { $($variant:ident => $message:literal,)+ }) => {
        messages!(no error $name { $($variant => $message,)+ });

        impl core::error::Error for $name {}
    };
}

pub mod num;

pub mod pose;

pub mod set;

pub mod motion;

pub mod report;

pub mod table;

pub mod contain;

pub mod sight;

pub mod task;

pub mod chain;

pub mod gate;

pub mod track;

pub mod recordings;

pub mod sequencer;

pub mod wire;

// ------ std line: nothing above names anything below ------

#[cfg(feature = "std")]
pub mod confidence;

#[cfg(feature = "std")]
pub mod seal;

#[cfg(feature = "std")]
pub mod shape;

#[cfg(feature = "std")]
pub mod certify;

#[cfg(feature = "std")]
pub mod bake;

#[cfg(feature = "std")]
pub mod verify;
