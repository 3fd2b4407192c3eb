//! Shared by the fuzz targets: numbers from an input, real tables, and the properties to check.

pub mod input;
pub mod judged;
pub mod layout;
pub mod mutation;
pub mod sound;
pub mod tables;
