//! Lenses: how far a lens is one-to-one, and which normalised points are certain to be in the image. (The
//! proof is in the documentation of [`crate::certify`].)

mod error;
mod field;
mod inner;
mod outline;
mod proof;
mod view;

pub use self::error::LensError;
pub use self::view::{Calibration, CertifiedCamera, Image, Roi};
