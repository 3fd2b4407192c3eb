use super::*;
use std::f64::consts::TAU as WHOLE;
use std::vec::Vec;

/// A small generator: numbers in `[low, high)`.
struct Random(u64);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let share = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        low + share * (high - low)
    }

    fn size(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }
}

/// A set, a facet and a point, all of which vary by orders of magnitude.
fn case(random: &mut Random) -> (Sweep, Facet, Axes, [i32; 2]) {
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
    let broad = (squares.sum::<f64>().sqrt() / 16_384.0 * scale).ceil() as i64;
    let sweep = Sweep {
        x,
        y,
        heading: BinaryAngle(random.within(0.0, 4.29e9) as u32),
        yaw: yaw.max(1),
        turn: i64::from(yaw.max(1))
            .wrapping_mul(TAU)
            .wrapping_add(1 << 19)
            >> 20,
        columns,
        radius: None,
        broad,
        unit,
        scaled: 0,
    };
    (sweep, facet, axes, point)
}

/// `n . P - b` at its largest where u is given, fine units, by the definition in floats.
fn truth(sweep: &Sweep, facet: Facet, axes: Axes, point: [i32; 2], u: f64) -> f64 {
    let fine = 16_384.0;
    let heading = WHOLE
        * (f64::from(sweep.heading.0) / 4_294_967_296.0
            + f64::from(sweep.yaw) / ONE_TURN as f64 * u);
    let (s, c) = heading.sin_cos();
    let n = [f64::from(facet.x) / fine, f64::from(facet.y) / fine];
    let [f, second, third] = sweep.columns.map(|column| column.map(f64::from));
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
    let across = dot(normal, second).hypot(dot(normal, third));
    centre + dot(normal, f) * u + across * (1.0 - u * u).max(0.0).sqrt() - f64::from(facet.b) * fine
}

/// The largest of it for u in an interval: a lower bound within a fine unit of lengths up to 2^24.
fn largest(case: &(Sweep, Facet, Axes, [i32; 2]), low: f64, high: f64) -> f64 {
    let (sweep, facet, axes, point) = case;
    let at = |u: f64| truth(sweep, *facet, *axes, *point, u);
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

/// The least b, fine units, at which a slab is inside.
fn threshold(section: Section, turn: i64, e: i32, width: &Width) -> Option<i64> {
    let inside = |b: i64| {
        let raised = Section {
            left: section.left.wrapping_add(b),
            ..section
        };
        raised.slab(turn, e, width) == Slab::Inside
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
        let case = case(&mut random);
        let (sweep, facet, axes, point) = case;
        let first = sweep.first_depth();
        let depth = first + random.within(0.0, 6.0) as u32;
        let width = sweep.width(depth);
        let index = random.within(0.0, f64::from(1u32 << depth)) as u32;
        let e = ((2 * index + 1) * width.in_u as u32) as i32 - (1 << U);
        let section = sweep.section(facet, axes, point, e);
        let Some(least) = threshold(section, sweep.turn, e, &width) else {
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
    for number in 0..crate::test_iterations(20_000, 20) {
        let mut case = case(&mut random);
        let most = largest(&case, -1.0, 1.0)
            .max(largest(&case, -1.0, 0.0))
            .max(largest(&case, 0.0, 1.0));
        // The reach: how far the largest is above the estimate's own.
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
            let holds = holds_at(&sweep, facet, axes, point, &mut slabs);
            if is_inside {
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
}
