//! Code that the targets of fault injection share.
#![allow(dead_code)] // Each target uses a part.

pub mod markers;
pub mod schedule;
