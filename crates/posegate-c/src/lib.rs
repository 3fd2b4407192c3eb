//! The C boundary: the types and functions that `include/posegate.h` declares.
//!
//! C firmware links `libposegate_c.a` and uses plain structs, integers of fixed size and functions that return a
//! [`posegate_status`]. The doc comments of types and functions are written for C programs, because the header contains
//! them. The header is generated from this crate and from the core's types that C uses
//! (`crates/posegate-c/tests/c_header.rs`), so there is one list of reasons.
//!
//! - **Memory** belongs to the caller: there is no allocation and no global state. Objects that are more than plain
//!   numbers (a gate, a judge, a tracker, a sequencer, a receiver) live in storage that C declares and an `init` function initialises. Storage
//!   that is zeroed, overwritten or moved is refused.
//! - **Errors** never permit: after an error every output is a denial. Null and misaligned pointers, numbers outside of
//!   an enum and impossible lengths are errors. Enums are passed as integers.
//! - **Overlap**: every function reads all its inputs before it writes an output, so structs of numbers may share
//!   memory, as in a union. Storage shares memory with nothing: `POSEGATE_STATUS_OVERLAP`.
//! - **What cannot be checked** is the caller's promise. A pointer that is neither null nor misaligned is valid for
//!   its type and the given length. Storage is used by one context at a time. A table outlives the gate on it.
//!
//! This is the only library with unsafe code. Pointers are dereferenced only in `memory.rs` and `call.rs`, and in the gate, whose
//! settings are in the same storage. `call.rs` has the order of reads and writes of most calls; the others state
//! theirs.
//!
//! # The archive
//! ```text
//! cargo build -p posegate-c --profile firmware --target thumbv7em-none-eabihf
//! ```
//! makes `target/thumbv7em-none-eabihf/firmware/libposegate_c.a`. On targets without an operating system it has its own
//! panic handler, since C has none. A Rust firmware links the package `posegate` instead. The handler calls a function
//! that does not exist, so a firmware with a reachable panic does not link.
#![no_std]
#![allow(unsafe_code)]
#![deny(missing_docs)]
#![deny(clippy::undocumented_unsafe_blocks, clippy::missing_safety_doc)]
// No panic, no float arithmetic, no accidental wrapping.
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
// Only a gate uses these.
#![cfg_attr(target_arch = "wasm32", allow(dead_code))]
// The names are those of the header.
#![allow(non_camel_case_types)]

// On a PC the archive uses the panic handler of `std`.
#[cfg(not(any(target_os = "none", target_arch = "wasm32")))]
extern crate std;

// A page in a browser evaluates single estimates and drives nothing: it has no gate.
pub use self::{
    belief::*, judge::*, permission::*, reason::*, report::*, status::*, table::*, wire::*,
};
#[cfg(not(target_arch = "wasm32"))]
pub use self::{clock::*, evidence::*, gate::*, monitor::*, sequencer::*, settings::*, tracker::*};

mod belief;
mod call;
#[cfg(not(target_arch = "wasm32"))]
mod clock;
#[cfg(not(target_arch = "wasm32"))]
mod evidence;
#[cfg(not(target_arch = "wasm32"))]
mod gate;
mod judge;
mod memory;
#[cfg(not(target_arch = "wasm32"))]
mod monitor;
#[cfg(any(target_os = "none", target_arch = "wasm32"))]
mod panic;
mod permission;
mod reason;
mod report;
#[cfg(not(target_arch = "wasm32"))]
mod sequencer;
#[cfg(not(target_arch = "wasm32"))]
mod settings;
mod status;
mod table;
#[cfg(not(target_arch = "wasm32"))]
mod tracker;
mod wire;
