//! Lenses: how far one is one-to-one, and which normalised points surely fall into the image. (The argument is
//! in the head of the module.)

mod error;
mod field;
mod inner;
mod outline;
mod proof;
mod view;

pub use self::error::LensError;
pub use self::view::{Calibration, CertifiedCamera, Image, Roi};
