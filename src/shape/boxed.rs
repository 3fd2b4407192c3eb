//! Boxes: x, y and yaw each in an interval.

use super::Tolerance;

/// `x`, `y`, `yaw` each in a closed interval, in the goal frame.
///
/// The yaw interval is an arc: a yaw is inside if yaw + 360 k lies in `[lo, hi]` for some integer k, with
/// `lo <= hi <= lo + 360`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxSet {
    /// `[lo, hi]`, metres, goal frame.
    pub x: [f64; 2],
    /// `[lo, hi]`, metres, goal frame.
    pub y: [f64; 2],
    /// `[lo, hi]`, degrees, goal frame.
    pub yaw_deg: [f64; 2],
}

/// Returns `true` if an arc in degrees is the whole circle, except for the rounding of its decimal ends (1e-9
/// deg, a hundredth of a unit of a table's headings).
#[must_use]
pub fn is_whole_circle([lo, hi]: [f64; 2]) -> bool {
    hi - lo >= 360.0 - 1e-9
}

/// Returns `true` if the interval in degrees is a valid arc: not reversed, and no more than the whole circle.
#[must_use]
pub fn is_arc([lo, hi]: [f64; 2]) -> bool {
    lo <= hi && hi - lo <= 360.0 + 1e-9
}

impl BoxSet {
    /// Returns the box for a goal that may be off by a tolerance. Its sides shrink by the largest distance
    /// that one of its points can move, its arc by the turn. The result may be empty.
    #[must_use]
    pub(crate) fn within(self, tolerance: Tolerance) -> Self {
        if tolerance.is_none() {
            return self;
        }
        let farthest = |[lo, hi]: [f64; 2]| lo.abs().max(hi.abs());
        let reach = tolerance.reach(libm::hypot(farthest(self.x), farthest(self.y)));
        let less = |[lo, hi]: [f64; 2], by: f64| [lo + by, hi - by];
        Self {
            x: less(self.x, reach),
            y: less(self.y, reach),
            yaw_deg: if is_whole_circle(self.yaw_deg) {
                self.yaw_deg
            } else {
                less(self.yaw_deg, tolerance.turn_deg)
            },
        }
    }

    /// Returns `true` if the box contains no pose.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        [self.x, self.y, self.yaw_deg]
            .iter()
            .any(|[lo, hi]| lo > hi)
    }

    /// Computes the distance to the nearer border on each axis, positive inside; yaw in radians.
    pub(crate) fn slacks(
        &self,
        x: f64,
        y: f64,
        yaw: f64,
        note: &mut impl FnMut(&'static str, f64),
    ) {
        let within = |value: f64, [lo, hi]: [f64; 2]| (value - lo).min(hi - value);
        note("x", within(x, self.x));
        note("y", within(y, self.y));
        let [lo, hi] = self.yaw_deg.map(f64::to_radians);
        let turn = core::f64::consts::TAU;
        // Only the representative nearest to the middle of the arc can be inside.
        let middle = 0.5 * (lo + hi);
        let nearest = yaw - turn * libm::round((yaw - middle) / turn);
        let slack = if is_whole_circle(self.yaw_deg) {
            core::f64::consts::PI
        } else {
            within(nearest, [lo, hi])
        };
        note("yaw", slack);
    }
}

/// Largest number of boxes that [`maximal`] keeps.
const MOST: usize = 64;

/// Replaces the boxes of a union by boxes that are as large as the union allows. Two boxes that overlap or share a face give a third
/// box across both. Together the boxes still equal the union. Only comparisons: no limit is rounded.
///
/// On one axis the third box has the union of both intervals, which must meet; on the others it has their intersection. This is
/// repeated until no box is new. (It finds all boxes of the union that are not part of a larger one, but at most [`MOST`].)
#[must_use]
pub(crate) fn maximal(mut boxes: Vec<BoxSet>) -> Vec<BoxSet> {
    let mut first = 0;
    loop {
        let known = boxes.len();
        let mut more: Vec<BoxSet> = Vec::new();
        for (number, b) in boxes.iter().enumerate().skip(first) {
            let before = boxes.iter().take(number);
            let joined = before.flat_map(|a| (0..3).filter_map(|axis| a.joined(b, axis)));
            more.extend(joined);
        }
        for new in more {
            if !boxes.iter().any(|known| known.holds(&new)) && boxes.len() < MOST {
                boxes.push(new);
            }
        }
        first = known;
        if boxes.len() == known || boxes.len() >= MOST {
            break;
        }
    }
    // The last of equal boxes is kept.
    let kept = (0..boxes.len()).filter(|number| {
        let own = &boxes[*number];
        !boxes.iter().enumerate().any(|(other, larger)| {
            other != *number && larger.holds(own) && (!own.holds(larger) || other > *number)
        })
    });
    kept.map(|number| boxes[number]).collect()
}

impl BoxSet {
    const fn intervals(&self) -> [[f64; 2]; 3] {
        [self.x, self.y, self.yaw_deg]
    }

    /// Returns `true` if each interval contains that of the other box.
    fn holds(&self, other: &Self) -> bool {
        let pairs = self.intervals().into_iter().zip(other.intervals());
        pairs.into_iter().all(|([a, b], [c, d])| a <= c && d <= b)
    }

    /// Returns the box across two boxes along an axis, in their union; `None` if they do not meet on that axis.
    fn joined(&self, other: &Self, axis: usize) -> Option<Self> {
        let mut both = self.intervals();
        for (number, ([lo, hi], [from, to])) in both.iter_mut().zip(other.intervals()).enumerate() {
            let inner = [lo.max(from), hi.min(to)];
            if inner[0] > inner[1] {
                return None;
            }
            if number == axis {
                [*lo, *hi] = [lo.min(from), hi.max(to)];
            } else if inner[0] < inner[1] {
                [*lo, *hi] = inner;
            } else {
                return None;
            }
        }
        let [x, y, yaw_deg] = both;
        is_arc(yaw_deg).then_some(Self { x, y, yaw_deg })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(x: [f64; 2], y: [f64; 2], yaw_deg: [f64; 2]) -> BoxSet {
        BoxSet { x, y, yaw_deg }
    }

    #[test]
    fn lane_and_bay_with_common_face_get_a_box_across() {
        let (lane, bay) = (
            of([-2.0, 0.0], [-0.5, 0.5], [-25.0, 25.0]),
            of([0.0, 0.8], [-0.15, 0.15], [-10.0, 10.0]),
        );
        let across = of([-2.0, 0.8], [-0.15, 0.15], [-10.0, 10.0]);
        assert_eq!(maximal(vec![lane, bay]), [lane, across]);
        assert_eq!(maximal(vec![lane, lane]), [lane]);
        // Apart by a hair, or touching at an edge only.
        let apart = of([1e-9, 0.8], [-0.15, 0.15], [-10.0, 10.0]);
        assert_eq!(maximal(vec![lane, apart]), [lane, apart]);
        let edge = of([0.0, 0.8], [0.5, 0.9], [-10.0, 10.0]);
        assert_eq!(maximal(vec![lane, edge]), [lane, edge]);
        // More than once around.
        let [west, east] = [[-200.0, 0.0], [0.0, 200.0]].map(|yaw| of([0.0, 1.0], [0.0, 1.0], yaw));
        assert_eq!(maximal(vec![west, east]), [west, east]);
    }

    proptest! {
        /// On small whole numbers: the same union, and each box cannot grow by one on any side.
        #[test]
        fn maximal_boxes_equal_the_union_and_cannot_grow(
            limits in proptest::collection::vec(proptest::array::uniform6(0i32..6), 1..6)
        ) {
            let boxes: Vec<BoxSet> = limits
                .iter()
                .map(|[a, b, c, d, e, f]| {
                    let interval = |a: &i32, b: &i32| [f64::from(*a.min(b)), f64::from(*a.max(b) + 1)];
                    of(interval(a, b), interval(c, d), interval(e, f))
                })
                .collect();
            let found = maximal(boxes.clone());
            // By unit cells.
            let cell = |x: i32, y: i32, w: i32| of([x, x + 1].map(f64::from), [y, y + 1].map(f64::from), [w, w + 1].map(f64::from));
            let inside = |among: &[BoxSet], x, y, w| among.iter().any(|b| b.holds(&cell(x, y, w)));
            let cells = |b: &BoxSet| {
                let [x, y, w] = b.intervals().map(|[lo, hi]| lo as i32..hi as i32);
                let each = x.flat_map(move |x| { let w = w.clone(); y.clone().flat_map(move |y| w.clone().map(move |w| (x, y, w))) });
                each.collect::<Vec<_>>()
            };
            for x in 0..7 { for y in 0..7 { for w in 0..7 {
                prop_assert_eq!(inside(&boxes, x, y, w), inside(&found, x, y, w));
            }}}
            for b in &found {
                for axis in 0..3 {
                    for side in 0..2 {
                        let mut grown = b.intervals();
                        grown[axis][side] += if side == 0 { -1.0 } else { 1.0 };
                        let [x, y, yaw] = grown;
                        let all = cells(&of(x, y, yaw)).into_iter().all(|(x, y, w)| inside(&boxes, x, y, w));
                        prop_assert!(!all, "{b:?} can grow");
                    }
                }
            }
        }
    }
}
