use super::slab::slope;
use super::*;
use std::f64::consts::TAU as WHOLE;
use std::vec::Vec;

/// A small generator: numbers in `[low, high)`.
pub(in crate::contain) struct Random(pub u64);

impl Random {
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        low + share * (high - low)
    }

    pub fn size(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }
}

/// A set, a facet and a point, all of which vary by orders of magnitude.
pub(in crate::contain) fn case(random: &mut Random) -> (Sweep, Facet, Axes, [i32; 2]) {
    let unit = random.within(0.0, 13.0) as u32;
    let scale = (1u64 << unit) as f64;
    let yaw = (random.size(1e-3, WHOLE) / WHOLE * ONE_TURN as f64) as u32;
    let broad = random.size(1.0, 30_000.0) * scale;
    let mut entry =
        |share: f64| (random.within(-share, share) * broad * 0.5 / scale * 16_384.0) as i32;
    let columns = [
        [entry(1.0), entry(1.0)],
        [entry(1.0), entry(0.2)],
        [entry(0.2), entry(0.5)],
    ];
    let around = random.size(2.0, 30_000.0);
    let mut place = || random.within(-around, around) as i32 / 2;
    let (x, y, point) = (place(), place(), [place(), place()]);
    let direction = random.within(0.0, WHOLE);
    let facet = Facet {
        x: (16_384.0 * direction.cos()).round() as i16,
        y: (16_384.0 * direction.sin()).round() as i16,
        b: 0,
    };
    let axes = if random.within(0.0, 1.0) < 0.5 {
        Axes::World
    } else {
        Axes::Robot
    };
    let squares = columns.iter().flatten().map(|v| f64::from(*v).powi(2));
    let broad = (squares.sum::<f64>().sqrt() / 16_384.0 * scale).ceil() as u32;
    let heading = BinaryAngle(random.within(0.0, 4.29e9) as u32);
    let sweep = Sweep {
        x,
        y,
        heading,
        facing: heading.cos_sin_q30(),
        yaw: yaw.max(1),
        turn: (i64::from(yaw.max(1))
            .wrapping_mul(TAU)
            .wrapping_add(1 << 19)
            >> 20) as i32,
        columns,
        radius: None,
        broad,
        unit,
        scaled: 0,
        movement: Movement::NONE,
    };
    (sweep, facet, axes, point)
}

/// Adds a random movement to a set, as [`Sweep::at`] does to a grown one.
pub(in crate::contain) fn moved(random: &mut Random, mut sweep: Sweep) -> Sweep {
    let scale = (1u64 << sweep.unit) as f64;
    let length = random.size(0.1, 15_000.0) * scale;
    let turn = random.size(1e-3, 0.3 * WHOLE) / WHOLE * ONE_TURN as f64;
    let by = match random.within(0.0, 3.0) as u32 {
        0 => Growth::new(length as u32, 0),
        1 => Growth::new(0, turn as u32),
        _ => Growth::new(length as u32, turn as u32),
    };
    let whole = f64::from(sweep.broad) + length;
    sweep.broad = whole.ceil() as u32;
    let fine = |um: f64| (um / scale * 16_384.0).ceil() as i32 + 2;
    sweep.movement = Movement {
        length: fine(f64::from(by.translation_um())),
        turn: (i64::from(by.yaw_q24()).wrapping_mul(TAU) >> 20) as i32 + 1,
        broad: fine(1.5 * whole),
        by,
    };
    sweep
}

/// The movement's length, fine units, and its turn, rad.
pub(in crate::contain) fn movement_of(sweep: &Sweep) -> [f64; 2] {
    let by = sweep.movement.by;
    let scale = (1u64 << sweep.unit) as f64;
    [
        f64::from(by.translation_um()) / scale * 16_384.0,
        f64::from(by.yaw_q24()) / ONE_TURN as f64 * WHOLE,
    ]
}

/// Returns a facet at a given u, by the definition in floats: `n . P - b` at the middle of the section, and the normal in world axes.
pub(in crate::contain) fn middle(
    sweep: &Sweep,
    facet: Facet,
    axes: Axes,
    point: [i32; 2],
    u: f64,
) -> (f64, [f64; 2]) {
    middle_turned(sweep, facet, axes, point, u, 0.0)
}

/// As above, after a turn by `swing`, rad.
pub(in crate::contain) fn middle_turned(
    sweep: &Sweep,
    facet: Facet,
    axes: Axes,
    point: [i32; 2],
    u: f64,
    swing: f64,
) -> (f64, [f64; 2]) {
    let fine = 16_384.0;
    let heading = swing
        + WHOLE
            * (f64::from(sweep.heading.0) / 4_294_967_296.0
                + f64::from(sweep.yaw) / ONE_TURN as f64 * u);
    let (s, c) = heading.sin_cos();
    let n = [f64::from(facet.x) / fine, f64::from(facet.y) / fine];
    let [f, ..] = sweep.columns.map(|column| column.map(f64::from));
    let place = [sweep.x, sweep.y].map(|v| f64::from(v) * fine);
    let v = point.map(|v| f64::from(v) * fine);
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let (normal, centre) = match axes {
        Axes::World => (
            n,
            dot(
                n,
                [
                    place[0] + c * v[0] - s * v[1],
                    place[1] + s * v[0] + c * v[1],
                ],
            ),
        ),
        Axes::Robot => {
            let normal = [c * n[0] - s * n[1], s * n[0] + c * n[1]];
            (normal, dot(normal, [place[0] - v[0], place[1] - v[1]]))
        }
    };
    let at_middle = centre + dot(normal, f) * u - f64::from(facet.b) * fine;
    (at_middle, normal)
}

/// Returns the reach of a section from its middle along a normal, at a given u.
pub(in crate::contain) fn across(sweep: &Sweep, normal: [f64; 2], u: f64) -> f64 {
    let [_, second, third] = sweep.columns.map(|column| column.map(f64::from));
    let dot = |a: [f64; 2]| a[0] * normal[0] + a[1] * normal[1];
    let whole = dot(second).hypot(dot(third));
    if sweep.radius.is_some() {
        whole
    } else {
        whole * (1.0 - u * u).max(0.0).sqrt()
    }
}

/// Returns the largest `n . P - b` at a given u, fine units.
fn truth(sweep: &Sweep, facet: Facet, axes: Axes, point: [i32; 2], u: f64) -> f64 {
    let [length, turn] = movement_of(sweep);
    let at = |swing: f64| {
        let (at_middle, normal) = middle_turned(sweep, facet, axes, point, u, swing);
        at_middle + across(sweep, normal, u) + length * normal[0].hypot(normal[1])
    };
    largest_turned(at, turn)
}

/// Returns the largest value found of a function over turns up to `turn` to either side.
pub(in crate::contain) fn largest_turned(at: impl Fn(f64) -> f64, turn: f64) -> f64 {
    if turn == 0.0 {
        return at(0.0);
    }
    let shares = (-4..=4).map(|k| f64::from(k) / 4.0 * turn);
    shares.map(at).fold(f64::MIN, f64::max)
}

/// Returns the largest value for u in an interval: a lower bound within a fine unit of lengths up to 2^24.
fn largest(case: &(Sweep, Facet, Axes, [i32; 2]), low: f64, high: f64) -> f64 {
    let (sweep, facet, axes, point) = case;
    largest_of(|u| truth(sweep, *facet, *axes, *point, u), low, high)
}

/// Returns the largest value found of a function on an interval.
pub(in crate::contain) fn largest_of(at: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let (mut best, mut value) = (low, f64::MIN);
    let mut step = (high - low) / 64.0;
    for k in 0..=64 {
        let u = low + step * f64::from(k);
        if at(u) > value {
            (best, value) = (u, at(u));
        }
    }
    for _ in 0..30 {
        for u in [best - step, best + step] {
            let u = u.clamp(low, high);
            if at(u) > value {
                (best, value) = (u, at(u));
            }
        }
        step *= 0.5;
    }
    value
}

/// Returns the least b, fine units, at which a slab is inside.
pub(in crate::contain) fn threshold(
    section: Section,
    sweep: &Sweep,
    e: i32,
    width: &Width,
) -> Option<i64> {
    let inside = |b: i64| {
        let raised = Section {
            left: section.left.wrapping_add(b),
            ..section
        };
        raised.slab(sweep, e, width) == Slab::Inside
    };
    let (mut low, mut high) = (-(1i64 << 32), 1i64 << 32);
    if !inside(high) {
        return None;
    }
    while high - low > 1 {
        let middle = (low + high) / 2;
        if inside(middle) {
            high = middle
        } else {
            low = middle
        }
    }
    Some(high)
}

#[test]
fn no_bound_of_a_slab_is_below_the_truth() {
    let mut random = Random(7);
    let mut excess = Vec::new();
    for number in 0..crate::test_iterations(20_000, 20) {
        let mut case = case(&mut random);
        if number % 2 == 0 {
            case.0 = moved(&mut random, case.0);
        }
        let (sweep, facet, axes, point) = case;
        let first = sweep.first_depth();
        let depth = first + random.within(0.0, 6.0) as u32;
        let width = sweep.width(depth);
        let index = random.within(0.0, f64::from(1u32 << depth)) as u32;
        let e = ((2 * index + 1) * width.in_u as u32) as i32 - (1 << U);
        let section = sweep.section(facet, axes, point, e);
        let Some(least) = threshold(section, &sweep, e, &width) else {
            panic!("{number}: no b is enough: {case:?}");
        };
        let [low, high] = [e - width.in_u, e + width.in_u].map(|end| f64::from(end) / 32_768.0);
        let most = largest(&case, low, high);
        assert!(
            least as f64 >= most,
            "{number}: {least} is enough, {most} is reached: {case:?} {depth} {e}"
        );
        excess.push(
            (least as f64 - most)
                / (1.0
                    + section.along[0]
                        .abs()
                        .max(section.g.abs())
                        .max(section.s.abs()) as f64),
        );
    }
    excess.sort_by(f64::total_cmp);
    std::println!(
        "excess over reach: median {:.5}, nine tenths {:.5}",
        excess[excess.len() / 2],
        excess[excess.len() * 9 / 10]
    );
}

#[test]
fn what_holds_is_inside_and_what_is_well_inside_holds() {
    let mut random = Random(11);
    let (mut accepted, mut missed, mut slabs_used) = (0u32, 0u32, 0u64);
    // The lost share of the reach: for turns of the movement up to 0.03 rad, up to 0.2 rad, and more.
    let mut grown = [Vec::new(), Vec::new(), Vec::new()];
    for number in 0..crate::test_share(20_000, 20) {
        let mut case = case(&mut random);
        let has_moved = number % 3 == 0;
        if has_moved {
            case.0 = moved(&mut random, case.0);
        }
        let most = largest(&case, -1.0, 1.0)
            .max(largest(&case, -1.0, 0.0))
            .max(largest(&case, 0.0, 1.0));
        // The reach: the largest value minus the estimate's own.
        let reach = most - largest(&case, 0.0, 1e-9);
        let b = most / 16_384.0;
        if !(b.abs() < 32_000.0) {
            continue;
        }
        for (b, is_inside) in [
            (b.ceil() - 1.0, false),
            (b + 0.01 * reach / 16_384.0 + 1.0, true),
        ] {
            if !(b.abs() < 32_700.0) {
                continue;
            }
            case.1.b = b as i16;
            let (sweep, facet, axes, point) = case;
            let mut slabs = 200;
            let holds = holds_at(
                &sweep,
                facet,
                axes,
                point,
                &sweep.width(sweep.first_depth()),
                &mut slabs,
            );
            if is_inside && has_moved {
                let at_offset = |b: i64| {
                    let mut slabs = 200;
                    let facet = Facet {
                        b: b as i16,
                        ..facet
                    };
                    let width = sweep.width(sweep.first_depth());
                    holds_at(&sweep, facet, axes, point, &width, &mut slabs)
                };
                let (mut low, mut high) = (i64::from(facet.b) - 2, 32_700);
                while high - low > 1 {
                    let middle = (low + high) / 2;
                    if at_offset(middle) {
                        high = middle;
                    } else {
                        low = middle;
                    }
                }
                let swing = f64::from(sweep.movement.by.yaw_q24()) / ONE_TURN as f64 * WHOLE;
                let (own, _) = middle(&sweep, Facet { b: 0, ..facet }, axes, point, 0.0);
                let excess = (high as f64 * 16_384.0 - most - 16_384.0).max(0.0) / (most - own);
                let group = usize::from(swing > 0.03) + usize::from(swing > 0.2);
                grown[group].push(excess);
            } else if is_inside {
                accepted += u32::from(holds);
                missed += u32::from(!holds);
                slabs_used += u64::from(200 - slabs);
            } else {
                assert!(!holds, "{number}: {case:?}");
            }
        }
    }
    let tried = accepted + missed;
    std::println!(
        "{accepted} of {tried} hold with 1 % to spare, {:.1} slabs",
        slabs_used as f64 / f64::from(tried)
    );
    assert!(
        f64::from(missed) <= 0.02 * f64::from(tried),
        "{missed} of {tried}"
    );
    for (excess, most) in grown.iter_mut().zip([0.01, 0.05, 0.3]) {
        excess.sort_by(f64::total_cmp);
        let at = |share: f64| excess[(excess.len() as f64 * share) as usize];
        let (median, most_of_nine) = (at(0.5), at(0.9));
        std::println!(
            "moved, {}: median {median:.4}, nine tenths {most_of_nine:.4}",
            excess.len()
        );
        assert!(cfg!(miri) || median <= most, "{median}");
    }
}

/// The cheapest test accepts no set that is outside, and every set that is far inside.
#[test]
fn what_holds_broadly_is_inside() {
    let mut random = Random(17);
    let (mut accepted, mut far) = (0u32, 0u32);
    let rounds = crate::test_share(20_000, 20);
    for number in 0..rounds {
        let mut case = case(&mut random);
        if number % 3 == 0 {
            let radius = (random.within(1.0, f64::from(case.0.broad) + 2.0)) as i32;
            case.0.radius = Some(radius);
            case.0.broad = radius as u32;
            case.0 = case.0.with_disc();
        } else if number % 3 == 1 {
            case.0 = moved(&mut random, case.0);
        }
        let broadly = case.0.broadly_at(case.2, case.3);
        let reach = broadly.moved as f64 / 16_384.0;
        let centre = largest(&case, 0.0, 1e-9) - across(&case.0, [1.0, 0.0], 0.0);
        for b in [
            centre / 16_384.0 + random.within(0.0, 1.2) * reach,
            4.0 * reach + centre / 16_384.0,
        ] {
            if !(b.abs() < 32_000.0) {
                continue;
            }
            case.1.b = b as i16;
            let holds = broadly.hold(case.1);
            let most = largest(&case, -1.0, 1.0)
                .max(largest(&case, -1.0, 0.0))
                .max(largest(&case, 0.0, 1.0));
            accepted += u32::from(holds);
            far += u32::from(!holds && most < -5.0 * reach * 16_384.0);
            assert!(!holds || most <= 0.0, "{number}: {most} {case:?}");
        }
    }
    std::println!("{accepted} accepted, {far} far ones are not");
    assert!(accepted > rounds / 20 && far == 0, "{accepted} {far}");
}

#[test]
fn slopes_are_within_their_error() {
    let mut random = Random(5);
    for round in 0..200_000 {
        let p = random.size(16.0, 2_147_483_000.0) as i64;
        let most = p as f64 * random.size(0.1, 2_000_000_000.0);
        let product = random.within(-1.0, 1.0) * most.min(1.1e18);
        let product = if round % 100 == 0 { 0 } else { product as i64 };
        let exact = product as f64 / p as f64;
        let off = (slope(product, p) as f64 - exact).abs();
        assert!(
            off <= exact.abs() / 16_384.0 + 2.0,
            "{product} / {p}: {off} of {exact}"
        );
    }
}

/// The bounds of a slab's width, each over its slab: sine and cosine of the heading, and the width of a normal that turns.
#[test]
fn no_bound_of_a_width_is_below_the_truth() {
    let one = ONE as f64;
    let mut random = Random(6);
    for _ in 0..400 {
        let (mut sweep, ..) = case(&mut random);
        sweep.yaw = (random.size(1e-4, WHOLE) / WHOLE * f64::from(ONE_TURN)) as u32 + 1;
        sweep.turn = (i64::from(sweep.yaw).wrapping_mul(TAU).wrapping_add(1 << 19) >> 20) as i32;
        let turn = f64::from(sweep.yaw) / f64::from(ONE_TURN) * WHOLE;
        let depth = sweep.first_depth() + random.within(0.0, 3.0) as u32;
        let width = sweep.width(depth);
        let w = turn / f64::from(1u32 << depth);
        let [kappa, rest, cos, shortening_rest] =
            [width.kappa, width.rest, width.cos, width.shortening_rest].map(|v| f64::from(v) / one);
        let [sine_square, leaning, leaning_rest] =
            [width.sine_square, width.leaning, width.leaning_rest].map(|v| f64::from(v) / one);
        let [shortening, versine] =
            [width.shortening(), width.versine()].map(|v| f64::from(v) / one);
        for step in -200..=200 {
            let y = f64::from(step) / 200.0;
            let t = w * y;
            // The slack covers the rounding of kappa.
            assert!((t.sin() - kappa * t).abs() <= rest + 2e-8, "S: {w} {y}");
            assert!(
                (y * t.cos() - y * (1.0 - shortening)).abs() <= shortening_rest,
                "G: {w} {y}"
            );
            assert!(
                ((2.0 * t).sin() / 2.0 - leaning * y).abs() <= leaning_rest,
                "sin 2t: {w} {y}"
            );
            assert!(t.sin().powi(2) <= sine_square && cos <= t.cos(), "{w} {y}");
        }
        assert!(versine <= 1.0 - w.cos(), "{w}");
        // No bound is more than twice the required value.
        let most = |f: &dyn Fn(f64) -> f64| {
            let at = (-200..=200).map(|step| f(f64::from(step) / 200.0).abs());
            at.fold(0.0, f64::max)
        };
        let short = most(&|y| y * (w * y).cos() - y * (1.0 - shortening));
        assert!(
            shortening_rest <= 2.0 * short + 1e-7,
            "{w}: {shortening_rest} of {short}"
        );
    }
}
