//! A self-test with known answers: does this controller still compute correctly?

use super::Reason;
use crate::contain::{self, Cause, Decision, second};
use crate::report::{Heading, PoseEstimate};
use crate::set::{CrossTerms, Inflation, InputError, SplitWeight, Trust, Uncertainty};
use crate::table::Table;

/// A small proven table with both layouts and with borders of every kind: image edges, distance,
/// obliqueness and a turned goal (`crates/posegate-host/tests/golden_tables.rs` makes it).
static TABLE: &[u8] = include_bytes!("self_test.posegate");

/// An estimate and its known answer. Common values are shared, because this takes flash in every firmware.
struct KnownAnswer {
    /// x and y in metres, and the heading in radians unless `quaternion` states it.
    at: [f64; 3],
    quaternion: Option<&'static [f64; 4]>,
    spread: &'static Uncertainty,
    trust: &'static Trust,
    answer: Result<Decision, InputError>,
}

impl KnownAnswer {
    fn belief(&self) -> PoseEstimate {
        let [x_m, y_m, yaw] = self.at;
        PoseEstimate {
            x_m,
            y_m,
            heading: match self.quaternion {
                Some(quaternion) => Heading::Quaternion(*quaternion),
                None => Heading::Radians(yaw),
            },
            spread: Some(*self.spread),
        }
    }
}

/// Decides known pose-sets on a built-in table by both evaluations. A faulty core, or a flipped bit in
/// code that every decision executes, gives another answer.
///
/// Cost: about ten decisions and a checksum of 1 kB. Runs when a gate is made; a main loop may call it
/// again.
///
/// # Errors
/// [`Reason::SelfTestFailed`] if an answer is wrong.
pub fn self_test() -> Result<(), Reason> {
    let table = Table::parse(TABLE).map_err(|_| Reason::SelfTestFailed)?;
    for known in &KNOWN {
        let (belief, trust) = (known.belief(), *known.trust);
        let set = belief.pose_set(table.radius_squared(), trust);
        let answer = set.map(|set| contain::decide(&table, &set));
        // The second evaluation is defined for valid estimates only.
        let opinion = second::opinion(TABLE, &belief, trust);
        let agrees = answer.is_err() || (opinion == second::INSIDE) == (answer == INSIDE);
        if answer != known.answer || !agrees {
            return Err(Reason::SelfTestFailed);
        }
    }
    Ok(())
}

const INSIDE: Result<Decision, InputError> = Ok(Decision::Inside);
const TOO_LARGE: Result<Decision, InputError> = Ok(Decision::Outside(Cause::TooLarge));
const OUTSIDE: Result<Decision, InputError> = Ok(Decision::Outside(Cause::NotContained));

/// Returns the covariance of the entries xx, xy, x-yaw, yy, y-yaw, yaw-yaw.
const fn covariance([xx, xy, xt, yy, yt, tt]: [f64; 6]) -> Uncertainty {
    Uncertainty::Gaussian([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])
}

const fn bounded(translation_m: f64) -> Uncertainty {
    Uncertainty::Bounded {
        translation_m,
        yaw_rad: 0.05,
    }
}

static LARGE: Uncertainty = covariance([0.04, 0.012, 0.000_35, 0.04, 0.000_7, 0.000_076]);
static SMALL: Uncertainty = covariance([1e-4, 3e-5, 7e-6, 1e-4, 1.4e-5, 1.2e-5]);
static ZERO: Uncertainty = covariance([0.0; 6]);
static INDEFINITE: Uncertainty = covariance([1e-4, 1e-4, 0.0, 1e-4, 0.0, 1e-4]);
static HALF_A_METRE: Uncertainty = bounded(0.5);
static WIDER_THAN_THE_TABLE: Uncertainty = bounded(1.5);
static A_DECIMETRE: Uncertainty = bounded(0.1);
static AHEAD: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
static BACKWARDS: [f64; 4] = [0.0, 0.0, 1.0, 0.0];
static FULL: Trust = Trust::FULL;
static DOUBTED: Trust = Trust {
    inflation: match Inflation::from_q16(3 << 16) {
        Some(inflation) => inflation,
        None => Inflation::NONE,
    },
    cross_terms: CrossTerms::YawUnknown(SplitWeight::HALF),
};

const fn known(
    at: [f64; 3],
    spread: &'static Uncertainty,
    trust: &'static Trust,
    answer: Result<Decision, InputError>,
) -> KnownAnswer {
    KnownAnswer {
        at,
        quaternion: None,
        spread,
        trust,
        answer,
    }
}

/// As [`known`], in the middle of the set, with the heading as a quaternion.
const fn facing(
    quaternion: &'static [f64; 4],
    spread: &'static Uncertainty,
    answer: Result<Decision, InputError>,
) -> KnownAnswer {
    KnownAnswer {
        at: [0.0; 3],
        quaternion: Some(quaternion),
        spread,
        trust: &FULL,
        answer,
    }
}

/// Estimates in the middle of the set, and pairs on either side of its borders: distance, obliqueness,
/// image edges.
static KNOWN: [KnownAnswer; 19] = [
    known([0.1, 0.0, 0.0], &LARGE, &FULL, INSIDE),
    known([0.1, 0.0, 0.0], &LARGE, &DOUBTED, TOO_LARGE),
    known([0.1, 0.0, 0.0], &SMALL, &DOUBTED, INSIDE),
    known([-1.6, -0.93, -0.12], &SMALL, &FULL, INSIDE),
    known([-1.6, -0.95, -0.12], &SMALL, &FULL, OUTSIDE),
    known([0.0, 1.03, 0.0], &SMALL, &FULL, INSIDE),
    known([0.0, 1.05, 0.0], &SMALL, &FULL, OUTSIDE),
    known([1.8, -0.81, 0.0], &SMALL, &FULL, INSIDE),
    known([1.8, -0.83, 0.0], &SMALL, &FULL, OUTSIDE),
    known([1.8, 0.18, 0.25], &SMALL, &FULL, INSIDE),
    known([1.8, 0.20, 0.25], &SMALL, &FULL, OUTSIDE),
    known([1.0, -0.79, -0.12], &SMALL, &FULL, INSIDE),
    known([1.0, -0.81, -0.12], &SMALL, &FULL, OUTSIDE),
    facing(&AHEAD, &HALF_A_METRE, INSIDE),
    facing(&AHEAD, &WIDER_THAN_THE_TABLE, TOO_LARGE),
    facing(
        &BACKWARDS,
        &A_DECIMETRE,
        Ok(Decision::Outside(Cause::OffTable)),
    ),
    known(
        [30.0, 0.0, 0.0],
        &SMALL,
        &FULL,
        Ok(Decision::Outside(Cause::OffTable)),
    ),
    known(
        [0.0, 0.0, 0.0],
        &ZERO,
        &FULL,
        Err(InputError::CovarianceZero),
    ),
    known(
        [0.0, 0.0, 0.0],
        &INDEFINITE,
        &FULL,
        Err(InputError::CovarianceNotPositiveDefinite),
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_known_answers_are_given() {
        let table = Table::parse(TABLE).unwrap();
        for (index, known) in KNOWN.iter().enumerate() {
            let (belief, trust) = (known.belief(), *known.trust);
            let set = belief.pose_set(table.radius_squared(), trust);
            let confirmed = second::opinion(TABLE, &belief, trust) == second::INSIDE;
            assert!(
                set.is_err() || confirmed == (known.answer == INSIDE),
                "{index}"
            );
            let found = set.as_ref().map(|set| contain::examine(&table, set));
            let answer = set.map(|set| contain::decide(&table, &set));
            assert_eq!(answer, known.answer, "{index}: {found:?}");
        }
        assert_eq!(self_test(), Ok(()));
        // As many answers one way as the other, and both layouts are walked.
        let inside: Vec<_> = KNOWN.iter().filter(|k| k.answer == INSIDE).collect();
        assert!(inside.len() >= 5 && table.grid().is_some() && table.facets().is_some());
    }
}
