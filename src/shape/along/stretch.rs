//! Intervals of a line, and the parts of them that satisfy a constraint.

/// Marks an end of an interval that no constraint ends, only the line segment itself.
pub const OPEN: u32 = u32::MAX;

/// An interval of a line, in units of the line's direction vector, and the constraints that end it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineInterval {
    /// Least `t`.
    pub from: f64,
    /// Largest `t`.
    pub to: f64,
    /// Numbers of the constraints at its ends, or [`OPEN`].
    pub ended_by: [u32; 2],
}

impl LineInterval {
    /// Returns the interval of a whole line segment of this length.
    pub(crate) const fn of(length: f64) -> Self {
        Self {
            from: 0.0,
            to: length,
            ended_by: [OPEN; 2],
        }
    }

    pub(crate) fn middle(&self) -> f64 {
        0.5 * (self.from + self.to)
    }

    /// Returns the part where `at + slope t >= 0`.
    pub(crate) fn clipped(self, at: f64, slope: f64, number: u32) -> Option<Self> {
        let mut left = self;
        if slope == 0.0 {
            return (at >= 0.0).then_some(left);
        }
        let root = -at / slope;
        if slope > 0.0 && root > left.from {
            left.from = root;
            left.ended_by[0] = number;
        } else if slope < 0.0 && root < left.to {
            left.to = root;
            left.ended_by[1] = number;
        }
        (left.from < left.to).then_some(left)
    }

    /// Appends the parts where a function is at least zero. The function changes its sign only at
    /// these roots.
    pub(crate) fn parts(
        self,
        roots: &mut [f64],
        number: u32,
        holds: impl Fn(f64) -> bool,
        into: &mut Vec<Self>,
    ) {
        roots.sort_by(f64::total_cmp);
        let mut part: Option<Self> = None;
        let mut from = self.from;
        let inner = roots.iter().copied();
        let inner = inner.filter(|root| *root > self.from && *root < self.to);
        for to in inner.chain([self.to]) {
            let next = Self {
                from,
                to,
                ended_by: [
                    if from == self.from {
                        self.ended_by[0]
                    } else {
                        number
                    },
                    if to == self.to {
                        self.ended_by[1]
                    } else {
                        number
                    },
                ],
            };
            if from < to && holds(next.middle()) {
                part = Some(part.map_or(next, |before| Self {
                    from: before.from,
                    to,
                    ended_by: [before.ended_by[0], next.ended_by[1]],
                }));
            } else if from < to {
                into.extend(part.take());
            }
            from = to;
        }
        into.extend(part);
    }
}

/// Returns the intersection of two lists of intervals; both are in order, and so is the result.
pub(crate) fn both(a: &[LineInterval], b: &[LineInterval]) -> Vec<LineInterval> {
    let mut all = Vec::new();
    let (mut i, mut j) = (0, 0);
    while let (Some(x), Some(y)) = (a.get(i), b.get(j)) {
        let first = if x.from >= y.from { x } else { y };
        let last = if x.to <= y.to { x } else { y };
        if first.from < last.to {
            all.push(LineInterval {
                from: first.from,
                to: last.to,
                ended_by: [first.ended_by[0], last.ended_by[1]],
            });
        }
        if x.to <= y.to {
            i += 1;
        } else {
            j += 1;
        }
    }
    all
}

/// Returns the union of intervals in any order.
pub(crate) fn either(mut all: Vec<LineInterval>) -> Vec<LineInterval> {
    all.sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut union: Vec<LineInterval> = Vec::new();
    for stretch in all {
        match union.last_mut() {
            Some(last) if stretch.from <= last.to => {
                if stretch.to > last.to {
                    last.to = stretch.to;
                    last.ended_by[1] = stretch.ended_by[1];
                }
            }
            _ => union.push(stretch),
        }
    }
    union
}

/// Returns the real roots of `a t^2 + 2 b t + c`; NaN if there are none.
pub(crate) fn quadratic(a: f64, b: f64, c: f64) -> [f64; 2] {
    let square = b * b - a * c;
    if !(square >= 0.0) {
        return [f64::NAN; 2];
    }
    let q = -(b + libm::copysign(libm::sqrt(square), b));
    [q / a, c / q]
}

/// Returns the points where a continuous function changes its sign between samples of an interval.
pub(crate) fn roots(stretch: &LineInterval, samples: u32, value: impl Fn(f64) -> f64) -> Vec<f64> {
    let length = stretch.to - stretch.from;
    let at = |k: u32| stretch.from + length * f64::from(k) / f64::from(samples);
    let mut found = Vec::new();
    let (mut low, mut below) = (stretch.from, value(stretch.from) >= 0.0);
    for k in 1..=samples {
        let (high, above) = (at(k), value(at(k)) >= 0.0);
        if below != above {
            let [mut lo, mut hi] = [low, high];
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if middle <= lo || middle >= hi {
                    break;
                }
                if (value(middle) >= 0.0) == below {
                    lo = middle;
                } else {
                    hi = middle;
                }
            }
            found.push(0.5 * (lo + hi));
        }
        (low, below) = (high, above);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretch(from: f64, to: f64, a: u32, b: u32) -> LineInterval {
        LineInterval {
            from,
            to,
            ended_by: [a, b],
        }
    }

    #[test]
    fn ends_keep_what_ended_them() {
        let whole = LineInterval::of(10.0);
        assert_eq!(
            whole.clipped(-2.0, 1.0, 1).unwrap().clipped(5.0, -1.0, 2),
            Some(stretch(2.0, 5.0, 1, 2))
        );
        assert_eq!(whole.clipped(-1.0, 0.0, 1), None);
        assert_eq!(whole.clipped(20.0, -1.0, 1), Some(whole));
        // Outside of 3 to 5.
        let mut parts = Vec::new();
        whole.parts(
            &mut [5.0, f64::NAN, 3.0, -7.0],
            9,
            |t| (t - 4.0).abs() > 1.0,
            &mut parts,
        );
        let outer = [stretch(0.0, 3.0, OPEN, 9), stretch(5.0, 10.0, 9, OPEN)];
        assert_eq!(parts, outer);
        assert_eq!(
            both(&parts, &[stretch(1.0, 6.0, 4, 5)]),
            [stretch(1.0, 3.0, 4, 9), stretch(5.0, 6.0, 9, 5)]
        );
        parts.push(stretch(2.0, 5.0, 7, 8));
        assert_eq!(either(parts), [whole]);
    }

    #[test]
    fn roots_are_found() {
        let mut found = quadratic(1.0, -2.0, 3.0);
        found.sort_by(f64::total_cmp);
        assert_eq!(found, [1.0, 3.0]);
        assert!(quadratic(1.0, 0.0, 1.0)[0].is_nan());
        assert!(quadratic(0.0, 1.0, -4.0).contains(&2.0));
        let found = roots(&LineInterval::of(4.0), 7, |t| libm::sin(3.0 * t));
        let third = core::f64::consts::PI / 3.0;
        assert!(found.len() == 3);
        for (k, root) in found.iter().enumerate() {
            assert!((root - third * (k as f64 + 1.0)).abs() < 1e-14);
        }
    }
}
