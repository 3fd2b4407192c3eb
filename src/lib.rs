//! Whether a robot is localized well enough for its task.
#![no_std]
#![deny(unsafe_code)]
#![deny(missing_docs)]

#[cfg(any(feature = "std", test))]
extern crate std;

pub mod num;

pub mod pose;

pub mod set;

pub mod table;

pub mod contain;

pub mod gate;

pub mod wire;

// ------ std line: nothing above may name anything below ------

#[cfg(feature = "std")]
pub mod confidence;

#[cfg(feature = "std")]
pub mod shape;

#[cfg(feature = "std")]
pub mod certify;

#[cfg(feature = "std")]
pub mod bake;

#[cfg(feature = "std")]
pub mod verify;

#[cfg(feature = "std")]
pub mod log;

#[cfg(feature = "std")]
pub mod site;

#[cfg(feature = "std")]
pub mod draw;
