//! The C boundary (feature `ffi`): what `include/posegate.h` declares.
//!
//! C firmware links `libposegate.a` and sees plain structs, integers of fixed size and functions that
//! answer with a [`posegate_status`]. What each type and function is to a C program stands with it, since
//! these comments are the header's; the header is made from this room and from
//! [`crate::gate::Reason`] (`tests/c_header.rs`), so there is one list of reasons.
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
//! This is the one room with unsafe code. Pointers are followed in `memory.rs` and nowhere else, but for
//! the gate, whose settings stand in the same storage.
//!
//! # The archive
//! ```text
//! cargo rustc --lib --crate-type staticlib --profile firmware --target thumbv7em-none-eabihf --features ffi,panic-handler
//! ```
//! makes `target/thumbv7em-none-eabihf/firmware/libposegate.a`. Feature `panic-handler` is for this
//! archive alone (a Rust firmware has its own handler). The handler calls a function that does not exist, so
//! a firmware into which a panic found its way does not link.
#![allow(unsafe_code)]
#![deny(clippy::undocumented_unsafe_blocks)]
// The names are the header's.
#![allow(non_camel_case_types)]

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
#[cfg(all(
    feature = "panic-handler",
    any(target_os = "none", target_arch = "wasm32")
))]
mod panic;
mod permission;
mod reason;
mod report;
mod settings;
mod status;
mod table;
mod wire;
