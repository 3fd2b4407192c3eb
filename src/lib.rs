//! Whether a robot is localized well enough for its task.
//!
//! Without features this is the core: `no_std`, no heap, no float where it decides. A controller begins with [`gate`]; a desk, in
//! any language, with the command line `posegate`, and in Rust with the room `site`.
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` | the desk side: success sets, tables and their proofs, site files, plans, places of tags, learning, replay, pictures |
//! | `cli` | the command line `posegate`, and `std` |
//! | `defmt` | `defmt::Format` on every public type of the core |
//! | `ffi` | the C boundary, `include/posegate.h` |
//! | `panic-handler` | the panic handler of `libposegate.a`, for C firmware; a Rust firmware has its own |
//! | `firmware` | nothing for users: the project's own Cortex-M examples |
#![no_std]
#![deny(unsafe_code)]
#![deny(missing_docs)]
// The wall around the core: nothing that can panic, no float arithmetic, no operator that can wrap
// or overflow unnamed. Desk rooms are let through one by one below.
#![cfg_attr(
    not(test),
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

#[cfg(any(feature = "std", test))]
extern crate std;

/// How many rounds a test goes: all, or the few that an interpreter has time for (`./ci.sh miri`). What
/// only many rounds show is asked of all.
#[cfg(test)]
pub(crate) const fn rounds(all: u32, interpreted: u32) -> u32 {
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

#[cfg(feature = "ffi")]
pub mod ffi;

// ------ std line: nothing above may name anything below ------

#[cfg(feature = "std")]
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
pub mod input;

#[cfg(feature = "std")]
pub mod printable;

#[cfg(feature = "std")]
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
pub mod excerpt;

#[cfg(feature = "std")]
#[allow(clippy::arithmetic_side_effects)]
pub mod files;

#[cfg(feature = "std")]
pub mod guard;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod confidence;

#[cfg(feature = "std")]
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
pub mod seal;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod shape;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod certify;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod bake;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod verify;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod learn;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod place;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod log;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod site;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod plan;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod cover;

#[cfg(feature = "std")]
#[allow(clippy::arithmetic_side_effects, clippy::indexing_slicing)]
pub mod fleet;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod draw;

#[cfg(feature = "std")]
#[allow(
    clippy::arithmetic_side_effects,
    clippy::float_arithmetic,
    clippy::indexing_slicing
)]
pub mod page;
