//! Random layouts and sets.

use super::cases::{Case, NORMAL};
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Extent, Growth, SqrtFactor};
use crate::table::{Axes, Facet};
use core::f64::consts::TAU;

/// The generator SplitMix64.
pub(in crate::contain) struct Random(pub(in crate::contain) u64);

impl Random {
    pub(in crate::contain) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number in `[0, 1)`.
    pub(in crate::contain) fn part(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    pub(in crate::contain) fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    pub(in crate::contain) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.part()
    }

    /// Returns a number with a log-uniform distribution.
    pub(in crate::contain) fn size(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    pub(in crate::contain) fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

/// A random layout and set.
pub(in crate::contain) fn case(random: &mut Random) -> Case {
    let unit = random.below(13) as u8;
    let scale = f64::from(1u32 << unit);
    let axes = if random.one_in(2) {
        Axes::World
    } else {
        Axes::Robot
    };
    // In robot axes, both coordinates of the point and the reach share a lever of 30,000.
    let longest = random.size(3.0, 30_000.0);
    let reach = if matches!(axes, Axes::World) {
        random.size(1.0, 30_000.0)
    } else {
        longest * random.between(0.1, 0.5)
    } as u16;
    let reach = reach.max(1);
    let span = match axes {
        Axes::World => longest,
        Axes::Robot => (longest - 2.0 * f64::from(reach)).max(0.0),
    };
    let share = random.part();
    let sign = |random: &mut Random| if random.one_in(2) { 1.0 } else { -1.0 };
    let mut point = [share, 1.0 - share].map(|part| (span * part * sign(random)) as i16);
    if random.one_in(4) {
        // On an axis, a vector is as long as the sum of its coordinates.
        point = [(span * sign(random)) as i16, 0];
    }
    if matches!(axes, Axes::World) && random.one_in(3) {
        point = [0, 0];
    }
    let arm = match axes {
        Axes::World => point[0].unsigned_abs() + point[1].unsigned_abs(),
        Axes::Robot => 0,
    };
    let farthest = (f64::from(reach) * 4.0 + 100.0).min(30_000.0) as u16;
    let angle = match random.below(4) {
        0 => random.below(8) as f64 * TAU / 8.0,
        _ => random.between(0.0, TAU),
    };
    let length = NORMAL * random.between(0.9966, 1.0033);
    let normal = [angle.cos(), angle.sin()].map(|v| (v * length).round() as i16);
    // Half a radian is 1,335,088.
    let turn = random.size(1.0, 1.33e6);
    let turn = if random.one_in(3) {
        random.between(0.3, 1.0) * 1.33e6
    } else {
        turn
    };
    // From a micrometre to more than the layout.
    let wide = random.size(1.0, f64::from(reach) * scale * 1.5).max(1.0);
    let extent = if random.one_in(4) {
        Extent::Bounded {
            translation_um: wide as i32,
            yaw_q24: turn as i32,
        }
    } else {
        let shape = random.below(4);
        let part = random.part();
        let mut row = || {
            let [a, b, c] = [(); 3].map(|()| random.between(-1.0, 1.0) * wide);
            match shape {
                // Only correlated with the yaw; not correlated; hardly correlated; any correlation.
                0 => [a, 0.0, 0.0],
                1 => [0.0, b, c],
                2 => [a, b * part * 0.1, c * part * 0.1],
                _ => [a, b, c],
            }
            .map(|v| v as i32)
        };
        let factor = SqrtFactor {
            x: row(),
            y: row(),
            yaw: turn as i32,
        };
        if random.one_in(3) {
            // The turns of both together are mostly below half a radian.
            let turn = random.size(1.0, (1.335e6 - f64::from(factor.yaw)).max(2.0)) as u32;
            let length = random.size(1.0, f64::from(reach) * scale * 0.5).max(1.0) as u32;
            let by = [
                Growth::new(length, turn),
                Growth::new(0, turn),
                Growth::new(length, 0),
            ];
            Extent::Grown {
                factor,
                by: by[random.below(3) as usize],
            }
        } else {
            Extent::Gaussian(factor)
        }
    };
    let [gx, gy] = [(); 2].map(|()| random.between(-1.7e9, 1.7e9) as i32);
    let goal = Pose {
        x_um: gx,
        y_um: gy,
        yaw: BinaryAngle(random.bits() as u32),
    };
    let mut case = Case {
        unit,
        reach,
        arm,
        farthest,
        axes,
        point,
        facet: Facet {
            x: normal[0],
            y: normal[1],
            b: 0,
        },
        goal,
        mean: goal,
        extent,
    };
    favoured(&mut case, random, 24);
    case
}

/// Sets the estimate, of `trials` random ones, that rounding favours most. Returns by how much,
/// length units.
pub(in crate::contain) fn favoured(case: &mut Case, random: &mut Random, trials: u32) -> f64 {
    let half = (1i32 << case.unit) >> 1;
    let mut most = f64::NEG_INFINITY;
    let mut found = case.mean;
    for _ in 0..trials {
        let mut near = |goal: i32| {
            let whole = (random.between(-1.0, 1.0) * (f64::from(case.reach) - 1.0)) as i32;
            let part = [half - 1, -half, 0, -1][random.below(4) as usize].max(-half);
            goal + (whole << case.unit) + part
        };
        let (x_um, y_um) = (near(case.goal.x_um), near(case.goal.y_um));
        let yaw = match random.below(8) {
            // Near half a turn, and at the other corners of the polynomials.
            0 => (random.below(8) as u32) << 29,
            1 => 0x7fff_fff0u32.wrapping_add(random.below(32) as u32),
            // Where cosine and sine have large errors.
            2..6 => (0..8)
                .map(|_| random.bits() as u32)
                .max_by(|a, b| error(*a).total_cmp(&error(*b)))
                .unwrap_or(0),
            _ => random.bits() as u32,
        };
        case.mean = Pose {
            x_um,
            y_um,
            yaw: BinaryAngle(yaw),
        };
        if let Some((favour, _)) = case.favour()
            && favour > most
        {
            (most, found) = (favour, case.mean);
        }
    }
    case.mean = found;
    most
}

/// Returns the error of cosine and sine of a heading, 2^-15.
fn error(yaw: u32) -> f64 {
    let [cos, sin] = BinaryAngle(yaw).cos_sin_q15().map(f64::from);
    let (s, c) = (f64::from(yaw) / 4_294_967_296.0 * TAU).sin_cos();
    (cos - 32_768.0 * c).hypot(sin - 32_768.0 * s)
}

fn pick(random: &mut Random, of: &[i64]) -> i64 {
    of[random.below(of.len() as u64) as usize]
}

/// Returns a layout and a set at the limits of tables and pose-sets.
pub(in crate::contain) fn extreme(random: &mut Random) -> Case {
    let unit = random.below(13) as u8;
    let axes = if random.one_in(2) {
        Axes::World
    } else {
        Axes::Robot
    };
    let (reach, arm, point): (i64, i64, [i64; 2]) = if matches!(axes, Axes::World) {
        let arm = pick(random, &[0, 1, 2, 15_000, 29_999, 30_000]);
        let x = pick(random, &[0, 1, arm / 2, arm]).min(arm);
        let s = pick(random, &[1, -1]);
        let t = pick(random, &[1, -1]);
        (pick(random, &[1, 2, 30_000]), arm, [x * s, (arm - x) * t])
    } else {
        let reach = pick(random, &[1, 2, 7_500, 15_000]);
        let q = 30_000 - 2 * reach;
        let q = pick(random, &[0, q, q / 2, 1.min(q)]);
        let x = pick(random, &[0, q / 2, q]);
        let s = pick(random, &[1, -1]);
        let t = pick(random, &[1, -1]);
        (reach, pick(random, &[0, 30_000]), [x * s, (q - x) * t])
    };
    let farthest = pick(random, &[0, 1, 30_000]);
    let limit = if matches!(axes, Axes::World) {
        30_000
    } else {
        farthest
    };
    let angle = if random.one_in(2) {
        random.below(8) as f64 * TAU / 8.0
    } else {
        random.between(0.0, TAU)
    };
    let length = NORMAL * [0.9963, 1.0, 1.0037][random.below(3) as usize];
    let normal = [angle.cos(), angle.sin()].map(|v| (v * length) as i16);
    let entry = |random: &mut Random, top: i64| {
        let bits = random.below(30);
        let v = pick(random, &[top, top - 1, 1 << bits, (1 << bits) - 1, 0, 1]).min(top);
        (v * pick(random, &[1, -1])) as i32
    };
    let bits = random.below(31);
    let turn = pick(
        random,
        &[
            1,
            2,
            1_335_088,
            1_335_087,
            1_335_000,
            1_335_089,
            (1 << 30) - 1,
            1 << 23,
            (1i64 << bits) - 1,
            1 << bits >> 1,
        ],
    )
    .clamp(1, (1 << 30) - 1) as i32;
    let extent = if random.one_in(3) {
        Extent::Bounded {
            translation_um: entry(random, (1 << 29) - 1).abs(),
            yaw_q24: turn.min(1 << 23),
        }
    } else {
        let top = if random.one_in(3) {
            (1 << pick(random, &[29, 26, 20, 14, 6])) - 1
        } else {
            // The widest that fits, in one entry or in all.
            let broad = ((1i64 << (14 + unit)) - 1) as f64;
            (broad / [1.0, 2f64.sqrt(), 3f64.sqrt(), 6f64.sqrt(), 4.0][random.below(5) as usize])
                as i64
        };
        let factor = SqrtFactor {
            yaw: turn,
            x: [(); 3].map(|()| entry(random, top)),
            y: [(); 3].map(|()| entry(random, top)),
        };
        if random.one_in(3) {
            let by = Growth::new(
                entry(random, top).unsigned_abs(),
                pick(random, &[0, 1, 1_335_088, 1 << 23, 1 << 24]) as u32,
            );
            Extent::Grown { factor, by }
        } else {
            Extent::Gaussian(factor)
        }
    };
    let scale = 1i64 << unit;
    let at = |random: &mut Random| {
        pick(
            random,
            &[-2_000_000_000, 0, 2_000_000_000, 1_999_999_999, 5],
        )
    };
    let goal = Pose {
        x_um: at(random) as i32,
        y_um: at(random) as i32,
        yaw: BinaryAngle(random.bits() as u32),
    };
    let mean = |random: &mut Random, goal: i32| {
        let d = pick(random, &[reach, -reach, 0, reach - 1, -reach / 2]) * scale
            + pick(random, &[0, scale / 2 - 1, -scale / 2, 1 - scale / 2]);
        let d = if random.one_in(50) {
            pick(random, &[4_000_000_000, -4_000_000_000, 100_000_000])
        } else {
            d
        };
        (i64::from(goal) + d).clamp(-2_000_000_000, 2_000_000_000) as i32
    };
    let yaw = match random.below(3) {
        0 => (random.below(8) as u32) << 29,
        1 => ((random.below(8) as u32) << 29)
            .wrapping_add(random.below(1 << 16) as u32)
            .wrapping_sub(1 << 15),
        _ => random.bits() as u32,
    };
    let mean = Pose {
        x_um: mean(random, goal.x_um),
        y_um: mean(random, goal.y_um),
        yaw: BinaryAngle(yaw),
    };
    Case {
        unit,
        reach: reach as u16,
        arm: arm as u16,
        farthest: farthest as u16,
        axes,
        point: point.map(|v| v as i16),
        facet: Facet {
            x: normal[0],
            y: normal[1],
            b: if random.one_in(3) {
                pick(random, &[limit, -limit, 0, limit / 2]) as i16
            } else {
                (random.between(-1.0, 1.0) * limit as f64) as i16
            },
        },
        goal,
        mean,
        extent,
    }
}
