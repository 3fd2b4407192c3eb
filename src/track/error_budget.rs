//! The rows of the tracker's error budget, each searched for its worst case.

use super::increment::{Excess, Increment, Step};
use super::model::Noise;
use super::way::{Way, along_arc};
use super::*;
use crate::error_budget::{Exact, Random, Row, Search};
use crate::test_share;
use core::f64::consts::{PI, TAU};

/// Radians of 2^-24 turn.
const Q24: f64 = TAU / 16_777_216.0;

fn increment(by: [f64; 3]) -> Increment {
    Increment::of(by[0], by[1], by[2], [0, 1]).expect("a short movement")
}

/// One increment of floats: each entry to the nearest unit.
#[test]
fn rounding_of_an_increment() {
    let mut random = Random::new(1);
    let (mut length, mut turn) = (Search::new(), Search::new());
    let units_per_radian = Exact::int(1u64 << 32).div(&(&Exact::pi() + &Exact::pi()));
    for _ in 0..test_share(50_000, 20) {
        // Near to a half of a unit, and anywhere.
        let near = random.within(-0.01, 0.01);
        let unit = |size: f64| size.round() + 0.5 + near;
        let size = random.log_within(1.0, 1e9) * random.sign();
        let ahead = unit(size) / 256e6;
        let angle = unit(random.log_within(1.0, 5e8) * random.sign()) / 4_294_967_296.0 * TAU;
        let [x, _, t] = increment([ahead, 0.0, angle]).entries();
        let off = &Exact::int(x) - &(&Exact::float(ahead) * &Exact::int(256_000_000));
        length.case(0.5, off.abs().to_f64());
        let off = &Exact::int(t) - &(&Exact::float(angle) * &units_per_radian);
        turn.case(0.5 + 1e-6, off.abs().to_f64());
    }
    length.report(&Row {
        name: "track: an increment's length, rounded",
        unit: "2^-8 um",
        looseness: None,
    });
    turn.report(&Row {
        name: "track: an increment's turn, rounded",
        unit: "2^-32 turn",
        looseness: None,
    });
}

/// The true path of increments of floats, world axes: metres and radians.
struct TruePath {
    place: [Exact; 2],
    yaw: Exact,
}

impl TruePath {
    fn at(yaw: &BinaryAngle) -> Self {
        let unit = &Exact::pi() * &Exact::dyadic(1, 31);
        Self {
            place: [Exact::int(0), Exact::int(0)],
            yaw: &Exact::int(yaw.0) * &unit,
        }
    }

    /// Adds an increment whose left movement is none.
    fn add(&mut self, by: [f64; 3]) {
        let [c, s] = self.yaw.cos_sin();
        let [dx, dy, turn] = by.map(Exact::float);
        let [x, y] = &self.place;
        self.place = [
            &(x + &(&c * &dx)) - &(&s * &dy),
            &(y + &(&s * &dx)) + &(&c * &dy),
        ];
        self.yaw = &self.yaw + &turn;
    }

    /// Returns how far a path is from the true one, micrometres.
    fn apart(&self, way: &Way, yaw: BinaryAngle) -> f64 {
        let found = way.in_world(yaw.cos_sin_q30());
        let off = |exact: &Exact, found: i64| {
            (&(exact * &Exact::int(1_000_000)) - &Exact::int(found)).to_f64()
        };
        let [x, y] = &self.place;
        off(x, found[0]).hypot(off(y, found[1]))
    }
}

/// Up to a minute of a thousand increments a second.
fn many(round: u32) -> u32 {
    let all = if std::env::var_os("POSEGATE_DEEP").is_some() {
        [1_000, 12_000, 60_000]
    } else {
        [100, 1_000, 6_000]
    };
    if cfg!(miri) {
        4
    } else {
        all[round as usize % 3]
    }
}

/// Many short increments whose roundings, before and after the turn to the axes of the fix, all err to the same side.
#[test]
fn rounding_of_short_increments() {
    let mut random = Random::new(2);
    let mut search = Search::new();
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    for round in 0..test_share(15, 1) {
        let mut way = Way::new(&noise);
        let yaw_at_fix = BinaryAngle((random.unit() * 4_294_967_296.0) as u32);
        let mut path = TruePath::at(&BinaryAngle(0));
        // Errors, 2^-8 um, along a direction.
        let (s, c) = random.within(-PI, PI).sin_cos();
        for _ in 0..many(round) {
            let units = random.log_within(1.0, 300.0).round();
            let turn = random.log_within(1.0, 5e8).round() * random.sign();
            let mut best: Option<(f64, Way, [f64; 3])> = None;
            for sides in [
                [0.499, 0.499],
                [0.499, -0.499],
                [-0.499, 0.499],
                [-0.499, -0.499],
            ] {
                let by = [
                    (units + sides[0]) / 256e6,
                    sides[1] / 256e6,
                    turn / 4_294_967_296.0 * TAU,
                ];
                let mut tried = way;
                tried.add(
                    &increment(by).step,
                    increment(by).step.driven(Excess::NONE),
                    1,
                    &noise,
                );
                let (sin, cos) = (f64::from(way.turn()) / 4_294_967_296.0 * TAU).sin_cos();
                let [x, y] = [by[0], by[1]].map(|v| v * 256e6);
                let ([x0, y0], [x1, y1]) = (way.place_q8(), tried.place_q8());
                let [x1, y1] = [(x1 - x0) as f64, (y1 - y0) as f64];
                let off = c * (cos * x - sin * y - x1) + s * (sin * x + cos * y - y1);
                if best.as_ref().is_none_or(|(most, ..)| off > *most) {
                    best = Some((off, tried, by));
                }
            }
            let (_, next, by) = best.unwrap();
            way = next;
            path.add(by);
        }
        // The path is turned once: the true one stands in the axes of the fix.
        let bound = way.slip(&noise);
        let [x, y] = &path.place;
        let start = &Exact::int(yaw_at_fix.0) * &(&Exact::pi() * &Exact::dyadic(1, 31));
        let [cos, sin] = start.cos_sin();
        path.place = [&(&cos * x) - &(&sin * y), &(&sin * x) + &(&cos * y)];
        search.case(
            f64::from(bound.translation_um()),
            path.apart(&way, yaw_at_fix),
        );
    }
    search.report(&Row {
        name: "track: roundings of lengths, end of the path",
        unit: "um",
        looseness: None,
    });
}

/// How far off the end is, the entry with what was driven besides, its exact end, and the bounds of all that was driven.
type Tried = (f64, (Step, Excess), [f64; 2], [u32; 2]);

/// Short increments that the ring keeps as one, whose roundings all err to the same side. What was driven is counted for each.
#[test]
fn rounding_of_increments_kept_as_one() {
    let mut random = Random::new(32);
    let mut search = Search::new();
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    for round in 0..test_share(300, 3) {
        let mut way = Way::new(&noise);
        let (s, c) = random.within(-PI, PI).sin_cos();
        // Units of 2^-8 um, the exact path of the odometry's numbers.
        let (mut x, mut y, mut heading) = (0.0, 0.0, 0.0f64);
        let longest = random.log_within(10.0, 1e6);
        for _ in 0..many(round) / 8 {
            let mut entry: Option<(Step, Excess)> = None;
            let mut each = [0u32; 2];
            let from = heading;
            for _ in 0..8 {
                let units = random.log_within(1.0, longest).round();
                let turn = random.log_within(1.0, 1e6).round() * random.sign();
                let (sin, cos) = heading.sin_cos();
                let mut best: Option<Tried> = None;
                for sides in [
                    [0.499, 0.499],
                    [0.499, -0.499],
                    [-0.499, 0.499],
                    [-0.499, -0.499],
                ] {
                    let [dx, dy] = [units + sides[0], sides[1]];
                    let angle = turn / 4_294_967_296.0 * TAU;
                    let step = increment([dx / 256e6, dy / 256e6, angle]).step;
                    let driven = step.driven(Excess::NONE);
                    let all = [0, 1].map(|k| each[k] + driven[k]);
                    let both = entry.map_or((step, Excess::NONE), |(entry, _)| {
                        entry.and(&step, all).expect("short ones")
                    });
                    let place = [x + cos * dx - sin * dy, y + sin * dx + cos * dy];
                    // The entry is turned to the axes of the fix.
                    let (sin, cos) = from.sin_cos();
                    let [ex, ey] = [both.0.x_q8, both.0.y_q8].map(f64::from);
                    let [wx, wy] = way.place_q8().map(|v| v as f64);
                    let off = c * (place[0] - wx - cos * ex + sin * ey)
                        + s * (place[1] - wy - sin * ex - cos * ey);
                    if best.as_ref().is_none_or(|(most, ..)| off > *most) {
                        best = Some((off, both, place, all));
                    }
                }
                let (_, both, place, all) = best.unwrap();
                (entry, [x, y]) = (Some(both), place);
                heading += turn / 4_294_967_296.0 * TAU;
                each = all;
            }
            let (entry, excess) = entry.unwrap();
            let [length, turned] = entry.driven(excess);
            assert!(length >= each[0] && turned >= each[1], "{entry:?} {each:?}");
            way.add(&entry, entry.driven(excess), 8, &noise);
        }
        let bound = way.slip(&noise);
        let [found_x, found_y] = way.place_q8().map(|v| v as f64);
        search.case(
            f64::from(bound.translation_um()),
            (x - found_x).hypot(y - found_y) / 256.0,
        );
    }
    search.report(&Row {
        name: "track: roundings of increments kept as one, end of the path",
        unit: "um",
        looseness: None,
    });
}

/// Many turns on the spot that all err to the same side, then a long way.
#[test]
fn rounding_of_turns() {
    let mut random = Random::new(9);
    let (mut place, mut heading) = (Search::new(), Search::new());
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    let unit = &Exact::pi() * &Exact::dyadic(1, 31);
    for round in 0..test_share(15, 1) {
        let mut way = Way::new(&noise);
        let yaw_at_fix = BinaryAngle((random.unit() * 4_294_967_296.0) as u32);
        let mut path = TruePath::at(&yaw_at_fix);
        let (units, metres) = (random.log_within(1.0, 5e8), random.log_within(0.1, 4.0));
        let count = many(round);
        for k in 0..count + 20 {
            let by = if k < count {
                let turn = random.sign() * units.round() + 0.499;
                [0.0, 0.0, turn / 4_294_967_296.0 * TAU]
            } else {
                [metres, 0.0, 0.0]
            };
            way.add(
                &increment(by).step,
                increment(by).step.driven(Excess::NONE),
                1,
                &noise,
            );
            if k < count {
                path.yaw = &path.yaw + &Exact::float(by[2]);
            } else {
                path.add(by);
            }
        }
        let bound = way.slip(&noise);
        place.case(
            f64::from(bound.translation_um()),
            path.apart(&way, yaw_at_fix),
        );
        let turned = &path.yaw - &(&Exact::int(yaw_at_fix.0) * &unit);
        let off = &turned - &(&Exact::int(way.turn()) * &unit);
        // Of one turn, as the reported heading is.
        let off = off.to_f64() - TAU * (off.to_f64() / TAU).round();
        heading.case(f64::from(bound.yaw_q24()) * Q24, off.abs());
    }
    place.report(&Row {
        name: "track: roundings of turns, end of the path",
        unit: "um",
        looseness: None,
    });
    heading.report(&Row {
        name: "track: roundings of turns, heading",
        unit: "rad",
        looseness: None,
    });
}

/// The length of a path whose direction leaves the range between its ends by 0.014 rad: what it is longer than its chord.
#[test]
fn length_of_an_increment() {
    let mut random = Random::new(3);
    let (mut other, mut arc) = (Search::new(), Search::new());
    for _ in 0..test_share(20_000, 20) {
        let turn = random.log_within(1e-4, PI / 4.0) * random.sign();
        let chord = random.log_within(1e-3, 4.0);
        let aside = random.within(-PI, PI);
        let [x, y] = [chord * aside.cos(), chord * aside.sin()];
        let Step {
            x_q8,
            y_q8,
            turn: units,
            ..
        } = increment([x, y, turn]).step;
        let chord = Exact::int(i64::from(x_q8).pow(2) + i64::from(y_q8).pow(2)).sqrt();
        let bound =
            f64::from(increment([x, y, turn]).step.driven(Excess::NONE)[0]) - chord.to_f64();
        let half = Exact::dyadic(units, 32);
        let half = (&half * &Exact::pi()).abs();
        // Two straight legs, at half of the range to either side of the chord.
        let range = &half + &Exact::float(0.007);
        let [c, _] = range.cos_sin();
        let longer = &chord.div(&c) - &chord;
        other.case(bound, longer.to_f64());
        let [_, s] = half.cos_sin();
        let length = &(&chord * &half).div(&s) - &chord;
        arc.case(bound, length.to_f64());
    }
    other.report(&Row {
        name: "track: length of two legs, above its chord",
        unit: "2^-8 um",
        looseness: None,
    });
    arc.report(&Row {
        name: "track: length of an arc, above its chord",
        unit: "2^-8 um",
        looseness: Some("the bound holds for other paths than arcs: the row before"),
    });
}

/// The noise of the heading along an arc, of which the model adds less for a straight line: the variance that is needed in the plane.
#[test]
fn noise_along_an_arc() {
    let mut random = Random::new(4);
    let mut search = Search::new();
    for _ in 0..test_share(20_000, 20) {
        let turn = random.log_within(1e-3, PI / 4.0);
        let metres = random.log_within(0.01, 4.0);
        let q = random.log_within(1e9, 1e14).round();
        let length_q8 = (metres * 256e6) as u32;
        let turn_q24 = (turn / Q24) as u32;
        let [p, h] = along_arc(length_q8, turn_q24, q as i64).map(|v| v as f64);
        // An arc of this turn and length: its chord c, the means and variances of the lever to its end in closed form.
        let t = Exact::float(f64::from(turn_q24) * Q24);
        let radius = Exact::float(f64::from(length_q8) / 256.0).div(&t);
        let half = &t * &Exact::dyadic(1, 1);
        let [_, sin] = half.cos_sin();
        let [_, sin_t] = t.cos_sin();
        let [cos_half, _] = half.cos_sin();
        let chord = &(&radius * &sin) + &(&radius * &sin);
        // Heights above the chord: radius (cos(phi) - cos(half)), phi from -half to half.
        let mean_cos = sin.div(&half);
        let mean_cos2 = &Exact::dyadic(1, 1) + &sin_t.div(&(&t + &t));
        let mean = &radius * &(&mean_cos - &cos_half);
        let across = &(&radius * &radius) * &(&mean_cos2 - &(&mean_cos * &mean_cos));
        let along = &(&radius * &radius) * &(&Exact::int(1) - &mean_cos2);
        // With u the lever: the exact matrix is q ((V + b b', b), (b', 1)), the model's q ((c^2 / 2, c / 2), (c / 2, 1)) along the chord.
        // Needed: p >= mean^2 + across + (mean c / 2)^2 / (c^2 / 4 - along) + mean^2 / h, everything times q, in radians.
        let square = |v: &Exact| v * v;
        let chord_half = &chord * &Exact::dyadic(1, 1);
        let rest = &square(&chord_half) - &along;
        let cross = square(&(&mean * &chord_half)).div(&rest);
        let share = Exact::float(h / q);
        let needed = &(&(&square(&mean) + &across) + &cross) + &square(&mean).div(&share);
        let needed = needed.to_f64() * q * Q24 * Q24;
        search.case(p, needed);
    }
    search.report(&Row {
        name: "track: noise of a heading along an arc, in the plane",
        unit: "um^2",
        looseness: None,
    });
}

/// Returns what is added to the entry on the diagonal of each row, and the errors of the row's other entries. `exact` has xx, yy, yaw-yaw, xy, x-yaw
/// and y-yaw.
fn row_errors(found: &PathNoise, exact: &[Exact; 6]) -> [[f64; 2]; 3] {
    let found = [found.xx, found.yy, found.tt, found.xy, found.xt, found.yt];
    let off: [f64; 6] = core::array::from_fn(|k| (&Exact::int(found[k]) - &exact[k]).to_f64());
    [[0, 3, 4], [1, 3, 5], [2, 4, 5]]
        .map(|[own, one, other]| [off[own], off[one].abs() + off[other].abs()])
}

/// Products and sums of the carried noise: the errors of a row of the matrix.
#[test]
fn rounding_of_carried_noise() {
    let mut random = Random::new(5);
    let mut search = Search::new();
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    let turn = &Exact::pi() + &Exact::pi();
    // The largest error is climbed to by changes of the last digits.
    let mut best: Option<(f64, PathNoise, Step)> = None;
    for round in 0..test_share(100_000, 20) {
        let size = random.log_within(1.0, 1e7);
        let other = random.log_within(1.0, 1e7);
        let mut entry = |a: f64, b: f64| (random.within(-1.0, 1.0) * a * b) as i64;
        let mut start = PathNoise {
            xx: entry(size, size).abs() + 1,
            xy: entry(size, size) / 2,
            yy: entry(size, size).abs() + 1,
            xt: entry(size, other) / 2,
            yt: entry(size, other) / 2,
            tt: entry(other, other).abs() + 1,
        };
        let length = random.log_within(1.0, 1_073_741_824.0);
        let mut step = Step {
            x_q8: (random.within(-1.0, 1.0) * length) as i32,
            y_q8: (random.within(-1.0, 1.0) * length) as i32,
            turn: 0,
            stamp_ms: 0,
        };
        if let Some((_, noise, at)) = &best
            && round % 5_000 > 500
        {
            let reach = random.log_within(1.0, 1e6);
            let mut by = || (random.within(-1.0, 1.0) * reach) as i64;
            start = PathNoise {
                xx: noise.xx,
                xy: noise.xy,
                yy: noise.yy,
                xt: noise.xt + by(),
                yt: noise.yt + by(),
                tt: (noise.tt + by()).max(1),
            };
            let limited = |v: i64| v.clamp(-(1 << 30), 1 << 30) as i32;
            step.x_q8 = limited(i64::from(at.x_q8) + by() / 1_000);
            step.y_q8 = limited(i64::from(at.y_q8) + by() / 1_000);
        } else if round % 5_000 == 0 {
            best = None;
        }
        let mut way = Way::new(&noise).with_noise(start);
        way.add(&step, step.driven(Excess::NONE), 1, &noise);
        let [plane, own] = noise.variances(step.driven(Excess::NONE)[0], 0, 1);
        let [p, h] = along_arc(step.driven(Excess::NONE)[0], 0, own);
        let [x, y] = way.place_q8();
        let lever = |q8: i64| &(&turn * &Exact::int(q8)) * &Exact::dyadic(1, 32);
        let (a, b) = (lever(-y), lever(x));
        let n = |v: i64| Exact::int(v);
        let halfway = n(start.tt + (own >> 1));
        let twice = |v: &Exact| v + v;
        let [xt, yt] = [n(start.xt), n(start.yt)];
        let exact = [
            &(&n(start.xx + plane + p) + &twice(&(&a * &xt))) + &(&(&a * &a) * &halfway),
            &(&n(start.yy + plane + p) + &twice(&(&b * &yt))) + &(&(&b * &b) * &halfway),
            n(start.tt + own + h),
            &(&n(start.xy) + &(&(&a * &yt) + &(&b * &xt))) + &(&(&a * &b) * &halfway),
            &xt + &(&a * &halfway),
            &yt + &(&b * &halfway),
        ];
        // Half of an odd variance stands for the whole.
        let rows = row_errors(&way.noise_of_path(), &exact);
        let most = way::ROUNDED as f64;
        let worst = rows
            .map(|[own, others]| most - own + others)
            .into_iter()
            .fold(f64::NEG_INFINITY, f64::max);
        search.case(most, worst);
        if best.as_ref().is_none_or(|(least, ..)| worst >= *least) {
            best = Some((worst, start, step));
        }
    }
    search.report(&Row {
        name: "track: roundings of the carried noise, of a row",
        unit: "um^2, um 2^-24 turn, 2^-48 turn^2",
        looseness: None,
    });
}

/// Noise that is turned into world axes: the entry on the diagonal that its row of errors needs.
#[test]
fn noise_in_world_axes() {
    let mut random = Random::new(13);
    let mut search = Search::new();
    for _ in 0..test_share(50_000, 20) {
        let size = random.log_within(1.0, 5e8);
        let other = random.log_within(1.0, 1e7);
        let mut row = |size: f64| [0; 3].map(|_| random.within(-1.0, 1.0) * size);
        let noise = tests::noise_of_rows([row(size), row(size), row(other)]);
        let yaw = BinaryAngle((random.unit() * 4_294_967_296.0) as u32);
        let found = turned(&noise, yaw.cos_sin_q30());
        let half_turns = &Exact::pi() * &Exact::dyadic(1, 31);
        let [c, s] = (&half_turns * &Exact::int(yaw.0)).cos_sin();
        let n = |v: i64| Exact::int(v);
        let [xx, xy, yy] = [noise.xx, noise.xy, noise.yy].map(n);
        let (cc, ss, cs) = (&c * &c, &s * &s, &c * &s);
        let twice = &(&cs * &xy) + &(&cs * &xy);
        let exact = [
            &(&(&cc * &xx) - &twice) + &(&ss * &yy),
            &(&(&ss * &xx) + &twice) + &(&cc * &yy),
            n(noise.tt),
            &(&(&cs * &xx) - &(&cs * &yy)) + &(&(&cc - &ss) * &xy),
            &(&c * &n(noise.xt)) - &(&s * &n(noise.yt)),
            &(&s * &n(noise.xt)) + &(&c * &n(noise.yt)),
        ];
        for [own, others] in row_errors(&found, &exact) {
            // An entry that is smaller than the exact one has no bound at all.
            search.case(own.max(0.0), others);
        }
    }
    search.report(&Row {
        name: "track: noise in world axes, of a row",
        unit: "um^2, um 2^-24 turn, 2^-48 turn^2",
        looseness: None,
    });
}

/// The circle of a wrong heading leaves its tangent, for every heading's error.
#[test]
fn curvature_of_a_heading_error() {
    let mut random = Random::new(6);
    let mut search = Search::new();
    let radius_squared = RadiusSquared::from_q16(743_499).unwrap();
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    let step = increment([2.0, 0.5, 0.0]).step;
    for round in 0..test_share(20_000, 20) {
        let mut way = Way::new(&noise);
        for _ in 0..1 + round % 20 {
            way.add(&step, step.driven(Excess::NONE), 1, &noise);
        }
        let reach = random.log_within(0.003, 30.0);
        let tt = reach * reach / 743_499.0 * 65_536.0;
        let bound = way.curvature(
            &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, tt]],
            radius_squared,
        );
        // The largest turn of the set, by the exact numbers that describe it.
        let square = (&Exact::float(tt) * &Exact::int(743_499)).div(&Exact::int(65_536));
        let t = square.sqrt();
        let [c, s] = t.cos_sin();
        let (aside, along) = (&Exact::int(1) - &c, &t - &s);
        let apart = (&(&aside * &aside) + &(&along * &along)).sqrt();
        let [x, y] = way.place_q8();
        let [x, y] = [x, y].map(Exact::int);
        let chord = (&(&x * &x) + &(&y * &y)).sqrt();
        let um = &(&chord * &apart) * &Exact::dyadic(1, 8);
        if bound.translation_um() < crate::pose::REACH_UM {
            search.case(f64::from(bound.translation_um()), um.to_f64());
        }
    }
    search.report(&Row {
        name: "track: curvature of a heading's error",
        unit: "um",
        looseness: None,
    });
}

/// A bounded error of the heading swings the whole path.
#[test]
fn swing_of_a_heading_error() {
    let mut random = Random::new(7);
    let mut search = Search::new();
    let noise = Noise::of(&OdometryErrors::NONE).unwrap();
    for _ in 0..test_share(20_000, 20) {
        let mut way = Way::new(&noise);
        let step = increment([random.log_within(1e-4, 4.0), 0.0, 0.0]).step;
        for _ in 0..(random.log_within(1.0, 50.0) as u32) {
            way.add(&step, step.driven(Excess::NONE), 1, &noise);
        }
        let turn = random.log_within(1.0, 16_777_216.0) as i32;
        let half = &Exact::dyadic(turn, 24) * &Exact::pi();
        let [_, s] = half.cos_sin();
        let [x, _] = way.place_q8();
        let chord = &(&s + &s) * &Exact::dyadic(x, 8);
        search.case(f64::from(way.swung(turn)), chord.abs().to_f64());
    }
    search.report(&Row {
        name: "track: swing of the path by a bounded turn",
        unit: "um",
        looseness: None,
    });
}

/// The part of an increment after a fix, if the robot moved as unevenly as its bounds allow.
#[test]
fn part_of_an_increment_after_a_fix() {
    let mut random = Random::new(8);
    let (mut place, mut heading) = (Search::new(), Search::new());
    for _ in 0..test_share(100_000, 20) {
        let whole = 2 + (random.unit() * 400.0) as u32;
        let after = 1 + (random.unit() * f64::from(whole - 1)) as u32;
        let (speed, rate) = (random.log_within(0.05, 2.0), random.log_within(0.01, 1.5));
        let bounds = MotionBounds::new(speed, 0.0, rate).unwrap();
        let settings = TrackerSettings {
            errors: OdometryErrors::NONE,
            bounds,
            trust: Trust::FULL,
            radius_squared: RadiusSquared::from_q16(743_499).unwrap(),
            maximum_gap_ms: 1_000,
            maximum_fix_age_ms: 1_000,
        };
        // Stamps are rounded down: true times are up to a millisecond later.
        let times = [0, whole - after, whole].map(|ms| f64::from(ms) + random.within(0.0, 0.999));
        let seconds = [times[1] - times[0], times[2] - times[1]].map(|ms| ms.max(0.0) * 1e-3);
        // As fast as possible in two directions and turns.
        let extreme = |random: &mut Random, seconds: f64| {
            let turn = rate * seconds * [-1.0, 1.0, 0.0][(random.unit() * 3.0) as usize];
            let way = random.within(-PI, PI);
            let length = speed
                * seconds
                * if turn == 0.0 {
                    1.0
                } else {
                    (turn / 2.0).sin() / (turn / 2.0)
                };
            let along = way + turn / 2.0;
            [length * along.cos(), length * along.sin(), turn]
        };
        let first = extreme(&mut random, seconds[0]);
        let second = extreme(&mut random, seconds[1]);
        let (s, c) = first[2].sin_cos();
        let sum = [
            first[0] + c * second[0] - s * second[1],
            first[1] + s * second[0] + c * second[1],
            first[2] + second[2],
        ];
        let mut tracker = Tracker::<4>::new(settings).unwrap();
        let at = |ms: u32| 5_000 + ms;
        let still = Increment::of(0.0, 0.0, 0.0, [at(0); 2]).unwrap();
        tracker.odometry(still).unwrap();
        let read = Increment::of(sum[0], sum[1], sum[2], [at(0), at(whole)]).unwrap();
        tracker.odometry(read).unwrap();
        let fix = tests::fix(
            [0.0; 3],
            [[1e-8, 0.0, 0.0], [0.0, 1e-8, 0.0], [0.0, 0.0, 1e-8]],
            at(whole - after),
        );
        tracker.fix(&fix).unwrap();
        let way = tracker.fix.unwrap().way;
        let [x, y] = way
            .in_world(BinaryAngle(0).cos_sin_q30())
            .map(|um| um as f64 * 1e-6);
        let bound = way.slip(&tracker.noise);
        let off = f64::hypot(second[0] - x, second[1] - y);
        place.case(f64::from(bound.translation_um()) * 1e-6, off);
        let turn = f64::from(way.turn() as i32) / 4_294_967_296.0 * TAU;
        heading.case(f64::from(bound.yaw_q24()) * Q24, (second[2] - turn).abs());
    }
    place.report(&Row {
        name: "track: part of an increment after a fix, place",
        unit: "m",
        looseness: None,
    });
    heading.report(&Row {
        name: "track: part of an increment after a fix, turn",
        unit: "rad",
        looseness: None,
    });
}
