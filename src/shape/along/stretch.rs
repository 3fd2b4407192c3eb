//! Intervals of a line, and the parts of them that satisfy a constraint.

/// Marks an end of an interval that no constraint ends, only the line segment itself.
pub const OPEN: u32 = u32::MAX;

/// An interval of a line, in units of the line's direction vector, and the constraints that end it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineInterval {
    /// Least `t`, in units of the direction vector.
    pub from: f64,
    /// Largest `t`.
    pub to: f64,
    /// Numbers of the constraints at the interval's ends, or [`OPEN`].
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

    /// Reports the parts where a function is at least zero, in order. The function changes its sign only at these
    /// roots.
    pub(crate) fn parts(
        self,
        roots: &mut [f64],
        number: u32,
        holds: impl Fn(f64) -> bool,
        mut note: impl FnMut(Self),
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
                part.take().into_iter().for_each(&mut note);
            }
            from = to;
        }
        part.into_iter().for_each(note);
    }

    /// Returns the interval with a number added to those of its constraints.
    pub(crate) fn numbered(self, from: u32) -> Self {
        let ended_by = self
            .ended_by
            .map(|by| if by == OPEN { OPEN } else { from + by });
        Self { ended_by, ..self }
    }
}

/// Replaces the two lists at the end of a list, `from..middle` and `middle..`, by their intersection. Both are in order,
/// and so is the result.
pub(crate) fn intersect(all: &mut Vec<LineInterval>, from: usize, middle: usize) {
    let end = all.len();
    let (mut i, mut j) = (from, middle);
    while i < middle && j < end {
        let (x, y) = (all[i], all[j]);
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
    all.drain(from..end);
}

/// Replaces the intervals from an index on, in any order, by their union in order.
pub(crate) fn unite(all: &mut Vec<LineInterval>, from: usize) {
    all[from..].sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut end = from;
    for index in from..all.len() {
        let next = all[index];
        match all[from..end].last_mut() {
            Some(last) if next.from <= last.to => {
                if next.to > last.to {
                    last.to = next.to;
                    last.ended_by[1] = next.ended_by[1];
                }
            }
            _ => {
                all[end] = next;
                end += 1;
            }
        }
    }
    all.truncate(end);
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
    fn interval_ends_keep_their_constraint() {
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
            |part| parts.push(part),
        );
        let outer = [stretch(0.0, 3.0, OPEN, 9), stretch(5.0, 10.0, 9, OPEN)];
        assert_eq!(parts, outer);
        // What comes before the lists stays.
        let before = stretch(7.0, 8.0, 1, 2);
        let mut all = std::vec![before];
        all.extend(&parts);
        all.push(stretch(1.0, 6.0, 4, 5));
        intersect(&mut all, 1, 3);
        let common = [stretch(1.0, 3.0, 4, 9), stretch(5.0, 6.0, 9, 5)];
        assert_eq!(all, [before, common[0], common[1]]);
        intersect(&mut all, 1, 3);
        assert_eq!(all, [before]);
        all.push(stretch(2.0, 5.0, 7, 8));
        all.extend(&parts);
        unite(&mut all, 1);
        assert_eq!(all, [before, whole]);
        assert_eq!(
            outer.map(|part| part.numbered(100)),
            [stretch(0.0, 3.0, OPEN, 109), stretch(5.0, 10.0, 109, OPEN)]
        );
    }

    #[test]
    fn union_keeps_gaps() {
        let mut all = std::vec![
            stretch(6.0, 7.0, 1, 2),
            stretch(0.0, 2.0, 3, 4),
            stretch(1.0, 3.0, 5, 6),
            stretch(1.5, 2.5, 7, 8),
        ];
        unite(&mut all, 0);
        assert_eq!(all, [stretch(0.0, 3.0, 3, 6), stretch(6.0, 7.0, 1, 2)]);
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
