//! Decides whether a robot is localized well enough for its task.
//!
//! Without features this is the core for a motion controller: `no_std`, no heap, no float on the decision path. Start with
//! [`gate::Gate`].
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` | lookup tables on a PC: success sets (`shape`), tables (`bake`) and their proofs (`verify`) |
//! | `defmt` | `defmt::Format` on every public type of the core |
//! | `firmware` | nothing for users: the project's own Cortex-M examples |
//!
//! Related packages: `posegate-host` (site files, plans, placement of tags, learning, replay), `posegate-cli` (the program
//! `posegate`) and `posegate-c` (the C boundary, `include/posegate.h`).
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

pub mod num;

pub mod pose;

pub mod set;

pub mod report;

pub mod table;

pub mod contain;

pub mod sight;

pub mod task;

pub mod chain;

pub mod gate;

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
