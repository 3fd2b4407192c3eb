use super::super::heading::tests::{
    Random, across, case, largest_of, largest_turned, middle, middle_turned, moved, movement_of,
    threshold,
};
use super::*;
use std::vec::Vec;

/// Returns every facet of a piece with its point.
fn bounds<'a>(piece: &Piece<'a>) -> impl Iterator<Item = Bound> + use<'a> {
    piece.frames().flat_map(|frame| {
        frame.facets().map(move |facet| Bound {
            facet,
            axes: frame.axes,
            point: [i32::from(frame.x), i32::from(frame.y)],
        })
    })
}

/// A set with up to three facets; every other set is a cylinder.
fn with_facets(random: &mut Random, count: usize) -> (Sweep, Vec<Bound>) {
    let (mut sweep, ..) = case(random);
    if random.within(0.0, 1.0) < 0.5 {
        let radius = (random.within(1.0, 0.4 * f64::from(sweep.broad) + 2.0)) as i32;
        sweep.radius = Some(radius);
        sweep = sweep.with_disc();
    } else if random.within(0.0, 1.0) < 0.5 {
        sweep = moved(random, sweep);
    }
    let bounds = (0..count).map(|_| {
        let (_, facet, axes, point) = case(random);
        Bound { facet, axes, point }
    });
    (sweep, bounds.collect())
}

/// Returns the largest value of a weighted sum of facets on an interval of u, fine units.
fn truth(sweep: &Sweep, parts: &[(Bound, f64)], low: f64, high: f64) -> f64 {
    let [length, turn] = movement_of(sweep);
    let at = |u: f64, swing: f64| {
        let (mut sum, mut normal) = (0.0, [0.0; 2]);
        for (bound, weight) in parts {
            let Bound { facet, axes, point } = *bound;
            let (own, [x, y]) = middle_turned(sweep, facet, axes, point, u, swing);
            sum += weight * own;
            normal = [normal[0] + weight * x, normal[1] + weight * y];
        }
        sum + across(sweep, normal, u) + length * normal[0].hypot(normal[1])
    };
    largest_of(|u| largest_turned(|swing| at(u, swing), turn), low, high)
}

/// For no weight a slab's bound is below the true weighted sum. Rounding the weights themselves is not an error: both sides use the
/// rounded weight.
#[test]
fn no_bound_of_a_weighed_sum_is_below_the_truth() {
    let mut random = Random(23);
    let mut least_spare = f64::INFINITY;
    for number in 0..crate::test_iterations(20_000, 20) {
        let count = 2 + number as usize % 2;
        let (sweep, bounds) = with_facets(&mut random, count);
        let first = sweep.first_depth();
        let depth = first + random.within(0.0, 6.0) as u32;
        let width = sweep.width(depth);
        let index = random.within(0.0, f64::from(1u32 << depth)) as u32;
        let e = ((2 * index + 1) * width.in_u as u32) as i32 - (1 << U);
        let mut sum = bounds[0].section(&sweep, e);
        let mut parts: Vec<(Bound, f64)> = std::vec![(bounds[0], 1.0)];
        for other in &bounds[1..] {
            let section = other.section(&sweep, e);
            let weight = if random.within(0.0, 1.0) < 0.5 {
                random.within(0.0, 4_096.0) as i32
            } else {
                let root = if sweep.radius.is_some() {
                    1 << U
                } else {
                    i64::from(Root::of(e).low())
                };
                sum.weight(&section, sweep.turn(), root, width.in_u)
            };
            assert!((0..=1 << WEIGHT_BITS).contains(&weight));
            sum = sum.weighed(&section, weight);
            let share = f64::from(weight) / 4_096.0;
            for (_, part) in &mut parts {
                *part *= 1.0 - share;
            }
            parts.push((*other, share));
        }
        let Some(least) = threshold(sum, &sweep, e, &width) else {
            panic!("{number}: no b is enough: {sweep:?} {parts:?}");
        };
        let [low, high] = [e - width.in_u, e + width.in_u].map(|end| f64::from(end) / 32_768.0);
        let most = truth(&sweep, &parts, low, high);
        assert!(
            least as f64 >= most,
            "{number}: {least} is enough, {most} is reached: {sweep:?} {parts:?} {depth} {e}"
        );
        least_spare = least_spare.min(least as f64 - most);
    }
    std::println!("least to spare: {least_spare:.1} fine units");
}

/// At a single heading the weight is the best: the sum agrees, to within a hundredth of the section, with the point of the section
/// beyond the other facet that is farthest beyond the first. That point is found by sampling around the section.
#[test]
fn the_weight_is_close_to_the_best() {
    let mut random = Random(29);
    let (mut tried, mut excess) = (0u32, Vec::new());
    for _ in 0..crate::test_iterations(4_000, 4) {
        let (sweep, bounds) = with_facets(&mut random, 2);
        let e = (random.within(-60.0, 60.0) as i32) << 9;
        let u = f64::from(e) / 32_768.0;
        let [(a, normal), (b, other)] =
            [0, 1].map(|i| middle(&sweep, bounds[i].facet, bounds[i].axes, bounds[i].point, u));
        let reach = across(&sweep, other, u);
        // The other facet cuts the section.
        let cut = random.within(-0.9, 0.9) * reach;
        if reach < 1e4 {
            continue;
        }
        tried += 1;
        let [_, second, third] = sweep.columns.map(|column| column.map(f64::from));
        let shrunk = across(&sweep, normal, u) / (1e-9 + across(&sweep, normal, 0.0));
        let mut most = f64::MIN;
        for k in 0..4_000 {
            let (s, c) = (f64::from(k) * core::f64::consts::TAU / 4_000.0).sin_cos();
            let at = [0, 1].map(|i| shrunk * (second[i] * c + third[i] * s));
            let along = |n: [f64; 2]| n[0] * at[0] + n[1] * at[1];
            if along(other) >= cut {
                most = most.max(along(normal));
            }
        }
        let raise = |section: Section, by: f64| Section {
            left: section.left + by as i64,
            ..section
        };
        // Both facets have the wanted slack at the middle of the section.
        let first = raise(bounds[0].section(&sweep, e), a);
        let second = raise(bounds[1].section(&sweep, e), b + cut);
        let root = if sweep.radius.is_some() {
            1 << U
        } else {
            i64::from(Root::of(e).low())
        };
        let narrow = sweep.width(sweep.first_depth() + DEEPEST);
        let enough = |spare: f64| {
            let first = raise(first, spare);
            let weight = first.weight(&second, sweep.turn(), root, 0);
            first.weighed(&second, weight).slab(&sweep, e, &narrow) != Slab::Outside
        };
        let (mut low, mut high) = (-1e9, 1e9);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if enough(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        excess.push((high - most) / (across(&sweep, normal, u) + 1.0));
    }
    excess.sort_by(f64::total_cmp);
    let at = |share: f64| excess[((excess.len() - 1) as f64 * share) as usize];
    std::println!(
        "{tried}: excess median {:.5}, nine tenths {:.5}, most {:.5}",
        at(0.5),
        at(0.9),
        at(1.0)
    );
    assert!(at(0.9) < 0.01, "{}", at(0.9));
}

/// Returns a layout of two to four random pieces about the goal, some with their own arc.
fn layout(random: &mut Random, size: f64) -> Vec<u8> {
    let pieces = random.within(2.0, 5.0) as usize;
    let (mut heads, mut frames, mut facets) = (Vec::new(), Vec::new(), Vec::new());
    let mut frame_count = 0u8;
    let mut facet_count = 0u16;
    for _ in 0..pieces {
        let (from, width) = if random.within(0.0, 1.0) < 0.6 {
            (0u32, u32::MAX)
        } else {
            let from = random.within(-0.02, 0.01) * 4_294_967_296.0;
            (
                from as i64 as u32,
                (random.within(0.01, 0.04) * 4_294_967_296.0) as u32,
            )
        };
        let middle = [
            random.within(-0.5, 0.5) * size,
            random.within(-0.5, 0.5) * size,
        ];
        let mut own = 0u16;
        for axes in 0..2u8 {
            let point = [
                random.within(-0.4, 0.4) * size,
                random.within(-0.4, 0.4) * size,
            ]
            .map(f64::round);
            let count = if axes == 0 { 4 } else { 2 };
            let start = random.within(0.0, core::f64::consts::TAU);
            frames.extend([axes, count]);
            frames.extend(point.iter().flat_map(|v| (*v as i16).to_le_bytes()));
            frame_count += 1;
            for k in 0..count {
                let angle = start + f64::from(k) * core::f64::consts::TAU / f64::from(count);
                let normal = [angle.cos(), angle.sin()];
                let centre = if axes == 0 {
                    normal[0] * (middle[0] + point[0]) + normal[1] * (middle[1] + point[1])
                } else {
                    normal[0] * (middle[0] - point[0]) + normal[1] * (middle[1] - point[1])
                };
                let b = centre + random.within(0.3, 1.5) * size;
                for v in [normal[0] * 16_384.0, normal[1] * 16_384.0, b] {
                    facets.extend((v.round() as i16).to_le_bytes());
                }
                own += 1;
            }
        }
        facet_count += own;
        heads.extend(from.to_le_bytes());
        heads.extend(width.to_le_bytes());
        heads.extend([2u8, 0]);
        heads.extend(own.to_le_bytes());
    }
    let mut bytes = std::vec![10u8, pieces as u8, frame_count, 0];
    bytes.extend(facet_count.to_le_bytes());
    for limit in [3.0 * size, 0.9 * size, 4.0 * size] {
        bytes.extend((limit as u16).to_le_bytes());
    }
    bytes.extend(heads);
    bytes.extend(frames);
    bytes.extend(facets);
    bytes
}

/// Returns the slack of a pose in its best piece, length units: the least over its facets, each with its clearance.
fn best_spare(facets: &Facets<'_>, [x, y, yaw]: [f64; 3]) -> f64 {
    let units = (yaw / core::f64::consts::TAU * 4_294_967_296.0).round() as i64 as u32;
    let (s, c) = yaw.sin_cos();
    let pieces = facets.pieces().filter(|piece| {
        piece.is_whole_circle()
            || units.wrapping_sub(piece.from).wrapping_add(8) <= piece.width.saturating_add(16)
    });
    let of_piece = |piece: Piece<'_>| {
        let spares = bounds(&piece).map(|bound| {
            let [px, py] = bound.point.map(f64::from);
            let [x, y] = match bound.axes {
                Axes::World => [x + c * px - s * py, y + s * px + c * py],
                Axes::Robot => {
                    let (x, y) = (x - px, y - py);
                    [c * x + s * y, c * y - s * x]
                }
            };
            let along = (f64::from(bound.facet.x) * x + f64::from(bound.facet.y) * y) / 16_384.0;
            let clearance = super::super::facet_clearance_q14(
                bound.facet,
                bound.axes,
                bound.point != [0, 0],
                facets.unit(),
                facets.lever(),
            );
            f64::from(bound.facet.b) + clearance as f64 / 16_384.0 - along
        });
        spares.fold(f64::INFINITY, f64::min)
    };
    pieces.map(of_piece).fold(f64::NEG_INFINITY, f64::max)
}

/// Of every set that is accepted, no pose is outside of all pieces: random layouts with facets in both axes and arcs, random sets,
/// poses of their borders and within.
#[test]
fn what_pieces_hold_together_has_no_pose_outside() {
    let mut random = Random(31);
    let (mut single, mut together, mut cut, mut grown) = (0u32, 0u32, 0u32, 0u32);
    for number in 0..crate::test_iterations(60_000, 8) {
        let size = 4_000.0;
        let bytes = layout(&mut random, size);
        let cells = one_cell();
        let facets = Facets::parse(&bytes, &cells).expect("a layout");
        // Length units of 2^10 um to metres.
        let metres = 1_024e-6;
        let (estimate, goal) = (
            crate::set::Estimate {
                x_m: random.within(-0.6, 0.6) * size * metres,
                y_m: random.within(-0.6, 0.6) * size * metres,
                yaw_rad: random.within(-0.1, 0.1),
            },
            Pose {
                x_um: 0,
                y_um: 0,
                yaw: crate::num::BinaryAngle(0),
            },
        );
        let is_disc = random.within(0.0, 1.0) < 0.3;
        let wide = random.size(0.02, 0.6) * size * metres;
        let yaw = random.size(0.01, 1.0);
        let sigma = [wide, wide * random.size(0.1, 1.0), yaw].map(|v| v / 3.4);
        let rho: [f64; 3] = core::array::from_fn(|_| random.within(-0.5, 0.5));
        let cov = [
            [
                sigma[0] * sigma[0],
                rho[0] * sigma[0] * sigma[1],
                rho[1] * sigma[0] * sigma[2],
            ],
            [
                rho[0] * sigma[0] * sigma[1],
                sigma[1] * sigma[1],
                rho[2] * sigma[1] * sigma[2],
            ],
            [
                rho[1] * sigma[0] * sigma[2],
                rho[2] * sigma[1] * sigma[2],
                sigma[2] * sigma[2],
            ],
        ];
        let radius = crate::set::RadiusSquared::from_q16(743_499).unwrap();
        let set = if is_disc {
            PoseSet::bounded(estimate, wide, yaw)
        } else {
            PoseSet::gaussian(estimate, cov, radius)
        };
        let Ok(mut set) = set else { continue };
        let movement = match number % 2 {
            0 => [
                random.size(0.001, 0.3) * size * metres,
                random.size(0.001, 0.3),
            ],
            _ => [0.0; 2],
        };
        let by = crate::set::Growth::of(movement[0], movement[1]).unwrap();
        set = set.grown(by);
        if !covers(&facets, &set, goal) {
            continue;
        }
        let alone =
            Sweep::of(&facets, &set, goal).is_some_and(|sweep| sweep.is_held(&facets, &set, goal));
        single += u32::from(alone);
        together += u32::from(!alone);
        grown += u32::from(!alone && !is_disc && number % 2 == 0);
        cut += u32::from(!alone && facets.pieces().any(|piece| !piece.is_whole_circle()));
        if alone {
            continue;
        }
        let root = {
            let l11 = cov[0][0].sqrt();
            let (l21, l31) = (cov[1][0] / l11, cov[2][0] / l11);
            let l22 = (cov[1][1] - l21 * l21).sqrt();
            let l32 = (cov[2][1] - l31 * l21) / l22;
            let l33 = (cov[2][2] - l31 * l31 - l32 * l32).sqrt();
            [[l11, 0.0, 0.0], [l21, l22, 0.0], [l31, l32, l33]]
        };
        for k in 0..2_000 {
            let direction: [f64; 3] = core::array::from_fn(|_| random.within(-1.0, 1.0));
            let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
            let share = if k % 4 == 0 {
                random.within(0.0, 1.0)
            } else {
                1.0
            };
            let offset = if is_disc {
                let plane = direction[0].hypot(direction[1]);
                let by = share * wide / plane;
                [by * direction[0], by * direction[1], direction[2] * yaw]
            } else {
                let by = share * (743_499.0f64 / 65_536.0).sqrt() / length;
                root.map(|row| {
                    by * (row[0] * direction[0] + row[1] * direction[1] + row[2] * direction[2])
                })
            };
            let away = random.within(0.0, core::f64::consts::TAU);
            let (sin, cos) = away.sin_cos();
            let swing = if k % 3 == 0 {
                random.within(-1.0, 1.0)
            } else {
                f64::from(k % 3) * 2.0 - 3.0
            };
            let pose = [
                (estimate.x_m + offset[0] + movement[0] * cos) / metres,
                (estimate.y_m + offset[1] + movement[0] * sin) / metres,
                estimate.yaw_rad + offset[2] + movement[1] * swing,
            ];
            let spare = best_spare(&facets, pose);
            assert!(
                spare >= -1e-6,
                "{number}: {spare} at {pose:?}: {set:?} {facets:?}"
            );
        }
    }
    std::println!(
        "{single} in one piece, {together} in several, {cut} of them with arcs, {grown} ellipsoids that have moved"
    );
    assert!(
        cfg!(miri) || (together > 200 && cut > 20 && grown > 20),
        "{single} {together} {cut} {grown}"
    );
}

/// Returns a layout of boxes `[x, y]` in length units of 2^10 um, each a piece with four facets for every heading.
fn layout_of_boxes(boxes: &[[[i16; 2]; 2]]) -> Vec<u8> {
    let count = boxes.len() as u8;
    let mut bytes = std::vec![10u8, count, count, 0];
    bytes.extend((4 * u16::from(count)).to_le_bytes());
    for limit in [12_000u16, 3_600, 16_000] {
        bytes.extend(limit.to_le_bytes());
    }
    for _ in boxes {
        bytes.extend(0u32.to_le_bytes());
        bytes.extend(u32::MAX.to_le_bytes());
        bytes.extend([1, 0, 4, 0]);
    }
    for _ in boxes {
        bytes.extend([0, 4, 0, 0, 0, 0]);
    }
    for [x, y] in boxes {
        let one = 16_384i16;
        let facets = [
            [one, 0, x[1]],
            [-one, 0, -x[0]],
            [0, one, y[1]],
            [0, -one, -y[0]],
        ];
        bytes.extend(facets.iter().flatten().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// A lane and a bay contain a set together, also in a layout with many other pieces: if the whole cost of the choice of a piece
/// counted, no steps would remain.
#[test]
fn many_other_pieces_do_not_deny_a_set_in_two() {
    let goal = Pose {
        x_um: 0,
        y_um: 0,
        yaw: crate::num::BinaryAngle(0),
    };
    let estimate = crate::set::Estimate {
        x_m: -0.1,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let set = PoseSet::bounded(estimate, 0.3, 0.05).unwrap();
    let lane_and_bay = [[[-3_000, 0], [-1_000, 1_000]], [[-200, 1_500], [-500, 500]]];
    for others in [0, 30, 140, 200] {
        let other = |k: i16| [[2_000 + 5 * k, 2_100 + 5 * k], [-50, 50]];
        let boxes: Vec<_> = lane_and_bay
            .into_iter()
            .chain((0..others).map(other))
            .collect();
        let bytes = layout_of_boxes(&boxes);
        let cells = one_cell();
        let facets = Facets::parse(&bytes, &cells).expect("a layout");
        assert!(covers(&facets, &set, goal), "{others} others");
        // Neither of them contains it alone.
        for alone in lane_and_bay {
            let bytes = layout_of_boxes(&[alone, alone]);
            let facets = Facets::parse(&bytes, &cells).expect("a layout");
            assert!(!covers(&facets, &set, goal), "{alone:?}");
        }
    }
}

/// Returns cells whose extent is of no importance to facets.
const fn one_cell() -> crate::table::Cells {
    crate::table::Cells {
        x_lo_um: 0,
        y_lo_um: 0,
        step_um: 1,
        columns: 1,
        rows: 1,
        yaw_lo: crate::num::BinaryAngle(0),
        yaw_span: 1 << 32,
        slabs: 1,
    }
}

/// A layout, a set and its search at some range of headings.
fn searched(random: &mut Random, bytes: &[u8], test: impl Fn(&mut Search<'_>, &mut Random)) {
    let cells = one_cell();
    let facets = Facets::parse(bytes, &cells).expect("a layout");
    let (sweep, ..) = case(random);
    let mut search = Search {
        sweep: &sweep,
        facets: &facets,
        above_goal: (random.within(-0.06, 0.06) * 4_294_967_296.0) as i64 as u32,
        range: [-(1 << U), 1 << U],
        steps: MOST_UNION_STEPS,
        choice: facets.steps_of_choice(),
        lost: At { x: 0, y: 0, u: 0 },
    };
    test(&mut search, random);
}

/// A range of headings lies in a piece's arc exactly if it lies in the arc's range of u, rounded towards its middle. Every other range
/// begins or ends at the arc's own end.
#[test]
fn range_is_in_arc_if_and_only_if_within_its_range_of_u() {
    let mut random = Random(37);
    let (inside, outside) = (core::cell::Cell::new(0u32), core::cell::Cell::new(0u32));
    for number in 0..crate::test_iterations(20_000, 20) {
        let bytes = layout(&mut random, 4_000.0);
        let one = 1i32 << U;
        searched(&mut random, &bytes, |search, random| {
            for piece in search.facets.pieces() {
                let arcs = search.arcs(&piece);
                let u = |random: &mut Random| random.within(-32_768.0, 32_768.0) as i32;
                let mut range = [u(random), u(random)];
                range.sort_unstable();
                if number % 2 == 0 {
                    let near = random.within(-2.0, 2.0) as i32;
                    let [from, to] = arcs[number as usize / 2 % 3];
                    range = [(from + near).clamp(-one, one), to.clamp(-one, one)];
                }
                search.range = range;
                let expected = piece.is_whole_circle()
                    || arcs
                        .iter()
                        .any(|[from, to]| *from <= range[0] && range[1] <= *to);
                assert_eq!(
                    search.is_in_arc(&piece),
                    expected,
                    "{number}: {range:?} {arcs:?} {piece:?}"
                );
                if !piece.is_whole_circle() {
                    inside.set(inside.get() + u32::from(expected));
                    outside.set(outside.get() + u32::from(!expected));
                }
            }
        });
    }
    let (inside, outside) = (inside.get(), outside.get());
    assert!(
        cfg!(miri) || (inside > 500 && outside > 500),
        "{inside} {outside}"
    );
}

/// The chosen piece is the deepest, to within two length units, of those that are not excluded. Without steps none is chosen.
#[test]
fn chosen_piece_is_deepest_and_takes_steps() {
    let mut random = Random(41);
    let chosen = core::cell::Cell::new(0u32);
    for number in 0..crate::test_iterations(20_000, 20) {
        let bytes = layout(&mut random, 4_000.0);
        searched(&mut random, &bytes, |search, random| {
            search.range = [0, 0];
            let at = search.centre(0);
            let [c, s] = search
                .sweep
                .turned_to(0)
                .map(|v| f64::from(v) / 2f64.powi(30));
            let not = [random.within(0.0, 5.0) as usize];
            let of_piece = |piece: &Piece<'_>| {
                let spares = bounds(piece).map(|bound| {
                    let [px, py] = bound.point.map(f64::from);
                    let [x, y] = [at.x, at.y].map(|v| v as f64 / 16_384.0);
                    let [x, y] = match bound.axes {
                        Axes::World => [x + c * px - s * py, y + s * px + c * py],
                        Axes::Robot => {
                            let (x, y) = (x - px, y - py);
                            [c * x + s * y, c * y - s * x]
                        }
                    };
                    let along = f64::from(bound.facet.x) * x + f64::from(bound.facet.y) * y;
                    f64::from(bound.facet.b) - along / 16_384.0
                });
                spares.fold(f64::INFINITY, f64::min)
            };
            let depths: Vec<(usize, f64)> = (0..)
                .zip(search.facets.pieces())
                .filter(|(number, piece)| !not.contains(number) && search.is_in_arc(piece))
                .map(|(number, piece)| (number, of_piece(&piece)))
                .collect();
            let most = depths
                .iter()
                .map(|(_, depth)| *depth)
                .fold(f64::NEG_INFINITY, f64::max);
            let before = search.steps;
            match search.deepest(at, &not) {
                Some((found, _)) => {
                    let depth = depths.iter().find(|(number, _)| *number == found);
                    let depth = depth.expect("a piece that may be chosen").1;
                    assert!(
                        depth >= most - 2.0 && depth >= -6.0,
                        "{number}: {depth} {most}"
                    );
                    chosen.set(chosen.get() + 1);
                }
                None => assert!(most <= -2.0, "{number}: {most}"),
            }
            assert_eq!(search.steps, before - search.choice);
            search.steps = search.choice - 1;
            assert!(search.deepest(at, &not).is_none());
        });
    }
    assert!(cfg!(miri) || chosen.get() > 500, "{}", chosen.get());
}

/// A weight of 1 leaves the other facet alone: a slab on which the sum holds then has no pose beyond that facet. A weight of 0
/// leaves the first.
#[test]
fn weights_of_zero_and_one_leave_one_facet() {
    let mut random = Random(43);
    for _ in 0..crate::test_iterations(2_000, 20) {
        let (sweep, bounds) = with_facets(&mut random, 2);
        let [first, second] = [0, 1].map(|i: usize| bounds[i].section(&sweep, 1 << (U - 1)));
        for (weight, alone) in [(0, first), (1 << WEIGHT_BITS, second)] {
            let sum = first.weighed(&second, weight);
            assert_eq!(sum.left, alone.left - WEIGHED);
            assert_eq!(
                [sum.c, sum.s, sum.g, sum.h, sum.g_turning],
                [alone.c, alone.s, alone.g, alone.h, alone.g_turning]
            );
            assert_eq!(
                [sum.along, sum.ahead, sum.normal],
                [alone.along, alone.ahead, alone.normal]
            );
        }
    }
}

/// A pose far from the goal is outside, however far it is.
#[test]
fn far_pose_is_outside_of_every_piece() {
    let mut random = Random(47);
    let goal = Pose {
        x_um: 0,
        y_um: 0,
        yaw: crate::num::BinaryAngle(0),
    };
    for number in 0..crate::test_iterations(2_000, 20) {
        let bytes = layout(&mut random, 4_000.0);
        searched(&mut random, &bytes, |search, random| {
            let direction = random.within(0.0, core::f64::consts::TAU);
            let far = random.within(2e7, 2e9);
            let pose = Pose {
                x_um: (far * direction.cos()) as i32,
                y_um: (far * direction.sin()) as i32,
                yaw: crate::num::BinaryAngle(0),
            };
            let inside = depth(search.facets, pose, goal);
            assert!(inside < 0, "{number}: {inside} at {pose:?}");
        });
    }
}
