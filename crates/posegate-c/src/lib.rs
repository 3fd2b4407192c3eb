//! The C boundary: what `include/posegate.h` declares.
//!
//! C firmware links `libposegate_c.a` and sees plain structs, integers of fixed size and functions that
//! answer with a [`posegate_status`]. What each type and function is to a C program stands with it, since
//! these comments are the header's; the header is made from this crate and from
//! [`posegate::gate::Reason`] (`crates/posegate-peers/tests/c_header.rs`), so there is one list of reasons.
//!
//! - **Memory** is the caller's: nothing is allocated, nothing is global. What is more than plain numbers
//!   (a gate, a judge, a receiver) lives in storage that C declares and an `init` function takes into use.
//!   Storage that is zeroed, overwritten or moved is refused.
//! - **Errors** never permit: after an error every output is a denial. Null and misaligned pointers, numbers
//!   that are none of an enum's and lengths that cannot be are errors. Enums come in as integers.
//! - **Overlap**: every function reads all its inputs before it writes an output, so structs of numbers may
//!   share memory, as in a union. Storage shares memory with nothing: `POSEGATE_STATUS_OVERLAP`.
//! - **What cannot be checked** is the caller's promise: a pointer that is neither null nor misaligned
//!   points to what its type says, for the length that it was given with; storage is used by one
//!   context at a time; a table outlives the gate on it.
//!
//! This is the one library with unsafe code. Pointers are followed in `memory.rs` and nowhere else, but for
//! the gate, whose settings are in the same storage.
//!
//! # The archive
//! ```text
//! cargo build -p posegate-c --profile firmware --target thumbv7em-none-eabihf
//! ```
//! makes `target/thumbv7em-none-eabihf/firmware/libposegate_c.a`. On targets without an operating system it has a panic
//! handler of its own, since C has none; a Rust firmware links the package `posegate` instead. The handler calls a function that does not exist, so
//! a firmware into which a panic found its way does not link.
#![no_std]
#![allow(unsafe_code)]
#![deny(missing_docs)]
#![deny(clippy::undocumented_unsafe_blocks, clippy::missing_safety_doc)]
// Nothing can panic, no float arithmetic, nothing wraps by accident.
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
// The names are the header's.
#![allow(non_camel_case_types)]

// On a PC the archive has the panic handler of `std`.
#[cfg(not(any(target_os = "none", target_arch = "wasm32")))]
extern crate std;

pub use self::belief::*;
pub use self::gate::*;
pub use self::judge::*;
pub use self::permission::*;
pub use self::reason::*;
pub use self::report::*;
pub use self::settings::*;
pub use self::status::*;
pub use self::table::*;
pub use self::wire::*;

mod belief;
mod gate;
mod judge;
mod memory;
#[cfg(any(target_os = "none", target_arch = "wasm32"))]
mod panic;
mod permission;
mod reason;
mod report;
mod settings;
mod status;
mod table;
mod wire;
