//! What the fuzz targets share: numbers from an input, real tables, and what must hold.

pub mod input;
pub mod judged;
pub mod layout;
pub mod mutation;
pub mod sound;
pub mod tables;
