//! The gate: a state machine that opens an interlock after consecutive fresh permits, its reasons, and the
//! interlock.
//!
//! The gate is closed at first and after every error. [`Gate`] takes reports and keeps state between them. To decide
//! single estimates, for recordings and benches only, use [`crate::recordings`]. [`assumptions`] lists the gate's
//! assumptions, its checks and the faults that it cannot detect.
//!
//! ```
//! use posegate::gate::{Gate, Restart, Settings, Source};
//! use posegate::motion::MotionBounds;
//! use posegate::report::{FrameId, Report};
//! use posegate::set::{Aging, Trust};
//!
//! static SOURCES: [Source; 1] = [Source { frame: FrameId::of("map"), trust: Trust::FULL, aging: Aging::NONE, motion: MotionBounds::STANDS_STILL }];
//! # fn example(table: &'static [u8], task_digest: [u8; 32], now_ms: u32, report: &Report) -> bool {
//! let settings = Settings {
//!     task: "dock",
//!     task_digest,
//!     sources: &SOURCES,
//!     maximum_age_ms: 200,
//!     response_ms: 20,
//!     report_period_ms: 50,
//!     permit_hold_ms: 100,
//!     inhibit_hold_ms: 500,
//!     permits_in_a_row: 3,
//!     restart: Restart::Automatic,
//!     most_runs: 1_000,
//!     look_at: Some(7),
//! };
//! let mut gate = Gate::new(table, &settings, now_ms).expect("no parameter switches a check off");
//! gate.step(now_ms, report).permission.is_permit()
//! # }
//! ```

use crate::contain::{self, Cause, Decision, Margin};
use crate::pose::Pose;
use crate::set::{InputError, PoseSet};
use crate::table::{Table, TableError};

pub use self::clock::Clock;
pub use self::evidence::{Evidence, MOST_HYPOTHESES};
pub use self::interlock::{Interlock, InterlockFault, NoPin};
pub use self::machine::{Gate, Step};
pub use self::monitor::{Innovation, ModelStanding, Monitor};
pub use self::permission::{DENY, PERMIT, Permission};
pub use self::reason::{Advice, Reason};
pub use self::scrub::{Scrub, ScrubProgress};
pub use self::seal::Seal;
pub use self::self_test::self_test;
pub use self::settings::{InvalidParameter, Restart, Settings, Source, task_digest};
pub use self::state::State;

mod clock;
mod doubled;
mod elsewhere;
mod evidence;
mod interlock;
mod machine;
mod monitor;
mod permission;
mod reason;
mod scrub;
mod seal;
mod self_test;
mod settings;
mod standing;
mod state;

#[doc = include_str!("assumptions.md")]
pub mod assumptions {}

/// The gate's verdict on one estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub enum Verdict {
    /// Every pose of the pose-set lies in the success set.
    Permit {
        /// The factor by which the pose-set could grow and still be inside: at least 1.
        margin: Margin,
    },
    /// The pose-set is not proven to be inside.
    Deny {
        /// The first reason that applies.
        reason: Reason,
        /// The scale at which the pose-set would be inside, below 1. Only for [`Reason::NotContained`],
        /// [`Reason::PoseSetTooLarge`] and [`Reason::OutsideTable`].
        margin: Option<Margin>,
        /// For the same reasons: a pose of the pose-set that the table does not cover, in the world frame. As the set
        /// grows, this pose is the first to leave.
        worst_pose: Option<Pose>,
    },
}

impl Verdict {
    /// Returns a denial without a margin and without a worst pose.
    pub const fn deny(reason: Reason) -> Self {
        Self::Deny {
            reason,
            margin: None,
            worst_pose: None,
        }
    }

    /// Returns `true` if the verdict is a permit.
    #[must_use]
    pub const fn is_permit(&self) -> bool {
        matches!(self, Self::Permit { .. })
    }
}

/// Returns the verdict on a pose-set, with its margin and worst pose. For telemetry: the verdict opens no interlock, and
/// the age of the estimate is ignored.
pub fn judge(table: &Table<'_>, set: &PoseSet) -> Verdict {
    let examination = contain::examine(table, set);
    match examination.decision {
        Decision::Inside => Verdict::Permit {
            margin: examination.margin,
        },
        Decision::Outside(cause) => Verdict::Deny {
            reason: cause.into(),
            margin: Some(examination.margin),
            worst_pose: examination.worst_pose,
        },
    }
}

impl From<Cause> for Reason {
    fn from(cause: Cause) -> Self {
        match cause {
            Cause::TooLarge => Self::PoseSetTooLarge,
            Cause::OffTable => Self::OutsideTable,
            Cause::NotContained => Self::NotContained,
            Cause::TooCostly => Self::TooCostly,
        }
    }
}

impl From<TableError> for Reason {
    fn from(error: TableError) -> Self {
        match error {
            TableError::TooNew => Self::TableTooNew,
            TableError::NoCells => Self::PartMissing,
            _ => Self::TableDamaged,
        }
    }
}

impl From<InputError> for Reason {
    fn from(impossible: InputError) -> Self {
        match impossible {
            InputError::EstimateNotFinite => Self::EstimateNotFinite,
            InputError::EstimateOutOfRange => Self::EstimateOutOfRange,
            InputError::CovarianceNotFinite => Self::CovarianceNotFinite,
            InputError::CovarianceZero => Self::CovarianceZero,
            InputError::CovarianceNotSymmetric => Self::CovarianceNotSymmetric,
            InputError::CovarianceNotPositiveDefinite => Self::CovarianceNotPositiveDefinite,
            InputError::CovarianceTooLarge => Self::CovarianceTooLarge,
            InputError::BoundInvalid => Self::BoundInvalid,
            InputError::CovarianceUnknown => Self::CovarianceUnknown,
            InputError::OrientationInvalid => Self::OrientationInvalid,
            InputError::Tilted => Self::Tilted,
        }
    }
}
