//! Files of the tools of Posegate: read up to a stated size, printed safely, written atomically.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod input;

pub mod sheet;

pub mod printable;

pub mod excerpt;

pub mod files;

pub mod guard;
