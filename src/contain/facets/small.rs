//! Checks the steps of a facet's test on every input of a small number format, and at the limits of the
//! full one.
use super::*;
use crate::contain::exact::cases::Case;
use crate::contain::exact::random::{Random, extreme};
use crate::set::{PoseSet, SqrtFactor};
use crate::table::Table;
use crate::test_iterations;
use core::f64::consts::{FRAC_PI_2, TAU};

/// A heading of 0 at the goal, so that normals in both axes are the same, in a layout of one facet.
fn upright(axes: Axes, point: [i16; 2], factor: SqrtFactor) -> Case {
    Case {
        unit: 0,
        reach: 1,
        arm: 4,
        farthest: 0,
        axes,
        point,
        facet: Facet {
            x: 16_384,
            y: 0,
            b: 0,
        },
        goal: Pose::default(),
        mean: Pose::default(),
        extent: Extent::Gaussian(factor),
    }
}

/// Returns every row of three of these numbers, or a few of the rows under an interpreter.
fn rows(of: &[i32]) -> Vec<[i32; 3]> {
    let pairs = of.iter().flat_map(|a| of.iter().map(move |b| (*a, *b)));
    pairs
        .flat_map(|(a, b)| of.iter().map(move |c| [a, b, *c]))
        .step_by(test_iterations(1, 61) as usize)
        .collect()
}

/// Returns the least slack at which step 2 or 3 accepts.
fn least_spare(facet: &Facet, ready: &Ready<'_>, seen: &FramePoints) -> Option<i32> {
    let mut columns = None;
    let mut holds = |spare| holds_sharply(*facet, ready, seen, &mut columns, spare);
    let (mut low, mut high) = (-1, 0xffff);
    if !holds(high) {
        return None;
    }
    while high - low > 1 {
        let middle = (low + high) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(high)
}

/// Checks step 2 on all factors with entries up to 3: the accepted slack is at least `|F'a|`, in
/// integers, and at most one unit more for each part.
#[test]
fn step_2_is_exact_on_small_numbers() {
    let facets = [
        [16_384, 0],
        [0, -16_384],
        [9_830, 13_107],
        [-11_600, 11_600],
    ];
    let bytes = upright(Axes::World, [1, 0], factor(1, [0; 3], [0; 3])).bytes();
    let table = Table::parse(&bytes).unwrap();
    let layout = table.facets().unwrap();
    // 0.4 rad: levers of up to 4 turn into up to 2 units.
    let rows = rows(&[-3, -2, -1, 0, 1, 2, 3]);
    let mut count = 0u32;
    for x in &rows {
        for y in &rows {
            let set = PoseSet::of(Pose::default(), Extent::Gaussian(factor(1_068_000, *x, *y)));
            let ready = Ready::of(
                QuantizedPoseSet::of(layout, &set, Pose::default()).unwrap(),
                layout,
            );
            let ready = ready.unwrap();
            for [ax, ay] in facets {
                let facet = Facet { x: ax, y: ay, b: 0 };
                for (lever, turned) in [([0, 0], [0, 0]), ([4, 0], [2, 0]), ([-2, 3], [-1, 1])] {
                    let seen = FramePoints {
                        axes: Axes::World,
                        x: 0,
                        y: 0,
                        lever,
                        rest: 0,
                        bend: 0,
                    };
                    let [ax, ay] = [ax, ay].map(i64::from);
                    let part = |i: usize| {
                        let [lx, ly] = if i == 0 { turned } else { [0, 0] };
                        ax * (i64::from(x[i]) + lx) + ay * (i64::from(y[i]) + ly)
                    };
                    let exact: i64 = (0..3).map(|i| part(i) * part(i)).sum();
                    let up: i64 = (0..3)
                        .map(|i| part(i).abs() + (1 << 14))
                        .map(|v| v * v)
                        .sum();
                    let spare = i64::from(least_spare(&facet, &ready, &seen).unwrap());
                    assert!(
                        (spare * spare) << 28 >= exact,
                        "{x:?} {y:?} {facet:?} {lever:?}"
                    );
                    assert!(
                        spare == 0 || ((spare - 1) * (spare - 1)) << 28 < up,
                        "{x:?} {y:?} {facet:?} {lever:?} {spare}"
                    );
                    count += 1;
                }
            }
        }
    }
    assert_eq!(count, test_iterations(343 * 343, 6 * 6) * 12);
}

fn factor(yaw: i32, x: [i32; 3], y: [i32; 3]) -> SqrtFactor {
    SqrtFactor { yaw, x, y }
}

/// Returns the largest `g.u - f u1 (h.u)` over the ball, from below and to 1e-3: at a fixed u1 the rest
/// is a length.
fn largest(g: [f64; 3], h: [f64; 3], f: f64) -> f64 {
    let at = |phi: f64| {
        let (u1, rest) = phi.sin_cos();
        let [a, b, c] = [0, 1, 2].map(|i| g[i] - f * u1 * h[i]);
        a * u1 + rest * b.hypot(c)
    };
    const STEPS: i32 = 32;
    let step = 2.0 * FRAC_PI_2 / f64::from(STEPS);
    let place = |i: i32| -FRAC_PI_2 + f64::from(i) * step;
    let start = (0..=STEPS).max_by(|a, b| at(place(*a)).total_cmp(&at(place(*b))));
    let start = place(start.unwrap());
    let (mut low, mut high) = (start - step, start + step);
    for _ in 0..26 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if at(a) < at(b) {
            low = a;
        } else {
            high = b;
        }
    }
    // Beyond a quarter turn the root has the other sign and there is no u. An end of the interval is
    // equally good.
    at((0.5 * (low + high)).clamp(-FRAC_PI_2, FRAC_PI_2))
}

/// Checks steps 2 and 3 on a coarse set of factors of all sizes, with the largest bend.
#[test]
fn step_3_bounds_the_bend_on_coarse_numbers() {
    let facets = [[16_384, 0], [9_830, -13_107], [-11_600, -11_600]];
    let bytes = upright(Axes::Robot, [0, 0], factor(1, [0; 3], [0; 3])).bytes();
    let table = Table::parse(&bytes).unwrap();
    let layout = table.facets().unwrap();
    let rows = rows(&[-6600, -1700, 0, 401, 5000]);
    let (mut least, mut sharper, mut count) = (f64::INFINITY, 0u32, 0u32);
    // Half a radian (rounded up, it may not be more), and less.
    for yaw in [1_334_900, 700_000, 200_000, 30_000] {
        let f = f64::from(yaw) / 16_777_216.0 * TAU;
        for x in &rows {
            for y in &rows {
                let set = PoseSet::of(Pose::default(), Extent::Gaussian(factor(yaw, *x, *y)));
                let compact = QuantizedPoseSet::of(layout, &set, Pose::default())
                    .unwrap_or_else(|| panic!("{x:?} {y:?}"));
                let ready = Ready::of(compact, layout).unwrap();
                let frame = layout.pieces().next().unwrap().frames().next().unwrap();
                for lever in [[0, 0], [15_000, -8_000], [-2_500, 900]] {
                    let [ax, ay] = facets[count as usize % 3];
                    count += 1;
                    let facet = Facet { x: ax, y: ay, b: 0 };
                    let seen = FramePoints {
                        axes: Axes::Robot,
                        lever,
                        ..ready.seen(&frame)
                    };
                    let Some(spare) = least_spare(&facet, &ready, &seen) else {
                        panic!("never accepted: {x:?} {y:?} {lever:?}");
                    };
                    let [ax, ay] = [ax, ay].map(|v| f64::from(v) / 16_384.0);
                    let [lx, ly] = lever.map(|v| f64::from(ready.set.turned(v)));
                    let [x, y] = [x, y].map(|row| row.map(f64::from));
                    let mut g = [0, 1, 2].map(|i| ax * x[i] + ay * y[i]);
                    g[0] += ax * lx + ay * ly;
                    let h = [0, 1, 2].map(|i| ay * x[i] - ax * y[i]);
                    let exact = largest(g, h, f);
                    let slack = f64::from(spare) - exact;
                    assert!(
                        slack >= 0.0,
                        "{slack} {x:?} {y:?} {lever:?} {yaw} {facet:?}"
                    );
                    // Below r + |Q| the second-order bound accepts.
                    let length = |[a, b, c]: [f64; 3]| a.hypot(b).hypot(c);
                    if f64::from(spare) < length(g) + f * (length(h) + h[0].abs()) / 2.0 {
                        sharper += 1;
                        least = least.min(slack);
                    }
                }
            }
        }
    }
    std::println!("{count} cases, {sharper} by step 3, smallest slack there {least}");
    // Step 3 allows 16 units for its roundings, which need at most 12.
    assert!(cfg!(miri) || (4.0..18.0).contains(&least), "{least}");
    assert!(sharper > count / 4, "{sharper}");
}

/// At the limits of tables and sets, every number equals its value in unlimited width.
#[test]
fn numbers_fit_at_the_ends() {
    let mut random = Random(11);
    let (mut fitting, mut bent) = (0u32, 0u32);
    for _ in 0..test_iterations(400_000, 150) {
        let case = extreme(&mut random);
        let bytes = case.bytes();
        let table = Table::parse(&bytes).unwrap();
        let layout = table.facets().unwrap();
        let set = case.set();
        let Some(compact) = QuantizedPoseSet::of(layout, &set, case.goal) else {
            continue;
        };
        assert!(compact.broad <= (1 << 14) + 1);
        let Some(ready) = Ready::of(compact, layout) else {
            continue;
        };
        fitting += 1;
        let wide = |v: [i32; 2]| v.map(i64::from);
        let frame = layout.pieces().next().unwrap().frames().next().unwrap();
        let facet = case.facet;
        let seen = ready.seen(&frame);
        // The point.
        let [c, s] = wide([ready.set.common.cos_q15, ready.set.common.sin_q15]);
        let [vx, vy] = case.point.map(i64::from);
        let [mx, my] = wide([ready.set.x, ready.set.y]);
        let q15 = |v: i64| (v + (1 << 14)) >> 15;
        let place = match case.axes {
            Axes::World => [mx + q15(c * vx - s * vy), my + q15(s * vx + c * vy)],
            Axes::Robot => {
                let [dx, dy] = [mx - vx, my - vy];
                [q15(c * dx + s * dy), q15(c * dy - s * dx)]
            }
        };
        assert_eq!(wide([seen.x, seen.y]), place, "{case:?}");
        // The slack.
        let [ax, ay] = [facet.x, facet.y].map(i64::from);
        let exact = (i64::from(facet.b) << 14) - ax * place[0] - ay * place[1];
        assert_eq!(i64::from(spare(facet, &seen)), exact, "{case:?}");
        // The turn, and the terms beyond first order.
        let (f, fine) = (case.whole_turn(), f64::from(1u32 << ready.set.finer));
        for lever in seen.lever {
            let exact = f * f64::from(lever) * fine;
            let turned = ready.set.turned(lever);
            assert!(
                (f64::from(turned) - exact).abs() <= 1.2,
                "{turned} {exact} {case:?}"
            );
            assert!(turned.abs() <= (1 << 14) + 1, "{turned} {case:?}");
        }
        let across = f64::from(ready.broad) / fine;
        let (near, away, bend) = match (case.axes, case.is_disc()) {
            (Axes::World, _) => (0.0, 0.0, 0.0),
            (Axes::Robot, true) => (across, 0.0, 0.0),
            (Axes::Robot, false) => (0.0, across, f * f64::from(ready.broad)),
        };
        let rest = match case.axes {
            Axes::World if case.point == [0, 0] => 0.0,
            Axes::World => f * f / 2.0 * f64::from(case.arm),
            Axes::Robot => {
                9.0 / 16.0 * f * f * (f64::from(case.farthest) + near)
                    + 3.0 / 8.0 * f.powi(3) * (f64::from(case.lever()) + away)
            }
        } * fine;
        // Rounded up: by a few units of the square and the cube, 2^-15, times their factors.
        let more = 4.0 + rest * 1e-3 + 4.0 * fine * (f64::from(case.lever()) + 60_000.0) / 32_768.0;
        let found = f64::from(seen.rest);
        assert!(
            found >= rest && found <= rest + more,
            "{found} {rest} {case:?}"
        );
        let found = f64::from(seen.bend);
        assert!(
            found >= bend && found <= bend + 4.0,
            "{found} {bend} {case:?}"
        );
        // The extent.
        let Extent::Gaussian(factor) = case.extent else {
            continue;
        };
        let columns = ready.set.columns(factor.x, factor.y);
        assert!(columns.as_flattened().iter().all(|v| v.abs() <= 1 << 14));
        let normal = in_world(facet, case.axes, &ready);
        let [nx, ny] = wide(normal);
        let lever = wide(seen.lever.map(|v| ready.set.turned(v)));
        let lever = ax * lever[0] + ay * lever[1];
        let mut g = columns.map(wide).map(|[x, y]| nx * x + ny * y);
        g[0] += lever;
        let found = parts(normal, &columns, lever as i32);
        assert_eq!(found.map(i64::from), g, "{case:?}");
        let reach: i64 = g
            .iter()
            .map(|v| (v.abs() + (1 << 14) - 1) >> 14)
            .map(|v| v * v)
            .sum();
        assert!(reach < 1 << 32, "{reach} {case:?}");
        // Step 3, if it is used.
        if seen.bend == 0 {
            continue;
        }
        bent += 1;
        let nearest = |v: i64| (v + (1 << 13)) >> 14;
        let h = columns.map(wide).map(|[x, y]| nearest(ny * x - nx * y));
        let g = g.map(nearest);
        let radians = i64::from(ready.set.common.turn.radians_q15);
        let squares: i64 = h.iter().map(|v| v * v).sum();
        let above = i64::from(sqrt_upper(reach as u32));
        let root = ((reach / above + above) >> 1) + 1;
        assert!(root * root >= reach, "{root} {reach}");
        assert!(
            root <= reach.isqrt() + reach.isqrt() / 500 + 3,
            "{root} {reach}"
        );
        let product: i64 = h.iter().zip(g).map(|(h, g)| h * g).sum();
        let length = i64::from(sqrt_upper(squares as u32));
        let q = (((length + h[0].abs() + 8) * radians) >> 16) + 1;
        assert!(squares < 1 << 32 && (q - 1) << 16 < 1 << 32, "{case:?}");
        let (cosine, share) = ((g[0] << 14) / root, product / root);
        let of_32_bits = [
            g[0] << 14,
            product,
            cosine * share,
            ((cosine * share) >> 14) * radians,
        ];
        assert!(
            of_32_bits.iter().all(|v| i32::try_from(*v).is_ok()),
            "{case:?}"
        );
        // The answer itself, compared with wide numbers near the limit of acceptance.
        for spare in [
            root + q - 1,
            root + q,
            root,
            root - q / 2,
            root - q,
            root - 2 * q,
        ] {
            let spare = spare.clamp(0, 0xffff);
            let left = spare - root;
            let bend = (((cosine * share) >> 14) * radians) >> 15;
            let second = if root > 4 * q {
                2 * q * q / (root - 2 * q) + 1
            } else {
                i64::MAX - 16
            };
            let exact = left >= q || left + bend >= second + 16;
            let found = bends(
                normal,
                &columns,
                found,
                radians as i32,
                reach as u32,
                spare as i32,
            );
            assert_eq!(found, exact, "{spare} {case:?}");
        }
    }
    let most = [60_000, 10_000].map(|most| test_iterations(most, most / 4_000));
    assert!(fitting > most[0] && bent > most[1], "{fitting} {bent}");
}
