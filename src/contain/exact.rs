//! The decision on facets against the exact sets.
//!
//! Random layouts of one facet, and random sets that the decision just accepts: found by bisection
//! over the facet's offset, and then over the size of the set, whose unit is finer. For each of them
//! the largest `a . P - b` over all poses of the exact set may be at most what
//! [`clearance_q14`](super::facets::clearance_q14) grants. The estimate is taken where rounding
//! favours it, so that hardly anything of the clearance is left over.
//!
//! The exact side is `f64`: lengths are below 2^29 um, and a dozen operations of 2^-53 of them each,
//! sines and cosines within one ulp: 2^-20 um in all, far below [`NUMERIC_UM`]. An ellipsoid at a fixed
//! first coordinate of u, and so at a fixed heading, is a disc's image, whose largest `a . P` is a
//! closed form; what is left is the largest value of a function of one number. Where that search should
//! miss it, the test is weaker; it never blames a right decision.

use super::compact::Compact;
use super::facets::{clearance_q14, covers};
use super::frame::Ready;
use crate::num::BinaryAngle;
use crate::pose::Pose;
use crate::set::{Extent, Factor, PoseSet};
use crate::table::{Axes, Facet, Table, checksum};
use core::f64::consts::{FRAC_PI_2, TAU};
use std::vec::Vec;

/// What the `f64` of the exact side may be wrong by, micrometres.
const NUMERIC_UM: f64 = 1e-4;
const NORMAL: f64 = 16_384.0;

/// SplitMix64.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In `[0, 1)`.
    fn part(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.part()
    }

    /// Every order of magnitude alike.
    fn size(&mut self, low: f64, high: f64) -> f64 {
        (self.between(low.ln(), high.ln())).exp()
    }

    fn one_in(&mut self, n: u64) -> bool {
        self.below(n) == 0
    }
}

/// A layout of one facet, and a set.
#[derive(Clone, Copy, Debug)]
struct Case {
    unit: u8,
    reach: u16,
    arm: u16,
    farthest: u16,
    axes: Axes,
    point: [i16; 2],
    facet: Facet,
    goal: Pose,
    mean: Pose,
    extent: Extent,
}

impl Case {
    /// A table of the layout.
    fn bytes(&self) -> Vec<u8> {
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

    fn set(&self) -> PoseSet {
        PoseSet::of(self.mean, self.extent)
    }

    /// What the decision says.
    fn holds(&self) -> bool {
        let bytes = self.bytes();
        let table = Table::parse(&bytes).unwrap_or_else(|error| panic!("{error:?} {self:?}"));
        covers(table.facets().unwrap(), &self.set(), table.goal().pose)
    }

    fn with_b(self, b: i32) -> Self {
        let b = b as i16;
        let facet = Facet { b, ..self.facet };
        Self { facet, ..self }
    }

    /// The set with its part in the plane, and its part in yaw, times a number.
    fn scaled(self, plane: f64, yaw: f64) -> Self {
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

    fn scale_um(&self) -> f64 {
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

    fn is_disc(&self) -> bool {
        matches!(self.extent, Extent::Bounded { .. })
    }

    /// Largest yaw offset, radians.
    fn turn(&self) -> f64 {
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
    fn slack_um(&self) -> f64 {
        let turns = self.point != [0, 0];
        let lever = self.lever() as u16;
        let clearance = clearance_q14(self.facet, self.axes, turns, self.unit, lever) as f64;
        (f64::from(self.facet.b) + clearance / NORMAL) * self.scale_um() - self.support()
    }

    /// As the layout works it out.
    fn lever(&self) -> u32 {
        let [x, y] = self.point.map(|v| u32::from(v.unsigned_abs()));
        match self.axes {
            Axes::World => u32::from(self.arm),
            Axes::Robot => u32::from(self.arm).max(x + y + 2 * u32::from(self.reach)),
        }
    }

    /// How much the rounding of the estimate favours it at the ends of its yaw, length units; and the
    /// extent's unit.
    fn favour(&self) -> Option<(f64, f64)> {
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
fn case(random: &mut Random) -> Case {
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

/// The case at the border of the decision, or `None` where no offset is accepted, or every one is.
fn at_border(case: Case, random: &mut Random) -> Option<Case> {
    let limit = match case.axes {
        Axes::World => 30_000,
        Axes::Robot => i32::from(case.farthest),
    };
    let (mut low, mut high) = (-limit, limit);
    if case.with_b(low).holds() || !case.with_b(high).holds() {
        return None;
    }
    while high - low > 1 {
        let middle = (low + high) / 2;
        if case.with_b(middle).holds() {
            high = middle;
        } else {
            low = middle;
        }
    }
    let case = case.with_b(high);
    // The largest set: an extent's unit is finer than an offset's.
    let sized = |by: f64, plane: bool| {
        if plane {
            case.scaled(by, 1.0)
        } else {
            case.scaled(1.0, by)
        }
    };
    let plane = !random.one_in(3);
    let (mut low, mut high) = (1.0, 2.0);
    if case.scaled(1.0, 1.0).holds() && !sized(high, plane).holds() {
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if sized(middle, plane).holds() {
                low = middle;
            } else {
                high = middle;
            }
        }
        return Some(sized(low, plane));
    }
    Some(case)
}

#[test]
fn what_is_accepted_is_inside() {
    let mut random = Random(7);
    // Smallest slack in the extent's units: of points that do not turn, that do, and in robot axes;
    // ellipsoids, then discs.
    let mut least = [f64::INFINITY; 6];
    let mut counts = [0u32; 6];
    for _ in 0..40_000 {
        let Some(case) = at_border(case(&mut random), &mut random) else {
            continue;
        };
        let slack = case.slack_um();
        assert!(slack >= -NUMERIC_UM, "{slack} um: {case:?}");
        let kind = match case.axes {
            Axes::World if case.point == [0, 0] => 0,
            Axes::World => 1,
            Axes::Robot => 2,
        } + if case.is_disc() { 3 } else { 0 };
        let (_, unit) = case.favour().unwrap();
        counts[kind] += 1;
        least[kind] = least[kind].min(slack / unit);
    }
    std::println!("cases {counts:?}, smallest slack {least:.2?}");
    assert!(counts.iter().all(|count| *count > 1_000), "{counts:?}");
    // Of what is granted for roundings of the extent, 6, they need not take anything: borders are
    // where they should be, and a test that grants that much less fails.
    let close = least.iter().zip([6.5, 9.0, 13.0, 12.0, 14.0, 16.0]);
    assert!(
        close.clone().all(|(found, limit)| *found < limit),
        "{least:?}"
    );
}

/// The estimate is rounded on axes of the world, and a normal in the robot's axes can lie across them.
#[test]
fn rounding_across_a_normal_in_robot_axes_is_paid() {
    let case = Case {
        unit: 12,
        reach: 100,
        arm: 0,
        farthest: 200,
        axes: Axes::Robot,
        point: [0, 0],
        facet: Facet {
            x: 16_350,
            y: 0,
            b: 8,
        },
        goal: Pose::default(),
        // 6 units and all but a half on each axis, seen at 45 degrees: 9.19 units, taken for 8.
        mean: Pose {
            x_um: 6 * 4096 + 2047,
            y_um: 6 * 4096 + 2047,
            yaw: BinaryAngle(1 << 29),
        },
        extent: Extent::Bounded {
            translation_um: 1,
            yaw_q24: 1,
        },
    };
    assert!(
        case.holds() && case.slack_um() >= 0.0,
        "{}",
        case.slack_um()
    );
}

/// A point of the robot is rounded on axes of the world, and that error turns with the yaw offset.
#[test]
fn rounding_that_turns_is_paid() {
    let case = Case {
        unit: 11,
        reach: 1370,
        arm: 5,
        farthest: 0,
        axes: Axes::World,
        point: [5, 0],
        facet: Facet {
            x: 372,
            y: 16_395,
            b: -757,
        },
        goal: Pose {
            x_um: -291_626_454,
            y_um: -1_209_906_498,
            yaw: BinaryAngle(0),
        },
        mean: Pose {
            x_um: -293_209_558,
            y_um: -1_211_418_947,
            yaw: BinaryAngle(2_684_822_216),
        },
        extent: Extent::Gaussian(Factor {
            yaw: 1_115_964,
            x: [-7026, 0, 0],
            y: [11_079, 0, 0],
        }),
    };
    assert!(
        case.holds() && case.slack_um() >= 0.0,
        "{}",
        case.slack_um()
    );
}
