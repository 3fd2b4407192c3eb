//! Beliefs as sources send them, whose pose-set at a table's radius is given.

use crate::oracle::{Pose, PoseSet, Rng, chi2_quantile_3dof};
use posegate::report::{Heading, PoseEstimate};
use posegate::set::{CrossTerms, Growth, Inflation, SplitWeight, Trust, Uncertainty};
use posegate::table::Table;

/// The input of both evaluations.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub belief: PoseEstimate,
    pub trust: Trust,
    pub movement: Growth,
}

/// The form in which a source reports its estimate.
#[derive(Clone, Copy, Debug)]
pub struct ReportForm {
    trust: Trust,
    /// 0: radians, 1: with turns, 2: roll, pitch and yaw, 3: a quaternion of a level robot, 4: a tilted one.
    heading: usize,
    tilt: [f64; 2],
    length: f64,
    /// Growth by a movement, as shares of the set's size and of its turn.
    moved: [f64; 2],
    /// The share of the growth that may be across the robot's heading.
    aside: f64,
}

impl ReportForm {
    /// Headings in radians, without inflation.
    pub fn honest() -> Self {
        Self {
            trust: Trust::FULL,
            heading: 0,
            tilt: [0.0; 2],
            length: 1.0,
            moved: [0.0; 2],
            aside: 1.0,
        }
    }

    /// Returns the belief from which the table's radius and the trust make the given set (or a larger one, if terms
    /// are unknown).
    pub fn case(&self, table: &Table<'_>, [x_m, y_m, yaw]: Pose, set: &PoseSet) -> Case {
        let inflation = f64::from(self.trust.inflation.q16()) / 65536.0;
        let spread = match set {
            PoseSet::Gaussian { cov, r2 } => {
                let radius = f64::from(table.radius_squared().q16()) / 65536.0;
                Uncertainty::Gaussian(cov.map(|row| row.map(|v| v * r2 / radius / inflation)))
            }
            PoseSet::Bounded { translation, yaw } => Uncertainty::Bounded {
                translation_m: translation / inflation.sqrt(),
                yaw_rad: yaw / inflation.sqrt(),
            },
        };
        let heading = match self.heading {
            0 => Heading::Radians(yaw),
            1 => Heading::Radians(yaw + 40.0 * std::f64::consts::TAU),
            2 => Heading::RollPitchYaw([self.tilt[0], self.tilt[1], yaw]),
            3 => Heading::Quaternion(quaternion([0.0; 2], yaw).map(|v| v * self.length)),
            _ => Heading::Quaternion(quaternion(self.tilt, yaw).map(|v| -v * self.length)),
        };
        Case {
            belief: PoseEstimate {
                x_m,
                y_m,
                heading,
                spread: Some(spread),
            },
            trust: self.trust,
            movement: self.movement(set),
        }
    }

    fn movement(&self, set: &PoseSet) -> Growth {
        let [length, turn] = match set {
            PoseSet::Gaussian { cov, r2 } => [
                (r2 * (cov[0][0] + cov[1][1])).sqrt(),
                (r2 * cov[2][2]).sqrt(),
            ],
            PoseSet::Bounded { translation, yaw } => [*translation, *yaw],
        };
        let [by_length, by_turn] = self.moved;
        let by = Growth::of(length * by_length, turn * by_turn).unwrap();
        let [translation, yaw] = [by.translation_um(), by.yaw_q24()].map(i32::unsigned_abs);
        let aside = (f64::from(translation) * self.aside) as u32;
        Growth::along(translation, aside, yaw)
    }
}

fn quaternion([roll, pitch]: [f64; 2], yaw: f64) -> [f64; 4] {
    let turn = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    [turn.i, turn.j, turn.k, turn.w]
}

pub fn drawn(rng: &mut Rng) -> ReportForm {
    let inflation = if rng.chance(0.5) {
        Inflation::NONE
    } else {
        Inflation::new(rng.log_within(1.0, 4096.0)).unwrap()
    };
    let share = SplitWeight::from_q8(1 + rng.below(255) as u8).unwrap();
    let cross_terms = match rng.below(6) {
        0 => CrossTerms::YawUnknown(share),
        1 => CrossTerms::AllUnknown(share),
        _ => CrossTerms::Filled,
    };
    ReportForm {
        trust: Trust {
            inflation,
            cross_terms,
        },
        heading: rng.below(5),
        tilt: [rng.within(-0.06, 0.06), rng.within(-0.06, 0.06)],
        length: 1.0 + rng.within(-1e-5, 1e-5),
        moved: match rng.below(4) {
            0 => [rng.log_within(1e-3, 30.0), 0.0],
            1 => [rng.log_within(1e-3, 30.0), rng.log_within(1e-3, 30.0)],
            _ => [0.0; 2],
        },
        aside: if rng.chance(0.3) {
            0.0
        } else {
            rng.within(0.0, 1.1)
        },
    }
}

/// Moves a pose by micrometres and units of heading, so that it is rounded differently.
pub fn shaken(rng: &mut Rng, [x, y, yaw]: Pose) -> Pose {
    let mut by = |most: f64| rng.within(-most, most);
    [x + by(2e-6), y + by(2e-6), yaw + by(4e-9)]
}

/// Returns a set of any kind and size.
pub fn plain(rng: &mut Rng) -> PoseSet {
    if rng.chance(0.3) {
        return PoseSet::Bounded {
            translation: rng.log_within(1e-6, 1.0),
            yaw: rng.log_within(1e-6, 0.6),
        };
    }
    extreme(rng)
}

/// Returns a Gaussian set of extreme shape: ratios of deviations up to 10^6, correlations up to 0.99999,
/// sizes from a micrometre on.
pub fn extreme(rng: &mut Rng) -> PoseSet {
    let size = rng.log_within(1e-6, 1.0);
    let ratio = |rng: &mut Rng| {
        if rng.chance(0.5) {
            1.0
        } else {
            rng.log_within(1e-6, 1.0)
        }
    };
    let deviation = [
        size * ratio(rng),
        size * ratio(rng),
        size * ratio(rng) * rng.log_within(0.1, 10.0),
    ];
    // Unit rows that are nearly equal: their products are the correlations.
    let near = rng.log_within(3e-3, 3.0);
    let common = [0; 3].map(|_| rng.within(-1.0, 1.0));
    let rows = [0; 3].map(|_| {
        let sign = if rng.chance(0.5) { 1.0 } else { -1.0 };
        let row: Vec<f64> = common
            .iter()
            .map(|v| sign * v + near * rng.within(-1.0, 1.0))
            .collect();
        let length = row.iter().map(|v| v * v).sum::<f64>().sqrt();
        [row[0] / length, row[1] / length, row[2] / length]
    });
    let mut cov = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let between: f64 = rows[i].iter().zip(rows[j]).map(|(a, b)| a * b).sum();
            cov[i][j] = deviation[i] * deviation[j] * if i == j { 1.0 } else { between };
        }
    }
    let r2 = chi2_quantile_3dof([0.9, 0.99][rng.below(2)]);
    PoseSet::Gaussian { cov, r2 }
}
