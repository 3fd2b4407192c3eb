//! Layouts of one facet with a set, and the exact set's largest `a . P`.

use crate::contain::compact::Compact;
use crate::contain::facets::{clearance_q14, covers};
use crate::contain::frame::Ready;
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Extent, Factor, PoseSet};
use crate::table::{Axes, Facet, Table, checksum};
use core::f64::consts::{FRAC_PI_2, TAU};
use std::vec::Vec;

/// What the `f64` of the exact side may be wrong by, micrometres.
pub(in crate::contain) const NUMERIC_UM: f64 = 1e-4;
const NORMAL: f64 = 16_384.0;

/// SplitMix64.
pub(in crate::contain) struct Random(pub(in crate::contain) u64);

impl Random {
    pub(in crate::contain) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In `[0, 1)`.
    pub(in crate::contain) fn part(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    pub(in crate::contain) fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    pub(in crate::contain) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.part()
    }

    /// Every order of magnitude alike.
    pub(in crate::contain) fn size(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    pub(in crate::contain) fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

/// A layout of one facet, and a set.
#[derive(Clone, Copy, Debug)]
pub(in crate::contain) struct Case {
    pub(in crate::contain) unit: u8,
    pub(in crate::contain) reach: u16,
    pub(in crate::contain) arm: u16,
    pub(in crate::contain) farthest: u16,
    pub(in crate::contain) axes: Axes,
    pub(in crate::contain) point: [i16; 2],
    pub(in crate::contain) facet: Facet,
    pub(in crate::contain) goal: Pose,
    pub(in crate::contain) mean: Pose,
    pub(in crate::contain) extent: Extent,
}

impl Case {
    /// A table of the layout.
    pub(in crate::contain) fn bytes(&self) -> Vec<u8> {
        let mut bytes = std::vec![0u8; 176];
        let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
        put(0, b"POSEGATE\x01\x00\xb0\x00");
        put(16, &self.goal.x_um.to_le_bytes());
        put(20, &self.goal.y_um.to_le_bytes());
        put(24, &self.goal.yaw.0.to_le_bytes());
        // Facets are decided in world axes: the goal's cosine and sine are not looked at.
        put(28, &(1i32 << 30).to_le_bytes());
        put(44, &1u32.to_le_bytes());
        put(48, &[1, 0, 1, 0]);
        put(60, &[1, 0]);
        put(64, &(1u32 << 16).to_le_bytes());
        put(128, b"exact");
        put(160, b"1");
        put(76, &[176, 0, 0, 0, 36, 0, 0, 0]);
        bytes.extend([self.unit, 1, 1, 0, 1, 0]);
        for limit in [self.reach, self.arm, self.farthest] {
            bytes.extend(limit.to_le_bytes());
        }
        // The whole circle; one frame, one facet.
        bytes.extend([0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 0, 1, 0]);
        bytes.extend([u8::from(matches!(self.axes, Axes::Robot)), 1]);
        let Facet { x, y, b } = self.facet;
        for number in [self.point[0], self.point[1], x, y, b] {
            bytes.extend(number.to_le_bytes());
        }
        let length = bytes.len() as u32 + 4;
        bytes[12..16].copy_from_slice(&length.to_le_bytes());
        let crc = checksum(&bytes);
        bytes.extend(crc.to_le_bytes());
        bytes
    }

    pub(in crate::contain) fn set(&self) -> PoseSet {
        PoseSet::of(self.mean, self.extent)
    }

    /// What the decision says.
    pub(in crate::contain) fn holds(&self) -> bool {
        let bytes = self.bytes();
        let table = Table::parse(&bytes).unwrap_or_else(|error| panic!("{error:?} {self:?}"));
        covers(table.facets().unwrap(), &self.set(), table.goal().pose)
    }

    pub(in crate::contain) fn with_b(self, b: i32) -> Self {
        let b = b as i16;
        let facet = Facet { b, ..self.facet };
        Self { facet, ..self }
    }

    /// The set with its part in the plane, and its part in yaw, times a number.
    pub(in crate::contain) fn scaled(self, plane: f64, yaw: f64) -> Self {
        let length = |v: i32| (f64::from(v) * plane) as i32;
        let turn = |v: i32| (f64::from(v) * yaw) as i32;
        let extent = match self.extent {
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => Extent::Bounded {
                translation_um: length(translation_um),
                yaw_q24: turn(yaw_q24),
            },
            Extent::Gaussian(factor) => Extent::Gaussian(Factor {
                yaw: turn(factor.yaw),
                x: factor.x.map(length),
                y: factor.y.map(length),
            }),
        };
        Self { extent, ..self }
    }

    pub(in crate::contain) fn scale_um(&self) -> f64 {
        f64::from(1u32 << self.unit)
    }

    fn heading(&self) -> f64 {
        f64::from(self.mean.yaw.0) / 4_294_967_296.0 * TAU
    }

    fn normal(&self) -> [f64; 2] {
        [self.facet.x, self.facet.y].map(|v| f64::from(v) / NORMAL)
    }

    /// The estimate from the goal, micrometres.
    fn offset(&self) -> [f64; 2] {
        [
            f64::from(self.mean.x_um) - f64::from(self.goal.x_um),
            f64::from(self.mean.y_um) - f64::from(self.goal.y_um),
        ]
    }

    pub(in crate::contain) fn is_disc(&self) -> bool {
        matches!(self.extent, Extent::Bounded { .. })
    }

    /// Largest yaw offset, radians.
    pub(in crate::contain) fn turn(&self) -> f64 {
        let yaw = match self.extent {
            Extent::Bounded { yaw_q24, .. } => yaw_q24,
            Extent::Gaussian(factor) => factor.yaw,
        };
        f64::from(yaw) / 16_777_216.0 * TAU
    }

    /// Largest `a . P` at the share `u1` of the largest yaw offset, micrometres.
    ///
    /// Estimate and goal are each within 0.5 um of their integers: on each axis of the world together
    /// 1 um, which the clearance is for, too.
    fn support_at(&self, u1: f64, turn: f64) -> f64 {
        let (sin, cos) = (self.heading() + u1 * turn).sin_cos();
        let ([ax, ay], [mx, my]) = (self.normal(), self.offset());
        let [vx, vy] = self.point.map(|v| f64::from(v) * self.scale_um());
        let (normal, place) = match self.axes {
            Axes::World => {
                let carried = [cos * vx - sin * vy, sin * vx + cos * vy];
                ([ax, ay], [mx + carried[0], my + carried[1]])
            }
            Axes::Robot => {
                let normal = [cos * ax - sin * ay, sin * ax + cos * ay];
                (normal, [mx - vx, my - vy])
            }
        };
        let [nx, ny] = normal;
        let spread = match self.extent {
            Extent::Bounded { translation_um, .. } => f64::from(translation_um) * nx.hypot(ny),
            Extent::Gaussian(factor) => {
                let column = |i: usize| nx * f64::from(factor.x[i]) + ny * f64::from(factor.y[i]);
                column(0) * u1 + (1.0 - u1 * u1).max(0.0).sqrt() * column(1).hypot(column(2))
            }
        };
        nx * place[0] + ny * place[1] + spread + nx.abs() + ny.abs()
    }

    /// Largest `a . P` over the set, micrometres, from below.
    fn support(&self) -> f64 {
        // The share is a sine, so that the root at its ends is smooth.
        let turn = self.turn();
        let at = |phi: f64| self.support_at(phi.sin(), turn);
        const STEPS: i32 = 40;
        let step = 2.0 * FRAC_PI_2 / f64::from(STEPS);
        let place = |i: i32| -FRAC_PI_2 + f64::from(i) * step;
        let seen: Vec<f64> = (0..=STEPS).map(|i| at(place(i))).collect();
        let mut best = f64::NEG_INFINITY;
        for i in 0..=STEPS {
            let here = seen[i as usize];
            best = best.max(here);
            let next = |j: i32| seen.get(j as usize).copied().unwrap_or(f64::NEG_INFINITY);
            if here < next(i - 1) || here < next(i + 1) {
                continue;
            }
            let (mut low, mut high) = (place(i) - step, place(i) + step);
            for _ in 0..24 {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                let (va, vb) = (at(a), at(b));
                best = best.max(va).max(vb);
                if va < vb {
                    low = a;
                } else {
                    high = b;
                }
            }
        }
        best
    }

    /// What the claim has to spare, micrometres: below zero is a wrong "inside".
    pub(in crate::contain) fn slack_um(&self) -> f64 {
        let turns = self.point != [0, 0];
        let lever = self.lever() as u16;
        let clearance = clearance_q14(self.facet, self.axes, turns, self.unit, lever) as f64;
        (f64::from(self.facet.b) + clearance / NORMAL) * self.scale_um() - self.support()
    }

    /// As the layout works it out.
    pub(in crate::contain) fn lever(&self) -> u32 {
        let [x, y] = self.point.map(|v| u32::from(v.unsigned_abs()));
        match self.axes {
            Axes::World => u32::from(self.arm),
            Axes::Robot => u32::from(self.arm).max(x + y + 2 * u32::from(self.reach)),
        }
    }

    /// How much the rounding of the estimate favours it at the ends of its yaw, length units; and the
    /// extent's unit.
    pub(in crate::contain) fn favour(&self) -> Option<(f64, f64)> {
        let bytes = self.bytes();
        let table = Table::parse(&bytes).unwrap();
        let layout = table.facets().unwrap();
        let set = self.set();
        let ready = Ready::of(Compact::of(layout, &set, self.goal)?, layout)?;
        let frame = layout.pieces().next()?.frames().next()?;
        let seen = ready.seen(&frame);
        let (sin, cos) = self.heading().sin_cos();
        let [mx, my] = self.offset().map(|v| v / self.scale_um());
        let [vx, vy] = self.point.map(f64::from);
        let exact = match self.axes {
            Axes::World => [mx + cos * vx - sin * vy, my + sin * vx + cos * vy],
            Axes::Robot => [
                cos * (mx - vx) + sin * (my - vy),
                cos * (my - vy) - sin * (mx - vx),
            ],
        };
        let [ex, ey] = [exact[0] - f64::from(seen.x), exact[1] - f64::from(seen.y)];
        let [ax, ay] = self.normal();
        let (along, across) = (ax * ex + ay * ey, ay * ex - ax * ey);
        let (sin, cos) = self.turn().sin_cos();
        Some((
            cos * along + sin * across.abs(),
            f64::from(1u32 << ready.set.unit),
        ))
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
    // Both coordinates of the point, and the reach, share a lever of 30,000 in the robot's axes.
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
        // Along an axis a vector is as long as its coordinates together.
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
    // From a micrometre to wider than the layout.
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
                // Correlated with the yaw alone; not at all; hardly; anyhow.
                0 => [a, 0.0, 0.0],
                1 => [0.0, b, c],
                2 => [a, b * part * 0.1, c * part * 0.1],
                _ => [a, b, c],
            }
            .map(|v| v as i32)
        };
        Extent::Gaussian(Factor {
            x: row(),
            y: row(),
            yaw: turn as i32,
        })
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
    favoured(&mut case, random);
    case
}

/// Takes, of some estimates, the one that rounding favours most.
fn favoured(case: &mut Case, random: &mut Random) {
    let half = (1i32 << case.unit) >> 1;
    let mut most = f64::NEG_INFINITY;
    let mut found = case.mean;
    for _ in 0..24 {
        let mut near = |goal: i32| {
            let whole = (random.between(-1.0, 1.0) * (f64::from(case.reach) - 1.0)) as i32;
            let part = [half - 1, -half, 0][random.below(3) as usize].max(-half);
            goal + (whole << case.unit) + part
        };
        let (x_um, y_um) = (near(case.goal.x_um), near(case.goal.y_um));
        let yaw = match random.below(8) {
            // About half a turn, and the other corners of the polynomials.
            0 => (random.below(8) as u32) << 29,
            1 => 0x7fff_fff0u32.wrapping_add(random.below(32) as u32),
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
}

fn pick(random: &mut Random, of: &[i64]) -> i64 {
    of[random.below(of.len() as u64) as usize]
}

/// A layout and a set at the ends of what a table and a pose-set admit.
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
    .max(1)
    .min((1 << 30) - 1) as i32;
    let extent = if random.one_in(3) {
        Extent::Bounded {
            translation_um: entry(random, (1 << 29) - 1).abs(),
            yaw_q24: turn.min(1 << 23),
        }
    } else {
        let top = if random.one_in(3) {
            (1 << pick(random, &[29, 26, 20, 14, 6])) - 1
        } else {
            // The broadest that fits, in one entry or in all.
            let broad = ((1i64 << (14 + unit)) - 1) as f64;
            (broad / [1.0, 2f64.sqrt(), 3f64.sqrt(), 6f64.sqrt(), 4.0][random.below(5) as usize])
                as i64
        };
        Extent::Gaussian(Factor {
            yaw: turn,
            x: [(); 3].map(|()| entry(random, top)),
            y: [(); 3].map(|()| entry(random, top)),
        })
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
