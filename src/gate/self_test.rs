//! A self-test with known answers: does this controller still compute correctly?

use super::Reason;
use crate::contain::{self, Cause, Decision, second};
use crate::report::{Heading, PoseEstimate};
use crate::set::{CrossTerms, Inflation, InputError, SplitWeight, Trust, Uncertainty};
use crate::table::Table;
use crate::table::parts;

/// A small proven table of facets with borders of every kind: image edges, distance, obliqueness and a turned goal
/// (`crates/posegate-site/tests/golden_tables.rs` makes it).
static FACETS: &[u8] = include_bytes!("self_test.posegate").as_slice();
/// The same success set in cells.
static CELLS: &[u8] = include_bytes!("self_test_grid.posegate").as_slice();

/// An estimate and its known answer. Common values are shared, because this takes flash in every firmware.
struct KnownAnswer {
    /// x and y in metres, and the heading in radians unless `quaternion` states it.
    at: [f64; 3],
    quaternion: Option<&'static [f64; 4]>,
    /// The entries xx, xy, x-yaw, yy, y-yaw, yaw-yaw of a covariance, or the extents of a cylinder.
    spread: &'static [f64],
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
            spread: match *self.spread {
                [xx, xy, xt, yy, yt, tt] => Some(Uncertainty::Gaussian([
                    [xx, xy, xt],
                    [xy, yy, yt],
                    [xt, yt, tt],
                ])),
                [translation_m, yaw_rad] => Some(Uncertainty::Bounded {
                    translation_m,
                    yaw_rad,
                }),
                _ => None,
            },
        }
    }

    /// Returns `true` if both evaluations give the known answer on a table.
    #[inline(never)]
    fn is_given(&self, bytes: &[u8], table: &Table<'_>) -> bool {
        let (belief, trust) = (self.belief(), *self.trust);
        let set = belief.pose_set(table.radius_squared(), trust);
        let answer = set.map(|set| contain::decide(table, &set));
        // The second evaluation is defined for valid estimates only.
        let opinion = second::opinion(bytes, &belief, trust);
        let agrees = answer.is_err() || (opinion == second::INSIDE) == (answer == INSIDE);
        answer == self.answer && agrees
    }
}

/// Decides known pose-sets on built-in tables by both evaluations. A faulty core, or a flipped bit in
/// code that every decision executes, gives another answer.
///
/// Cost: both evaluations of 16 estimates, 155,322 instructions on a Cortex-M4F (`./ci.sh budgets`). Runs when a gate is made; a main
/// loop may call it again.
///
/// # Errors
/// [`Reason::SelfTestFailed`] if an answer is wrong.
pub fn self_test() -> Result<(), Reason> {
    let facets = answers_are_given(FACETS, &BORDERS, &KNOWN);
    let cells = !parts::CELLS || answers_are_given(CELLS, &BORDERS_OF_CELLS, &[]);
    if facets && cells {
        Ok(())
    } else {
        Err(Reason::SelfTestFailed)
    }
}

fn answers_are_given(bytes: &[u8], borders: &[[f64; 4]], others: &[KnownAnswer]) -> bool {
    let Ok(table) = Table::parse(bytes) else {
        return false;
    };
    others.iter().all(|known| known.is_given(bytes, &table))
        && borders.iter().all(|[x, yaw, inside, outside]| {
            [(inside, INSIDE), (outside, OUTSIDE)]
                .into_iter()
                .all(|(y, answer)| {
                    known([*x, *y, *yaw], &SMALL, &FULL, answer).is_given(bytes, &table)
                })
        })
}

const INSIDE: Result<Decision, InputError> = Ok(Decision::Inside);
const TOO_LARGE: Result<Decision, InputError> = Ok(Decision::Outside(Cause::TooLarge));
const OUTSIDE: Result<Decision, InputError> = Ok(Decision::Outside(Cause::NotContained));

static LARGE: [f64; 6] = [0.04, 0.012, 0.000_35, 0.04, 0.000_7, 0.000_076];
static SMALL: [f64; 6] = [1e-4, 3e-5, 7e-6, 1e-4, 1.4e-5, 1.2e-5];
static ZERO: [f64; 6] = [0.0; 6];
static INDEFINITE: [f64; 6] = [1e-4, 1e-4, 0.0, 1e-4, 0.0, 1e-4];
static HALF_A_METRE: [f64; 2] = [0.5, 0.05];
static WIDER_THAN_THE_TABLE: [f64; 2] = [1.5, 0.05];
static A_DECIMETRE: [f64; 2] = [0.1, 0.05];
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
    spread: &'static [f64],
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
    spread: &'static [f64],
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

/// Pairs of estimates on either side of the set's borders (one for each kind of frame): x, yaw, y inside, y outside.
static BORDERS: [[f64; 4]; 3] = [
    [-1.6, -0.12, -0.78, -0.82],
    [0.0, 0.0, 1.03, 1.05],
    [1.8, 0.25, 0.18, 0.20],
];

/// As [`BORDERS`], of the cells: the near border.
static BORDERS_OF_CELLS: [[f64; 4]; 1] = [[0.0, 0.0, 0.9, 1.05]];

/// Other estimates: in the middle of the set, far from it, too wide, and invalid.
static KNOWN: [KnownAnswer; 8] = [
    known([0.1, 0.0, 0.0], &LARGE, &FULL, INSIDE),
    known([0.1, 0.0, 0.0], &LARGE, &DOUBTED, TOO_LARGE),
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

    /// Returns the known answers of a table.
    fn all(borders: &[[f64; 4]], others: &[KnownAnswer]) -> Vec<KnownAnswer> {
        let borders = borders.iter().flat_map(|[x, yaw, inside, outside]| {
            [(inside, INSIDE), (outside, OUTSIDE)]
                .map(|(y, answer)| known([*x, *y, *yaw], &SMALL, &FULL, answer))
        });
        let others = others.iter().map(|other| KnownAnswer { ..*other });
        others.chain(borders).collect()
    }

    #[test]
    fn the_known_answers_are_given() {
        let facets = all(&BORDERS, &KNOWN);
        let cells = all(&BORDERS_OF_CELLS, &[]);
        assert_eq!((facets.len(), cells.len()), (14, 2));
        for (bytes, all) in [(FACETS, facets), (CELLS, cells)] {
            let table = Table::parse(bytes).unwrap();
            for (index, known) in all.iter().enumerate() {
                let (belief, trust) = (known.belief(), *known.trust);
                let set = belief.pose_set(table.radius_squared(), trust);
                let confirmed = second::opinion(bytes, &belief, trust) == second::INSIDE;
                assert!(
                    set.is_err() || confirmed == (known.answer == INSIDE),
                    "{index}"
                );
                let found = set.as_ref().map(|set| contain::examine(&table, set));
                let answer = set.map(|set| contain::decide(&table, &set));
                assert_eq!(answer, known.answer, "{index}: {found:?}");
                assert!(known.is_given(bytes, &table), "{index}");
            }
            let inside = all.iter().filter(|known| known.answer == INSIDE).count();
            assert!(inside * 3 >= all.len() && inside < all.len());
            assert_eq!(table.grid().is_some(), bytes == CELLS);
        }
        assert_eq!(self_test(), Ok(()));
    }

    #[test]
    fn another_answer_is_found() {
        let table = Table::parse(FACETS).unwrap();
        for known in all(&BORDERS, &KNOWN) {
            for answer in [INSIDE, OUTSIDE, TOO_LARGE, Err(InputError::Tilted)] {
                let other = KnownAnswer { answer, ..known };
                assert_eq!(other.is_given(FACETS, &table), answer == known.answer);
            }
        }
        let mut damaged = FACETS.to_vec();
        damaged[200] ^= 1;
        assert!(!answers_are_given(&damaged, &BORDERS, &KNOWN));
    }
}
