//! The integral over the disc of one heading, by rays from its centre.

use super::accuracy::AccuracyTarget;
use super::gaussian::WhitenedPoseSet;
use super::quadrature::{Approximate, Panel, Smooth, Sum, panel, refine};
use super::rays::{Ray, Rule};
use core::cell::Cell;
use core::f64::consts::TAU;
use posegate::shape::{Headed, LineSegment};

/// The length of a ray, as a multiple of the disc's radius. A border just beyond the disc may enter it between
/// two rays.
const BEYOND: f64 = 1.05;

/// Directions tried from a tag, in addition to those in which it is seen best. Used if the disc's centre is outside
/// the set.
const FAN: u32 = 32;

/// Largest number of times that a panel of a disc is halved.
const HALVINGS: u32 = 100;

/// The poses of a pose-set at one heading.
pub(super) struct Disc<'a> {
    headed: &'a Headed<'a>,
    views: usize,
    white: &'a WhitenedPoseSet,
    middle: [f64; 2],
    radius: f64,
    of_view: &'a dyn Fn([f64; 3]) -> f64,
}

/// A direction that was evaluated.
struct EvaluatedDirection {
    angle: f64,
    signature: u64,
    leaves: Option<f64>,
}

impl<'a> Disc<'a> {
    pub(super) fn new(
        headed: &'a Headed<'a>,
        white: &'a WhitenedPoseSet,
        u1: f64,
        radius: f64,
        of_view: &'a dyn Fn([f64; 3]) -> f64,
    ) -> Self {
        Self {
            headed,
            views: headed.views(),
            white,
            middle: white.middle(u1),
            radius,
            of_view,
        }
    }

    fn ray(&self, angle: f64) -> Ray {
        let walk = LineSegment {
            from: self.middle,
            way: self.white.to_metres([libm::cos(angle), libm::sin(angle)]),
            length: BEYOND * self.radius,
        };
        Ray::cast(self.headed, self.views, walk, self.radius)
    }

    fn look(&self, angle: f64) -> EvaluatedDirection {
        let ray = self.ray(angle);
        EvaluatedDirection {
            angle,
            signature: ray.signature(),
            leaves: ray.leaves,
        }
    }

    /// Returns the sums over the disc, for the density of its two coordinates. `known` is the sum over other
    /// headings; errors may be relative to it.
    pub(super) fn integrate(&self, aim: AccuracyTarget, known: &Sum) -> Sum {
        let corners = self.corners(aim);
        let scale = known.seen.value;
        let rule = Cell::new(Rule::By7);
        // A panel's ends are positions: the index of the previous corner, plus a fraction of the path to the next
        // corner.
        let take = |from: f64, to: f64| {
            let corner = libm::floor(from);
            let (low, high) = (corners[corner as usize], corners[corner as usize + 1]);
            let (width, is_full_turn) = (high - low, corners.len() == 2);
            let mut relative = None;
            panel(from, to, Smooth::Surely, |place| {
                let s = place - corner;
                // The slope is zero at corners, where a ray may touch a border.
                let (share, slope) = if is_full_turn {
                    (s, 1.0)
                } else {
                    (s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s))
                };
                let ray = self.ray(low + width * share);
                // The panel's first node is its middle. It decides which rule is accurate enough.
                let seen = match relative {
                    Some(relative) => {
                        let value = self.seen(&ray, rule.get()).value;
                        let error = relative * value;
                        Approximate { value, error }
                    }
                    None => {
                        let (enough, seen) = self.enough(&ray, 0.05 * aim.accuracy, scale);
                        rule.set(enough);
                        relative = Some(seen.error / seen.value.max(f64::MIN_POSITIVE));
                        seen
                    }
                };
                let outside = Approximate {
                    value: ray.outside(),
                    error: 0.0,
                };
                Sum::of([seen, outside]).scaled(width * slope / TAU)
            })
        };
        let mut panels: Vec<Panel> = Vec::new();
        for (index, pair) in corners.windows(2).enumerate() {
            let parts = libm::ceil((pair[1] - pair[0]) / (TAU / 4.0)).max(1.0);
            let at = |k: u32| index as f64 + f64::from(k) / parts;
            panels.extend((0..parts as u32).map(|k| take(at(k), at(k + 1))));
        }
        let allowed = |sum: &Sum| {
            let (own, all) = (aim.allowed(sum), aim.allowed(known));
            [0, 1].map(|k| 0.25 * own[k].max(all[k]))
        };
        refine(&mut panels, HALVINGS, Smooth::Surely, allowed, take)
    }

    fn seen(&self, ray: &Ray, rule: Rule) -> Approximate {
        ray.seen(self.headed, self.views, self.of_view, rule)
    }

    /// Returns the rule with the fewest nodes whose error along a ray is at most a share of its sum or of a
    /// scale, and the sum with that rule's error.
    fn enough(&self, ray: &Ray, share: f64, scale: f64) -> (Rule, Approximate) {
        let [by_7, by_15] = [Rule::By7, Rule::By15].map(|rule| self.seen(ray, rule).value);
        let limit = share * by_15.abs().max(scale);
        let of = |value: f64, exact: f64| Approximate {
            value: exact,
            error: (value - exact).abs(),
        };
        if (by_7 - by_15).abs() <= limit {
            return (Rule::By7, of(by_7, by_15));
        }
        let rule = Rule::Within(0.1 * limit);
        let best = self.seen(ray, rule);
        if (by_15 - best.value).abs() <= limit {
            return (Rule::By15, of(by_15, best.value));
        }
        (rule, best)
    }

    /// Returns the angles between which the same constraints limit the rays, once around; the first is
    /// repeated at the end.
    fn corners(&self, aim: AccuracyTarget) -> Vec<f64> {
        let count = aim.parts(24, 64);
        // Offset from the axes, because corners are often on the axes.
        let around = |k: u32| 0.05 + TAU * f64::from(k) / f64::from(count);
        let mut angles: Vec<f64> = (0..count).map(around).collect();
        let start = angles[0];
        let mut evaluated: Vec<EvaluatedDirection> =
            angles.drain(..).map(|angle| self.look(angle)).collect();
        let outside = evaluated.iter().all(|look| look.leaves.is_none());
        let seeds = if outside {
            self.toward_the_set()
        } else {
            self.nearly(&evaluated)
        };
        for seed in seeds {
            let angle = start + (seed - start).rem_euclid(TAU);
            evaluated.push(self.look(angle));
        }
        evaluated.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        if let Some(first) = evaluated.first() {
            let again = EvaluatedDirection {
                angle: start + TAU,
                ..*first
            };
            evaluated.push(again);
        }
        let tight = (1e-3 * aim.accuracy).max(1e-10);
        let mut corners = Vec::new();
        for pair in evaluated.windows(2) {
            self.part(&pair[0], &pair[1], tight, &mut corners);
        }
        let first = corners.first().copied().unwrap_or(start);
        corners.push(first + TAU);
        if corners.len() == 1 {
            corners.insert(0, first);
        }
        corners
    }

    /// Adds the angles between two directions at which the rays' limiting constraints change, in order.
    fn part(
        &self,
        a: &EvaluatedDirection,
        b: &EvaluatedDirection,
        tight: f64,
        corners: &mut Vec<f64>,
    ) {
        let mut open = std::vec![(a.angle, a.signature, b.angle, b.signature)];
        while let Some((from, left, to, right)) = open.pop() {
            if left == right {
                continue;
            }
            let middle = 0.5 * (from + to);
            if to - from < tight {
                corners.push(middle);
                continue;
            }
            let look = self.look(middle);
            open.push((middle, look.signature, to, right));
            open.push((from, left, middle, look.signature));
        }
    }

    /// Returns directions in which a border enters the disc between two evaluated angles, but is just outside the
    /// disc at these angles.
    fn nearly(&self, evaluated: &[EvaluatedDirection]) -> Vec<f64> {
        let mut seeds = Vec::new();
        let count = evaluated.len();
        let leaves = |k: usize| evaluated[k % count].leaves.unwrap_or(0.0);
        for (k, look) in evaluated.iter().enumerate() {
            let here = look.leaves.unwrap_or(0.0);
            let (before, after) = (leaves(k + count - 1), leaves(k + 1));
            let near = here > self.radius && here < BEYOND * self.radius;
            if !near || here > before || here > after {
                continue;
            }
            let step = TAU / count as f64;
            let [mut from, mut to] = [look.angle - step, look.angle + step];
            // Golden-section search.
            let ratio = 0.5 * (libm::sqrt(5.0) - 1.0);
            let at = |angle: f64| self.ray(angle).leaves.unwrap_or(0.0);
            let (mut low, mut high) = (to - ratio * (to - from), from + ratio * (to - from));
            let (mut of_low, mut of_high) = (at(low), at(high));
            for _ in 0..24 {
                if of_low.min(of_high) < self.radius {
                    seeds.push(if of_low < of_high { low } else { high });
                    break;
                }
                if of_low < of_high {
                    (to, high, of_high) = (high, low, of_low);
                    low = to - ratio * (to - from);
                    of_low = at(low);
                } else {
                    (from, low, of_low) = (low, high, of_high);
                    high = from + ratio * (to - from);
                    of_high = at(high);
                }
            }
        }
        seeds
    }

    /// Returns the directions from the disc's centre to the parts of the set that are on lines from each tag. From
    /// outside, the set may be narrow.
    fn toward_the_set(&self) -> Vec<f64> {
        let mut seeds = Vec::new();
        for view in 0..self.views {
            let from = self.headed.at_tag(view);
            let start = self
                .white
                .whiten([from[0] - self.middle[0], from[1] - self.middle[1]]);
            let around = (0..FAN).map(|k| {
                let angle = 0.05 + TAU * f64::from(k) / f64::from(FAN);
                [libm::cos(angle), libm::sin(angle)]
            });
            for way in around.chain(self.headed.before_tag(view)) {
                let white = self.white.whiten(way);
                // The part of the line within the disc.
                let square = white[0] * white[0] + white[1] * white[1];
                let nearest = -(start[0] * white[0] + start[1] * white[1]) / square;
                let height = start[0] * start[0] + start[1] * start[1] - nearest * nearest * square;
                let half = libm::sqrt((self.radius * self.radius - height).max(0.0) / square);
                let (first, last) = ((nearest - half).max(0.0), nearest + half);
                if !(first < last) {
                    continue;
                }
                let walk = LineSegment {
                    from,
                    way,
                    length: last,
                };
                for stretch in self.headed.stretches(&walk) {
                    let (lo, hi) = (stretch.from.max(first), stretch.to.min(last));
                    if lo < hi {
                        let t = 0.5 * (lo + hi);
                        let [u, v] = [start[0] + t * white[0], start[1] + t * white[1]];
                        seeds.push(libm::atan2(v, u));
                    }
                }
            }
        }
        seeds
    }
}
