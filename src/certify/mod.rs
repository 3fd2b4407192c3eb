//! Outward-rounded intervals: is this block of poses inside S?
//!
//! Every answer "yes" is a proof: each operation rounds outwards, angles and their functions are
//! enclosed, and no sample stands for what lies between samples.

pub(crate) use self::block::PartProver;
pub use self::block::{BOX_BORDER_M, BOX_BORDER_RAD, Block, Prover, goal_cos_sin};
pub use self::interval::Interval;
pub use self::lens::{Calibration, Image, LensError, Roi, View};
pub use self::slope::{Slope, sharp};

mod block;
mod interval;
mod lens;
mod optic;
mod slope;
