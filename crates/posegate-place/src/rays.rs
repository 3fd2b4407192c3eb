//! One ray of a heading's disc: its intervals inside the set, and its part of the sums.

pub(super) use self::bodies::Bodies;

use super::gaussian::WhitenedPoseSet;
use super::quadrature::{Approximate, line, line_by_7, line_within};
use posegate::shape::{Headed, LineInterval, LineSegment, OPEN, ViewAlongLine};

mod bodies;

/// The rule for the cost along a ray.
#[derive(Clone, Copy, Debug)]
pub(super) enum Rule {
    /// 7 nodes per interval; no error is reported.
    By7,
    /// 15 nodes per interval; no error is reported.
    By15,
    /// As many nodes as each interval needs for this error.
    Within(f64),
}

/// A ray from the disc's centre, in units of the standard deviation.
#[derive(Clone, Debug)]
pub(super) struct Ray {
    pub walk: LineSegment,
    /// The radius of the disc.
    pub radius: f64,
    /// The intervals inside the set, within the disc.
    pub intervals: Vec<LineInterval>,
    /// The intervals from which each view sees its tag, with the view's number; empty with a single view.
    seen: Vec<(usize, LineInterval)>,
    /// The distance at which the ray first leaves the set, at most the line's length; `None` if its start is outside.
    pub leaves: Option<f64>,
}

impl Ray {
    /// Clips a line that reaches a little beyond the disc.
    pub(super) fn cast(headed: &Headed<'_>, views: usize, walk: LineSegment, radius: f64) -> Self {
        let (mut intervals, seen) = if views > 1 {
            headed.stretches_and_seen(&walk)
        } else {
            (headed.stretches(&walk), Vec::new())
        };
        let leaves = intervals.first().filter(|first| first.from <= 0.0);
        let leaves = leaves.map(|first| first.to);
        intervals.retain(|interval| interval.from < radius);
        if let Some(last) = intervals.last_mut()
            && last.to >= radius
        {
            last.to = radius;
            last.ended_by[1] = OPEN;
        }
        Self {
            walk,
            radius,
            intervals,
            seen,
            leaves,
        }
    }

    /// Returns a hash of the constraints that limit the intervals. If two rays have different hashes, a corner of the
    /// set, or of its border with the disc, is between them.
    pub(super) fn signature(&self) -> u64 {
        // FNV-1a, by words.
        let mix = |hash: u64, word: u32| (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3);
        let mut hash = 0xcbf2_9ce4_8422_2325;
        for interval in &self.intervals {
            hash = mix(mix(hash, interval.ended_by[0]), interval.ended_by[1]);
        }
        for (_, interval) in &self.seen {
            for (at, by) in [
                (interval.from, interval.ended_by[0]),
                (interval.to, interval.ended_by[1]),
            ] {
                hash = mix(hash, if at < self.radius { by } else { OPEN });
            }
        }
        hash
    }

    /// Returns the mass outside, per radian over 2 pi: `exp(-a^2/2) - exp(-b^2/2)` between the intervals.
    pub(super) fn outside(&self) -> f64 {
        let between =
            |a: f64, b: f64| -libm::exp(-0.5 * a * a) * libm::expm1(0.5 * (a - b) * (a + b));
        let mut from = 0.0;
        let mut mass = 0.0;
        for interval in &self.intervals {
            mass += between(from, interval.from);
            from = interval.to;
        }
        mass + between(from, self.radius)
    }

    /// Returns the cost inside, per radian over 2 pi. Parts with an infinite cost are left out.
    pub(super) fn seen(
        &self,
        headed: &Headed<'_>,
        views: usize,
        of_view: &dyn Fn([f64; 3]) -> f64,
        rule: Rule,
    ) -> Approximate {
        let mut all = Approximate::default();
        let mut add = |from: f64, to: f64, cost: &dyn Fn(f64) -> f64| {
            let value = |t: f64| cost(t) * t * libm::exp(-0.5 * t * t);
            let by_rule = |from: f64, to: f64| match rule {
                Rule::By7 => Approximate {
                    value: line_by_7(from, to, value),
                    error: 0.0,
                },
                Rule::By15 => Approximate {
                    value: line(from, to, value).value,
                    error: 0.0,
                },
                Rule::Within(error) => {
                    let quick = line_by_7(from, to, value);
                    if quick.is_finite() {
                        line_within(from, to, error, &value)
                    } else {
                        Approximate {
                            value: quick,
                            error: 0.0,
                        }
                    }
                }
            };
            let mut add = |part: Approximate| {
                all.value += part.value;
                all.error += part.error;
            };
            let all = by_rule(from, to);
            if all.value.is_finite() {
                return add(all);
            }
            for [from, to] in finite(from, to, cost) {
                let part = by_rule(from, to);
                // A part that is infinite between two samples is excluded from the value and added to the error.
                add(if part.value.is_finite() {
                    part
                } else {
                    let error = (to - from) / f64::from(SAMPLES) * to;
                    let value = line_of_finite(from, to, &value);
                    Approximate { value, error }
                });
            }
        };
        if views == 1 {
            let sight = headed.sight(0, &self.walk);
            for interval in &self.intervals {
                add(interval.from, interval.to, &|t| of_view(sight.at(t)));
            }
            return all;
        }
        let sights: Vec<ViewAlongLine> = (0..views)
            .map(|view| headed.sight(view, &self.walk))
            .collect();
        let mut ends: Vec<f64> = Vec::new();
        let mut seeing: Vec<ViewAlongLine> = Vec::with_capacity(views);
        for interval in &self.intervals {
            let changes = self.seen.iter().flat_map(|(_, s)| [s.from, s.to]);
            let inner = changes.filter(|end| *end > interval.from && *end < interval.to);
            ends.clear();
            ends.extend(inner.chain([interval.from, interval.to]));
            ends.sort_by(f64::total_cmp);
            for pair in ends.windows(2) {
                let middle = 0.5 * (pair[0] + pair[1]);
                let sees = |view: usize| {
                    let mut own = self.seen.iter().filter(|(of, _)| *of == view);
                    own.any(|(_, s)| s.from <= middle && middle <= s.to)
                };
                let of_those = sights.iter().enumerate().filter(|(view, _)| sees(*view));
                seeing.clear();
                seeing.extend(of_those.map(|(_, sight)| *sight));
                // If the pose is in the set without a view, as in a union with a box, use the views of all tags.
                if seeing.is_empty() {
                    seeing.extend(&sights);
                }
                let cost = |t: f64| {
                    let costs = seeing.iter().map(|sight| of_view(sight.at(t)));
                    costs.fold(f64::INFINITY, f64::min)
                };
                add(pair[0], pair[1], &cost);
            }
        }
        all
    }
}

/// The number of sampling steps of an interval, to search for an infinite cost.
const SAMPLES: u32 = 20;

/// Returns the parts of an interval at whose samples the cost is finite, up to the points at which it becomes
/// infinite.
fn finite(from: f64, to: f64, cost: &dyn Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let at = |k: u32| from + (to - from) * f64::from(k) / f64::from(SAMPLES);
    let mut parts: Vec<[f64; 2]> = Vec::new();
    let mut begin = None;
    let (mut before, mut was) = (from, false);
    for k in 0..=SAMPLES {
        let is = cost(at(k)).is_finite();
        if is != was {
            let [mut low, mut high] = [before, at(k)];
            for _ in 0..36 {
                let middle = 0.5 * (low + high);
                if cost(middle).is_finite() == was {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            if is {
                begin = Some(high);
            } else if let Some(begin) = begin.take() {
                parts.push([begin, low]);
            }
        }
        (before, was) = (at(k), is);
    }
    parts.extend(begin.map(|begin| [begin, to]));
    parts.retain(|[from, to]| from < to);
    parts
}

/// Returns the integral by 15 nodes. Infinite values count as zero.
fn line_of_finite(from: f64, to: f64, value: &dyn Fn(f64) -> f64) -> f64 {
    let value = |t: f64| Some(value(t)).filter(|v| v.is_finite()).unwrap_or(0.0);
    line(from, to, value).value
}
