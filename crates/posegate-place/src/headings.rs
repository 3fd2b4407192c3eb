//! The integral over the headings of a pose-set.

use super::accuracy::{AccuracyTarget, MissCost, Work};
use super::disc::Disc;
use super::gaussian::WhitenedPoseSet;
use super::quadrature::{Panel, Quadrature, Smooth, Sum, panel, refine};
use super::rays::Bodies;
use core::cell::Cell;
use core::f64::consts::{FRAC_PI_2, TAU};
use posegate::shape::LineClipper;

/// Widest initial panel of headings, radians of yaw.
const WIDEST: f64 = 0.3;

/// Returns the sums over the ball, and the number of headings evaluated.
pub(super) fn integrate(
    along: &LineClipper,
    bodies: &Bodies,
    white: &WhitenedPoseSet,
    of_view: &dyn Fn([f64; 3]) -> f64,
    miss: MissCost,
    quadrature: &Quadrature,
) -> (Sum, u32) {
    let work = Work {
        asked: Cell::new(0),
        most: Cell::new(quadrature.views),
    };
    let of_view = |view| {
        work.asked.set(work.asked.get() + 1);
        of_view(view)
    };
    let aim = AccuracyTarget {
        accuracy: quadrature.accuracy,
        miss,
        looks: 0,
        work: &work,
    };
    // u1 = radius sin(t): the disc's radius is radius cos(t), smooth at both ends.
    let mut ends = arcs(along, white);
    let parts = aim.parts(2, 8);
    let widest = WIDEST / (white.radius * white.yaw);
    let parts = parts.max((libm::ceil(2.0 / widest) as u32).min(2048));
    ends.extend((0..=parts).map(|k| (f64::from(k) / f64::from(parts) - 0.5) * 2.0 * FRAC_PI_2));
    ends.extend(bodies.ends(white, parts.saturating_mul(6).max(48)));
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|b, a| *b - *a < 1e-12);
    // Half of the views are for these parts, the same number for each heading. Unused views are available to the next
    // heading.
    let share = quadrature.views / (30 * ends.len() as u64);
    let mut headings = 0;
    let mut known = Sum::default();
    let mut take = |from: f64, to: f64, known: &Sum| {
        let mut worst = 0.0f64;
        let mut panel = panel(from, to, Smooth::Perhaps, |t| {
            headings += 1;
            let (u1, radius) = (white.radius * libm::sin(t), white.radius * libm::cos(t));
            let headed = along.at(white.yaw * u1);
            let disc = Disc::new(&headed, white, u1, radius, &of_view);
            let density = libm::exp(-0.5 * u1 * u1) / libm::sqrt(TAU);
            let (looks, unseen) = bodies.looks(white, u1, radius, aim.parts(24, 64));
            worst = worst.max(unseen * density * radius);
            let planned = share.saturating_mul(u64::from(headings));
            let most = planned.max(work.asked.get().saturating_add(share));
            work.most.set(most.min(quadrature.views));
            let sum = disc.integrate(AccuracyTarget { looks, ..aim }, known);
            work.most.set(quadrature.views);
            sum.scaled(density * radius)
        });
        panel.unseen = worst * (to - from);
        panel
    };
    let mut panels: Vec<Panel> = Vec::new();
    // From the middle outwards: the sum so far determines the accuracy that the rest needs.
    let mut order: Vec<[f64; 2]> = ends.windows(2).map(|w| [w[0], w[1]]).collect();
    order.sort_by(|a, b| (a[0] + a[1]).abs().total_cmp(&(b[0] + b[1]).abs()));
    for [from, to] in order {
        let next = take(from, to, &known);
        known = known.plus(&next.sum);
        panels.push(next);
    }
    let left = (quadrature.headings / 30).saturating_sub(panels.len() as u32 / 2);
    let mut sum = refine(
        &mut panels,
        left,
        Smooth::Perhaps,
        |sum| aim.allowed(sum),
        |from, to| take(from, to, &known),
    );
    // The mass that no ray met is added to the error; halving panels would not reduce it.
    let unseen: f64 = panels.iter().map(|panel| panel.unseen).sum();
    sum.outside.error += unseen;
    sum.seen.error += unseen * sum.seen.value;
    (sum, headings)
}

/// Returns the ends of the yaw arcs of boxes, as t.
fn arcs(along: &LineClipper, white: &WhitenedPoseSet) -> Vec<f64> {
    let reach = white.radius * white.yaw;
    let mut all = Vec::new();
    for end in along.ends_of_arcs() {
        let first = libm::ceil((-reach - end) / TAU) as i32;
        let last = libm::floor((reach - end) / TAU) as i32;
        for turn in first..=last {
            let sine = (end + TAU * f64::from(turn)) / reach;
            all.push(libm::asin(sine.clamp(-1.0, 1.0)));
        }
    }
    all
}
