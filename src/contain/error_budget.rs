//! The rows of the error budget of facets, each searched for its worst case.
//!
//! The judge is the definition in floats of 53 bits: the point of a pose at each heading, without first order, slabs or levers. Its own error is
//! below a thousandth of an extent unit.

use super::facet_clearance_q14;
use super::facets::middle_of;
use super::placed::Placed;
use super::slab::{DEEPEST, Section, Slab, Width};
use super::union::rounding_of_a_sum;
use crate::error_budget::{Random, Row, Search};
use crate::num::BinaryAngle;
use crate::pose::{GoalFrame, Pose};
use crate::set::{Extent, Growth, PoseSet, SqrtFactor};
use crate::table::{Axes, Cells, Facet, Facets, LONGEST_LEVER};
use crate::test_share;
use core::f64::consts::TAU;
use std::vec::Vec;

/// Radians of 2^-24 turn.
const Q24: f64 = TAU / 16_777_216.0;

/// Why rows of many roundings stay below their sums.
const ROUNDINGS: &str =
    "about ten numbers are rounded, and others up: a search does not align them all";

/// A number of a [`Section`], and its largest error for the columns and the normal as they are stored: always, and in addition for an offset
/// of 2^15, extent units.
struct Number {
    name: &'static str,
    why: &'static str,
    error: [f64; 2],
    /// In addition for a slab beside the estimate, in robot axes.
    beside: [f64; 2],
    is_robots: bool,
}

/// The numbers that a bound subtracts from the slack at the middle.
const NUMBERS: [Number; 5] = [
    Number {
        name: "S w and G",
        why: "the point's lever times the turn: 0.71, and 3.8e-5 of it, less 2^-14 of it, 0.63; the sum 0.5. Beside the estimate the middle's \
              offset is a part of the lever: 0.71 w, cosine and sine 0.83 w, the turn 0.5 and 0.63 on each axis",
        error: [1.85, 0.0],
        beside: [1.07, 1.31],
        is_robots: false,
    },
    Number {
        name: "F23' n",
        why: "0.5 in each of two numbers",
        error: [0.71, 0.0],
        beside: [0.0; 2],
        is_robots: false,
    },
    Number {
        name: "w F23' J n",
        why: "0.5 w, 0.5 and 3.8e-5 in each of two numbers",
        error: [1.07, 0.9],
        beside: [0.0; 2],
        is_robots: true,
    },
    Number {
        name: "H",
        why: "0.5 w, 0.5 and 3.8e-5; beside the estimate 0.5 w in each entry of a halved column",
        error: [0.75, 0.64],
        beside: [0.36, 0.0],
        is_robots: true,
    },
    Number {
        name: "the slack at the middle",
        why: "the product with the middle's offset, of which six bits are left out, is rounded down",
        error: [0.01, 0.0],
        beside: [0.0; 2],
        is_robots: false,
    },
];
/// The error of a column of the factor: 0.5 on each axis. All three move a pose by up to 1.73 of it; a normal turns by half a radian, so the effect
/// is up to 1.118 times that.
const COLUMN: f64 = 0.708;
/// The error of a normal in world axes, 2^-14: cosine and sine 0.83, to the nearest 0.71. Its effect is up to 1.118 times that of the offset.
const NORMAL: f64 = 1.54;
const TURNED: f64 = 1.118_1;
/// A normal is at most this long.
const LONGEST_NORMAL: f64 = 1.0 + 1.0 / 256.0;
/// What a weighted sum rounds: two numbers along the normal and G, and in robot axes two ahead of it and H, extent units.
const SUMS: [f64; 2] = [0.71 + 0.5, 0.71 + 0.5 + 0.71 + 0.5];

/// Numbers between 0 and 1 that make a case: a search changes some of them.
#[derive(Clone)]
struct Genes([f64; 40]);

struct Reader<'a>(core::slice::Iter<'a, f64>);

impl Reader<'_> {
    fn unit(&mut self) -> f64 {
        *self.0.next().expect("enough genes")
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + self.unit() * (high - low)
    }

    /// As likely in each octave, and sometimes the largest value.
    fn size(&mut self, low: f64, high: f64) -> f64 {
        let share = (self.unit() * 1.1).min(1.0);
        low * (high / low).powf(share)
    }

    fn choice(&mut self, count: u32) -> u32 {
        (self.unit() * f64::from(count)) as u32 % count
    }
}

impl Genes {
    fn new(random: &mut Random) -> Self {
        Self(core::array::from_fn(|_| random.unit()))
    }

    /// Returns a neighbour: some of the numbers are new, or moved a little.
    fn changed(&self, random: &mut Random) -> Self {
        let mut genes = self.clone();
        for _ in 0..1 + (random.unit() * 3.0) as usize {
            let gene = &mut genes.0[(random.unit() * 40.0) as usize % 40];
            *gene = if random.unit() < 0.3 {
                random.unit()
            } else {
                (*gene + random.log_within(1e-6, 0.1) * random.sign()).clamp(0.0, 1.0)
            };
        }
        genes
    }
}

/// Searches for the largest error: random cases, and from the best of each round its neighbours.
fn searched(seed: u64, rounds: u32, case: impl Fn(&Genes) -> Option<[f64; 2]>) -> Search {
    let mut random = Random::new(seed);
    let mut search = Search::new();
    for _ in 0..rounds {
        let mut best: Option<(f64, Genes)> = None;
        for trial in 0..1500 {
            let genes = match &best {
                Some((_, genes)) if trial > 100 => genes.changed(&mut random),
                _ => Genes::new(&mut random),
            };
            let Some([bound, found]) = case(&genes) else {
                continue;
            };
            search.case(bound, found);
            if best.as_ref().is_none_or(|(most, _)| found / bound > *most) {
                best = Some((found / bound, genes));
            }
        }
    }
    search
}

/// A facet, and the point of its frame.
#[derive(Clone, Copy, Debug)]
struct Plane {
    facet: Facet,
    axes: Axes,
    point: [i32; 2],
}

/// A table of one piece, and a set.
struct Case {
    bytes: Vec<u8>,
    planes: Vec<Plane>,
    set: PoseSet,
    /// The set as given: the rows x, y and yaw of the factor, um and radians. Of a cylinder the radius and the turn.
    factor: [[f64; 3]; 3],
    is_cylinder: bool,
    /// The movement: um, radians.
    by: [f64; 3],
}

fn plane(read: &mut Reader<'_>, reach: f64, is_robot: bool) -> Plane {
    let axes = if is_robot { Axes::Robot } else { Axes::World };
    let (c, s) = read.within(0.0, TAU).sin_cos();
    let long = 16_384.0 * (1.0 + read.within(-1.0, 1.0) / 260.0);
    let most = match axes {
        Axes::World => f64::from(LONGEST_LEVER),
        Axes::Robot => (f64::from(LONGEST_LEVER) - 2.0 * reach).max(1.0),
    };
    let share = read.within(-1.0, 1.0);
    let far = read.size(1.0, most) - 1.0;
    let point = if far < 1.0 {
        [0, 0]
    } else {
        [
            far * share,
            far * (1.0 - share.abs()) * if read.unit() < 0.5 { -1.0 } else { 1.0 },
        ]
        .map(|v| v as i32)
    };
    Plane {
        facet: Facet {
            x: (long * c).round() as i16,
            y: (long * s).round() as i16,
            b: 0,
        },
        axes,
        point,
    }
}

impl Case {
    /// Makes a case with planes in these axes: robot's, or the world's.
    fn new(genes: &Genes, robot: &[bool], is_scaled: bool) -> Self {
        let mut read = Reader(genes.0.iter());
        let unit = read.choice(13) as u8;
        let um = f64::from(1u32 << unit);
        let reach = read.size(2.0, 15_000.0).floor();
        let planes: Vec<Plane> = robot
            .iter()
            .map(|robot| plane(&mut read, reach, *robot))
            .collect();
        let place = [(); 2].map(|()| (read.within(-reach, reach).round() * um) as i32);
        let heading = BinaryAngle((read.unit() * 4.29e9) as u32);
        // To a little more than a turn.
        let turn = (read.size(1.0, 18e6)) as i32;
        let size = read.size(1.0, 24_000.0) * um;
        let narrow = read.size(1e-3, 1.0);
        let kind = read.choice(4);
        let mut entry = |share: f64| (read.within(-1.0, 1.0) * share * size) as i32;
        let base = SqrtFactor {
            yaw: turn,
            x: [entry(1.0), entry(1.0), entry(narrow)],
            y: [entry(1.0), entry(narrow), entry(1.0)],
        };
        let length = read.size(1.0, 2.0 * size);
        let side = (1.2 * read.unit() - 0.1).clamp(0.0, 1.0) * length;
        let by = Growth::along(length as u32, side as u32, read.size(1.0, 0.3 / Q24) as u32);
        let scale_q16 = read.size(6_553.6, 655_360.0) as u32;
        let (scale, factor) = match base.scaled(scale_q16) {
            Some(factor) if is_scaled => (f64::from(scale_q16) / 65_536.0, factor),
            _ => (1.0, base),
        };
        let row = |row: [i32; 3]| row.map(|v| f64::from(v) * scale);
        let mut given = [
            row(base.x),
            row(base.y),
            [f64::from(base.yaw) * scale * Q24, 0.0, 0.0],
        ];
        let is_cylinder = kind == 0;
        let (extent, by) = match kind {
            0 => {
                let [radius, yaw] = [size.max(1.0) as i32, turn.min(1 << 23)];
                given = [
                    [f64::from(radius); 3],
                    [0.0; 3],
                    [f64::from(yaw) * Q24, 0.0, 0.0],
                ];
                let extent = Extent::Bounded {
                    translation_um: radius,
                    yaw_q24: yaw,
                };
                (extent, [0.0; 3])
            }
            1 => {
                let moved = [
                    f64::from(by.translation_um()),
                    f64::from(by.yaw_q24()) * Q24,
                    f64::from(by.aside_um(factor.yaw)),
                ];
                (Extent::Grown { factor, by }, moved)
            }
            _ => (Extent::Gaussian(factor), [0.0; 3]),
        };
        let mean = Pose {
            x_um: place[0],
            y_um: place[1],
            yaw: heading,
        };
        Self {
            bytes: bytes(unit, reach as u16, &planes),
            planes,
            set: PoseSet::of(mean, extent),
            factor: given,
            is_cylinder,
            by,
        }
    }

    fn layout(&self) -> Facets<'_> {
        let cells = Cells {
            x_lo_um: 0,
            y_lo_um: 0,
            step_um: 1,
            columns: 1,
            rows: 1,
            yaw_lo: BinaryAngle(0),
            yaw_span: 1 << 32,
            slabs: 1,
        };
        Facets::parse(&self.bytes, &cells).expect("a layout")
    }

    /// Returns the largest reach of the poses with this u along a weighted sum of planes, beyond the point that turns as `turned` and is the
    /// estimate's at the heading `from`, um. `arms` are what turns, um.
    fn reach(&self, u: f64, swing: f64, from: f64, planes: &[(Plane, [f64; 2], f64)]) -> f64 {
        let [x, y, [turn, ..]] = self.factor;
        let heading = f64::from(self.set.mean().yaw.0) / 4_294_967_296.0 * TAU + turn * u + swing;
        let (sin, cos) = heading.sin_cos();
        let (s, c) = (heading - from).sin_cos();
        let (mut sum, mut normal) = (0.0, [0.0; 2]);
        for (plane, [ax, ay], weight) in planes {
            let [nx, ny] = [plane.facet.x, plane.facet.y].map(|v| f64::from(v) / 16_384.0);
            let (turned, [wx, wy]) = match plane.axes {
                Axes::World => ([c * ax - s * ay, s * ax + c * ay], [nx, ny]),
                Axes::Robot => (
                    [c * ax + s * ay, c * ay - s * ax],
                    [cos * nx - sin * ny, sin * nx + cos * ny],
                ),
            };
            sum += weight * (nx * (turned[0] - ax) + ny * (turned[1] - ay));
            normal = [normal[0] + weight * wx, normal[1] + weight * wy];
        }
        let [nx, ny] = normal;
        let length = nx.hypot(ny);
        if self.is_cylinder {
            return sum + x[0] * length;
        }
        let column = |k: usize| nx * x[k] + ny * y[k];
        let root = (1.0 - u * u).max(0.0).sqrt();
        sum + column(0) * u + root * column(1).hypot(column(2)) + self.moved(normal)
    }

    /// Returns the largest reach of the movement along a normal in world axes: of a disc, and of a strip along the estimate's heading.
    fn moved(&self, [nx, ny]: [f64; 2]) -> f64 {
        let (s, c) = (f64::from(self.set.mean().yaw.0) / 4_294_967_296.0 * TAU).sin_cos();
        let [ahead, across] = [(c * nx + s * ny).abs(), (c * ny - s * nx).abs()];
        let [radius, _, aside] = self.by;
        if radius * across <= aside * nx.hypot(ny) {
            radius * nx.hypot(ny)
        } else {
            ahead * (radius * radius - aside * aside).sqrt() + across * aside
        }
    }

    /// Returns the largest reach over a range of u, and over the turns of the movement: a lower bound.
    fn most(&self, [low, high]: [f64; 2], from: f64, planes: &[(Plane, [f64; 2], f64)]) -> f64 {
        let at = |u: f64| {
            let shares = if self.by[1] > 0.0 { 2 } else { 0 };
            let turns = (-shares..=shares).map(|k| f64::from(k) / 2.0 * self.by[1]);
            turns
                .map(|swing| self.reach(u, swing, from, planes))
                .fold(f64::MIN, f64::max)
        };
        let mut step = (high - low) / 32.0;
        let (mut best, mut most) = (low, f64::MIN);
        for k in 0..=32 {
            let u = low + step * f64::from(k);
            let found = at(u);
            if found > most {
                (best, most) = (u, found);
            }
        }
        for _ in 0..24 {
            step *= 0.6;
            for u in [best - step, best + step] {
                let u = u.clamp(low, high);
                let found = at(u);
                if found > most {
                    (best, most) = (u, found);
                }
            }
        }
        most
    }
}

/// Returns the bytes of a layout of one piece with a frame for each plane.
fn bytes(unit: u8, reach: u16, planes: &[Plane]) -> Vec<u8> {
    let count = planes.len() as u8;
    let arms = planes
        .iter()
        .filter(|plane| matches!(plane.axes, Axes::World));
    let arm = arms
        .map(|plane| plane.point.map(i32::abs).iter().sum::<i32>())
        .max()
        .unwrap_or(0);
    let mut bytes = std::vec![unit, 1, count, 0];
    let words = |bytes: &mut Vec<u8>, words: &[u16]| {
        bytes.extend(words.iter().flat_map(|v| v.to_le_bytes()))
    };
    words(&mut bytes, &[count.into(), reach, arm as u16, 0]);
    bytes.extend(0u32.to_le_bytes());
    bytes.extend(u32::MAX.to_le_bytes());
    bytes.extend([count, 0]);
    words(&mut bytes, &[count.into()]);
    for plane in planes {
        bytes.extend([u8::from(matches!(plane.axes, Axes::Robot)), 1]);
        words(&mut bytes, &plane.point.map(|v| v as i16 as u16));
    }
    for plane in planes {
        words(
            &mut bytes,
            &[plane.facet.x, plane.facet.y, plane.facet.b].map(|v| v as u16),
        );
    }
    bytes
}

/// Returns the smallest spare at which a test accepts a section, if it depends on its slack alone.
fn least_spare(accepts: impl Fn(i32) -> bool) -> i32 {
    let (mut low, mut high) = (-(1 << 20), 1 << 20);
    while high - low > 1 {
        let middle = (low + high) >> 1;
        if accepts(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// Returns a slab of a set: at the estimate for the depth 0, else of random depth and place.
fn slab(genes: &Genes, placed: &Placed, is_beside: bool) -> Option<(i32, Width)> {
    let [depth, index] = [genes.0[38], genes.0[39]];
    let first = placed.first.depth;
    if !is_beside {
        return (first == 0).then_some((0, placed.first));
    }
    let deepest = DEEPEST.max(first);
    let depth = (first + (depth * f64::from(deepest - first + 1)) as u32).clamp(1, deepest);
    let width = placed.first.halved_to(depth);
    let index = ((index * f64::from(1u32 << depth)) as u32).min((1 << depth) - 1);
    Some((middle_of(index, depth), width))
}

fn um(placed: &Placed) -> f64 {
    f64::from(1u32 << placed.unit)
}

/// The case of one facet on one slab: the slack that is allowed for, and the error without it.
fn of_slab(genes: &Genes, is_robot: bool, is_beside: bool, is_scaled: bool) -> Option<[f64; 2]> {
    let case = Case::new(genes, &[is_robot], is_scaled);
    let layout = case.layout();
    let placed = Placed::of(&layout, &case.set, Pose::default())?;
    if placed.is_cylinder && !case.is_cylinder {
        return None;
    }
    let (e, width) = slab(genes, &placed, is_beside)?;
    let middle = placed.middle(e);
    let plane = case.planes[0];
    let seen = placed.seen_at(plane.axes, plane.point, &middle, &width);
    let section = Section::of(plane.facet, &seen, &placed, &middle, &width);
    // The part of the slack that is the middle's offset.
    let offset = section.left - placed.spare(plane.facet, &seen);
    let spare = least_spare(|spare| {
        let left = spare + offset;
        Section { left, ..section }.slab(&placed, e, &width) == Slab::Inside
    });
    let unit = f64::from(1u32 << layout.unit());
    let arm = seen.arm.map(|v| f64::from(v) * unit);
    let found = case.most(range(e, &width), heading(&placed, e), &[(plane, arm, 1.0)]);
    let slack = placed.slack(is_robot, e);
    Some([slack.into(), found / um(&placed) - f64::from(spare - slack)])
}

/// The headings of a slab, u.
fn range(e: i32, width: &Width) -> [f64; 2] {
    [e - width.in_u(), e + width.in_u()].map(|u| f64::from(u) / 32_768.0)
}

fn heading(placed: &Placed, e: i32) -> f64 {
    f64::from(placed.heading_at(e).0) / 4_294_967_296.0 * TAU
}

/// The slack covers the errors of all numbers, those of a factor that is scaled among them.
#[test]
fn slack_covers_its_parts() {
    let mut random = Random::new(29);
    for _ in 0..test_share(20_000, 10) {
        let genes = Genes::new(&mut random);
        let is_robot = genes.0[37] < 0.5;
        let case = Case::new(&genes, &[is_robot], true);
        let layout = case.layout();
        let Some(placed) = Placed::of(&layout, &case.set, Pose::default()) else {
            continue;
        };
        for e in [0, 1 << 14] {
            let share = f64::from(placed.broad) / 32_768.0;
            let turned = if is_robot { TURNED } else { 1.0 };
            let columns = 3f64.sqrt() * COLUMN * LONGEST_NORMAL * turned;
            let normal = if is_robot { 2.0 * NORMAL * turned } else { 0.0 };
            let numbers = NUMBERS
                .iter()
                .filter(|number| is_robot || !number.is_robots);
            let errors = numbers.map(|number| number.bound(share, is_robot && e != 0));
            let sum = columns + normal * share + errors.sum::<f64>();
            // Entries to the nearest micrometre, and a turn that is up by one unit.
            let units = f64::from(1u32 << layout.unit()) / um(&placed);
            let Plane { axes, point, .. } = case.planes[0];
            let arm = match axes {
                Axes::World => point,
                Axes::Robot => core::array::from_fn(|k| placed.place[k] - point[k]),
            };
            let arm = f64::from(arm[0]).hypot(arm[1].into());
            let scaled = 1.23 / um(&placed) + arm * Q24 * units;
            let slack = f64::from(placed.slack(is_robot, e));
            let [all, weighed] = [sum + scaled, SUMS[usize::from(is_robot)]];
            assert!(
                all <= slack && all + weighed <= slack + f64::from(rounding_of_a_sum(is_robot)),
                "{sum} and {scaled} of {slack}: {placed:?}"
            );
        }
    }
    assert!(NUMBERS.iter().all(|number| !number.why.is_empty()));
}

impl Number {
    fn bound(&self, share: f64, is_beside: bool) -> f64 {
        let [mut always, mut by_offset] = self.error;
        if is_beside {
            always += self.beside[0];
            by_offset += self.beside[1];
        }
        always + by_offset * share
    }
}

/// The errors of the columns, of the normal, and of the [`NUMBERS`], with their bounds.
fn numbers(genes: &Genes, is_robot: bool, is_beside: bool) -> Option<[[f64; 2]; 7]> {
    let case = Case::new(genes, &[is_robot], false);
    let layout = case.layout();
    let placed = Placed::of(&layout, &case.set, Pose::default())?;
    if placed.is_cylinder {
        return None;
    }
    let (e, width) = slab(genes, &placed, is_beside)?;
    let plane = case.planes[0];
    let seen = placed.seen_at(plane.axes, plane.point, &placed.middle(e), &width);
    let section = Section::of(plane.facet, &seen, &placed, &placed.middle(e), &width);
    let [x, y, [turn, ..]] = case.factor;
    let columns = placed.columns.map(|column| column.map(f64::from));
    let off = |k: usize| {
        let [cx, cy] = columns[k];
        (cx - x[k] / um(&placed)).hypot(cy - y[k] / um(&placed))
    };
    let column = off(0).max(off(1)).max(off(2));
    let own = [plane.facet.x, plane.facet.y].map(|v| f64::from(v) / 16_384.0);
    let (sin, cos) = heading(&placed, e).sin_cos();
    let normal = section.normal.map(|v| f64::from(v) / 16_384.0);
    let turned = if is_robot {
        let [dx, dy] = [
            cos * own[0] - sin * own[1] - normal[0],
            sin * own[0] + cos * own[1] - normal[1],
        ];
        16_384.0 * dx.hypot(dy)
    } else {
        0.0
    };
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let left = |[x, y]: [f64; 2]| [-y, x];
    let ahead = left(normal);
    let [u, half] = [e, width.in_u()].map(|u| f64::from(u) / 32_768.0);
    let w = turn * half;
    let [f, second, third] = columns;
    let units = f64::from(1u32 << layout.unit()) / um(&placed);
    // A point's arm is what it is: its rounding counts elsewhere.
    let arm = seen.arm.map(|v| f64::from(v) * units);
    let lever = if is_robot {
        -dot(own, left(arm)) + u * dot(ahead, f)
    } else {
        dot(own, left(arm))
    };
    // The slack is lower by the part that this makes up for.
    let [sx, sy] = seen.swing.map(i32::unsigned_abs);
    let for_turn = f64::from((sx + sy) >> 14);
    let apart = |found: i32, exact: f64| f64::from(found) - exact;
    let pair = |found: [i32; 2], by: f64, along: [f64; 2]| {
        let [a, b] = found;
        apart(a, by * dot(along, second)).hypot(apart(b, by * dot(along, third)))
    };
    let middle = f64::from(section.left - placed.spare(plane.facet, &seen)) + for_turn;
    let slope = apart(section.slope, dot(normal, f) * half + lever * w);
    let errors = [
        slope.abs() - for_turn,
        pair(section.along, 1.0, normal),
        pair(section.ahead, w, ahead),
        apart(section.bend, w * half * dot(ahead, f)).abs(),
        middle + u * dot(normal, f),
    ];
    let share = f64::from(placed.broad) / 32_768.0;
    let of = |k: usize| [NUMBERS[k].bound(share, is_robot && e != 0), errors[k]];
    Some([
        [COLUMN, column],
        [NORMAL, turned],
        of(0),
        of(1),
        of(2),
        of(3),
        of(4),
    ])
}

#[test]
fn numbers_of_a_section() {
    let names = ["a column of the factor", "a normal in world axes"];
    let names = names.into_iter().chain(NUMBERS.map(|number| number.name));
    for (index, name) in names.enumerate() {
        for (is_robot, axes) in [(false, "world"), (true, "robot")] {
            let is_robots = index == 1 || index > 1 && NUMBERS[index - 2].is_robots;
            if is_robots && !is_robot {
                continue;
            }
            for (is_beside, place) in [(false, "of the whole set"), (true, "beside the estimate")] {
                let is_slack = index == NUMBERS.len() + 1;
                if is_slack && !is_beside {
                    // Exact.
                    continue;
                }
                searched(50 + index as u64, test_share(100, 1), |genes| {
                    numbers(genes, is_robot, is_beside).map(|all| all[index])
                })
                .report(&Row {
                    name: &std::format!("contain: {name}, in {axes} axes, {place}"),
                    unit: if index == 1 { "2^-14" } else { "extent units" },
                    looseness: is_slack.then_some("it is rounded down"),
                });
            }
        }
    }
}

#[test]
fn one_facet_over_a_slab() {
    let rounds = test_share(600, 1);
    for (number, (is_robot, is_beside)) in
        [(false, false), (false, true), (true, false), (true, true)]
            .into_iter()
            .enumerate()
    {
        let axes = if is_robot { "robot" } else { "world" };
        let place = if is_beside {
            "beside the estimate"
        } else {
            "of the whole set"
        };
        for is_scaled in [false, true] {
            let what = if is_scaled { ", times a scale" } else { "" };
            searched(30 + number as u64, rounds, |genes| {
                of_slab(genes, is_robot, is_beside, is_scaled)
            })
            .report(&Row {
                name: &std::format!(
                    "contain: roundings of a facet in {axes} axes over a slab {place}{what}"
                ),
                unit: "extent units",
                looseness: Some(ROUNDINGS),
            });
        }
    }
}

/// The cheap test of a facet against the whole set.
#[test]
fn facet_that_is_far_from_the_whole_set() {
    let of = |genes: &Genes, is_any: bool| {
        let case = Case::new(genes, &[genes.0[37] < 0.5], genes.0[36] < 0.5);
        let layout = case.layout();
        let placed = Placed::of(&layout, &case.set, Pose::default())?;
        if placed.is_cylinder && !case.is_cylinder {
            return None;
        }
        let plane = case.planes[0];
        let seen = placed.seen_at(plane.axes, plane.point, &placed.middle(0), &placed.first);
        let unit = f64::from(1u32 << layout.unit());
        let arm = seen.arm.map(|v| f64::from(v) * unit);
        let found = case.most([-1.0, 1.0], heading(&placed, 0), &[(plane, arm, 1.0)]);
        let at_any = placed.enough_at_any_heading(plane.facet, &seen);
        let enough = if is_any { at_any } else { placed.enough(&seen) };
        Some([enough.into(), found / um(&placed)])
    };
    for (is_any, what) in [(false, "for the whole set"), (true, "at any heading")] {
        searched(41, test_share(200, 1), |genes| of(genes, is_any)).report(&Row {
            name: &std::format!("contain: slack at which a facet holds {what}"),
            unit: "extent units",
            looseness: None,
        });
    }
}

/// A weighted sum of two facets.
#[test]
fn sum_of_two_facets_over_a_slab() {
    let of = |genes: &Genes| {
        let robot = [genes.0[37] < 0.5, genes.0[36] < 0.5];
        let case = Case::new(genes, &robot, false);
        let layout = case.layout();
        let placed = Placed::of(&layout, &case.set, Pose::default())?;
        if placed.is_cylinder && !case.is_cylinder {
            return None;
        }
        let (e, width) = slab(genes, &placed, genes.0[35] < 0.5)?;
        let weight = (genes.0[34] * 4_097.0) as i32;
        let share = f64::from(weight) / 4_096.0;
        let middle = placed.middle(e);
        let unit = f64::from(1u32 << layout.unit());
        let mut parts = case
            .planes
            .iter()
            .zip([1.0 - share, share])
            .map(|(plane, share)| {
                let seen = placed.seen_at(plane.axes, plane.point, &middle, &width);
                let section = Section::of(plane.facet, &seen, &placed, &middle, &width);
                let offset = section.left - placed.spare(plane.facet, &seen);
                let arm = seen.arm.map(|v| f64::from(v) * unit);
                (
                    Section {
                        left: offset,
                        ..section
                    },
                    (*plane, arm, share),
                )
            });
        let ((first, one), (second, two)) = (parts.next()?, parts.next()?);
        let spare = least_spare(|spare| {
            let of = |section: Section| Section {
                left: section.left + spare,
                ..section
            };
            of(first)
                .weighed(&of(second), weight)
                .slab(&placed, e, &width)
                == Slab::Inside
        });
        let found = case.most(range(e, &width), heading(&placed, e), &[one, two]);
        let turns = robot[0] || robot[1];
        let slack = placed.slack(turns, e) + rounding_of_a_sum(turns);
        Some([slack.into(), found / um(&placed) - f64::from(spare - slack)])
    };
    searched(42, test_share(600, 1), of).report(&Row {
        name: "contain: roundings of a weighted sum of two facets over a slab",
        unit: "extent units",
        looseness: Some(ROUNDINGS),
    });
}

/// The estimate, its heading and its point in a frame, at every heading of a slab: what the proof of a table allows for.
#[test]
fn rounding_of_an_estimate_and_its_point() {
    let of = |genes: &Genes| {
        let is_robot = genes.0[37] < 0.5;
        let mut case = Case::new(genes, &[is_robot], false);
        let mut mean = case.set.mean();
        // The estimate and the goal are each within half a micrometre of their integers.
        let more = [genes.0[32], genes.0[33]].map(|v| 2.0 * v - 1.0);
        let unit = f64::from(1u32 << case.bytes[0]);
        let part = [genes.0[30], genes.0[31]].map(|v| (v * unit) as i32);
        (mean.x_um, mean.y_um) = (
            mean.x_um.wrapping_add(part[0]),
            mean.y_um.wrapping_add(part[1]),
        );
        case.set = PoseSet::of(mean, case.set.extent());
        let layout = case.layout();
        let placed = Placed::of(&layout, &case.set, Pose::default())?;
        let (e, width) = slab(genes, &placed, genes.0[35] < 0.5)?;
        let plane = case.planes[0];
        let middle = placed.middle(e);
        let seen = placed.seen_at(plane.axes, plane.point, &middle, &width);
        let place = [
            f64::from(mean.x_um) / unit + more[0] / unit,
            f64::from(mean.y_um) / unit + more[1] / unit,
        ];
        let [nx, ny] = [plane.facet.x, plane.facet.y].map(f64::from);
        let clearance = facet_clearance_q14(
            plane.facet,
            plane.axes,
            plane.point != [0, 0],
            layout.unit(),
            layout.lever(),
        );
        let half = case.factor[2][0] * f64::from(width.in_u()) / 32_768.0;
        let half = if layout.lever() == 0 {
            0.0
        } else {
            half.min(0.5)
        };
        let [px, py] = plane.point.map(f64::from);
        let [ax, ay] = seen.arm.map(f64::from);
        let from = heading(&placed, e) + (genes.0[29] * 2.0 - 1.0) * 1.6e-9;
        let most = (-8..=8).map(|k| {
            let turn = f64::from(k) / 8.0 * half;
            let ((sin, cos), (s, c)) = ((from + turn).sin_cos(), turn.sin_cos());
            let (truth, coded) = match plane.axes {
                Axes::World => (
                    [
                        place[0] + cos * px - sin * py,
                        place[1] + sin * px + cos * py,
                    ],
                    [
                        f64::from(seen.point[0]) - ax + c * ax - s * ay,
                        f64::from(seen.point[1]) - ay + s * ax + c * ay,
                    ],
                ),
                Axes::Robot => {
                    let [x, y] = [place[0] - px, place[1] - py];
                    (
                        [cos * x + sin * y, cos * y - sin * x],
                        [c * ax + s * ay, c * ay - s * ax],
                    )
                }
            };
            nx * (truth[0] - coded[0]) + ny * (truth[1] - coded[1])
        });
        Some([clearance as f64, most.fold(f64::MIN, f64::max)])
    };
    searched(43, test_share(200, 1), of).report(&Row {
        name: "contain: rounding of the estimate and its point",
        unit: "2^-14 length units",
        looseness: None,
    });
}

/// A goal as a table stores it, and its heading: cosine and sine are each within one unit of 2^-30.
fn goal(random: &mut Random) -> (GoalFrame, f64) {
    let heading = random.within(0.0, TAU);
    let mut entry =
        |exact: f64| (exact * 1_073_741_824.0 + random.within(-0.5, 0.5)).round() as i32;
    let (cos_q30, sin_q30) = (entry(heading.cos()), entry(heading.sin()));
    let pose = Pose {
        x_um: 0,
        y_um: 0,
        yaw: BinaryAngle((heading / TAU * 4_294_967_296.0).round() as i64 as u32),
    };
    let goal = GoalFrame {
        pose,
        cos_q30,
        sin_q30,
    };
    (goal, heading)
}

/// The rows of the head of [`super`]: a set in the goal's axes, which are those of the cells.
#[test]
fn sets_in_the_axes_of_cells() {
    let mut random = Random::new(47);
    let (mut of_places, mut of_headings) = (Search::new(), Search::new());
    let (mut of_factors, mut of_scales) = (Search::new(), Search::new());
    for _ in 0..test_share(2_000_000, 200) {
        let (goal, turn) = goal(&mut random);
        let (s, c) = turn.sin_cos();
        // Up to 2^28 um from the goal, each to the nearest micrometre.
        let [x, y] = [0; 2].map(|_| random.log_within(1.0, 268e6) * random.sign());
        let [gx, gy] = [0; 2].map(|_| random.within(-0.5, 0.5));
        let yaw = random.within(-TAU, TAU);
        let pose = Pose {
            x_um: x.round() as i32,
            y_um: y.round() as i32,
            yaw: BinaryAngle::from_radians(yaw).unwrap(),
        };
        if let Some(found) = goal.pose_to_goal(pose) {
            let (x, y) = (x - gx, y - gy);
            let exact = [c * x + s * y, c * y - s * x];
            for (found, exact) in [found.x_um, found.y_um].into_iter().zip(exact) {
                of_places.case(2.42, (f64::from(found) - exact).abs());
            }
            let exact = (yaw - turn) / TAU * 4_294_967_296.0;
            let off = f64::from(found.yaw.0) - exact.rem_euclid(4_294_967_296.0);
            let off = off - (off / 4_294_967_296.0).round() * 4_294_967_296.0;
            of_headings.case(1.01, off.abs());
        }
        let mut row = || [0; 3].map(|_| (random.log_within(1.0, 268e6) * random.sign()) as i32);
        let factor = SqrtFactor {
            yaw: 1,
            x: row(),
            y: row(),
        };
        let scale_q16 = random.log_within(1e3, 4e6) as u32;
        let scale = f64::from(scale_q16) / 65_536.0;
        // A row's error along any unit vector is the length of the errors of its entries.
        let error = |of: [i32; 3], exact: [f64; 3]| {
            let squares = of
                .iter()
                .zip(exact)
                .map(|(of, exact)| (f64::from(*of) - exact).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let exact = |k: usize, x: &[i32; 3], y: &[i32; 3], times: f64| {
            let (x, y) = (f64::from(x[k]) * times, f64::from(y[k]) * times);
            [c * x + s * y, c * y - s * x]
        };
        let rotated = [0, 1, 2].map(|k| exact(k, &factor.x, &factor.y, 1.0));
        let found = factor.to_goal(&goal);
        of_factors.case(1.74, error(found.x, rotated.map(|v| v[0])));
        of_factors.case(1.74, error(found.y, rotated.map(|v| v[1])));
        let Some(scaled) = factor.scaled(scale_q16) else {
            continue;
        };
        // The scale's share alone: rotated exactly.
        let before = [0, 1, 2].map(|k| exact(k, &scaled.x, &scaled.y, 1.0));
        let after = [0, 1, 2].map(|k| exact(k, &factor.x, &factor.y, scale));
        for axis in 0..2 {
            let squares = before
                .iter()
                .zip(after)
                .map(|(a, b)| (a[axis] - b[axis]).powi(2));
            of_scales.case(1.23, squares.sum::<f64>().sqrt());
        }
    }
    for (search, name, unit) in [
        (of_places, "contain: estimate in the goal frame", "um"),
        (
            of_headings,
            "contain: heading above the goal's",
            "2^-32 turn",
        ),
        (
            of_factors,
            "contain: factor in the goal frame, of a row",
            "um",
        ),
        (of_scales, "contain: factor times a scale, of a row", "um"),
    ] {
        search.report(&Row {
            name,
            unit,
            looseness: None,
        });
    }
}
