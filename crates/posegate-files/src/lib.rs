//! Files of the tools of Posegate: read within limits, printed safely, written as a whole or not at all.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod input;

pub mod sheet;

pub mod printable;

pub mod excerpt;

pub mod files;

pub mod guard;
