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
