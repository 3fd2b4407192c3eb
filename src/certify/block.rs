//! Blocks of poses: a rectangle of positions over an interval of headings.
//!
//! For fixed yaw, each convex part of a set (a box, a footprint, a view by a pinhole camera, one side of what is excluded) has slacks that are
//! concave functions of the position (x, y). A rectangle is then inside exactly if its four corners are, for every yaw of the block; the
//! remaining problem is one-dimensional. Over the yaw, a slack is bounded from below by its values, or by its middle
//! value and its derivative (mean value form). A monotonic slack is bounded by its smaller end. If none of these
//! suffices, the yaw interval is halved.

use super::{Interval, Slope, sharp};
use crate::shape::{
    ALL, BoxSet, ConvexPart, NONE, Parts, Planar, PoseDeg, Ready, Scalar, Selection, SuccessSet,
    is_whole_circle, selected,
};

/// A closed block of poses in the goal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Lower and upper end, micrometres, goal frame.
    pub x_um: [i64; 2],
    /// Lower and upper end, micrometres, goal frame.
    pub y_um: [i64; 2],
    /// Lower and upper end, 2^-32 turn; any number of turns. For footprints and visibility less than a quarter turn
    /// wide.
    pub yaw: [i64; 2],
}

/// Assumed width of a box's border, metres.
///
/// A box's limits are decimal numbers (0.06) and so are the cells' edges; as `f64` each is off by
/// its rounding. The error budget of [`crate::contain`] has a line for this and the next.
pub const BOX_BORDER_M: f64 = 1e-11;

/// Assumed width of a box's border, radians: slab edges are whole units of 2^-32 turn (1.47e-9 rad), a box's
/// degrees are not.
pub const BOX_BORDER_RAD: f64 = 2e-9;

/// Largest number of yaw halvings before a block counts as not proven: 2^-10 of a slab.
const DEEPEST: u32 = 10;

/// A convex part of a success set prepared for proofs: the numbers of the site are enclosed once.
#[derive(Debug)]
pub struct PartProver {
    boxes: Vec<BoxSet>,
    plain: Vec<Ready<Interval>>,
    slopes: Vec<Ready<Slope>>,
}

/// A success set prepared for proofs.
#[derive(Debug)]
pub struct Prover {
    parts: Parts,
    /// The set itself, if it is convex at every heading.
    only: Option<PartProver>,
}

/// Largest number of halvings of a block that no single part contains.
const MOST_HALVINGS: u32 = 12;

impl Prover {
    /// Prepares a success set for proofs: its numbers become intervals that enclose them.
    #[must_use]
    pub fn new(set: &SuccessSet) -> Self {
        let parts = Parts::of(set);
        Self {
            only: parts.only().map(|part| PartProver::new(&part)),
            parts,
        }
    }

    /// Returns `true` if the set is convex in (x, y) at every heading.
    #[must_use]
    pub const fn is_convex(&self) -> bool {
        self.only.is_some()
    }

    /// Returns `true` if every pose of the block is proven to lie in the success set; `false` means not proven.
    ///
    /// If the set is not convex, the block must lie in the part with the largest slack at its samples, or is
    /// halved.
    #[must_use]
    pub fn is_inside(&self, block: &Block) -> bool {
        match &self.only {
            Some(prover) => prover.is_inside(block),
            None => self.is_covered(block, MOST_HALVINGS),
        }
    }

    /// Returns `true` if every pose at a position (m) over an interval of headings (2^-32 turn, less than a quarter
    /// of a turn wide) is proven to lie in the success set; `false` means not proven.
    #[must_use]
    pub(super) fn is_inside_at(&self, position: [f64; 2], yaw: [i64; 2]) -> bool {
        match &self.only {
            Some(prover) => prover.is_inside_at(position, yaw),
            None => {
                let [x_um, y_um] =
                    position.map(|m| [libm::floor(m * 1e6) as i64, libm::ceil(m * 1e6) as i64]);
                self.is_inside(&Block { x_um, y_um, yaw })
            }
        }
    }

    /// Prepares the part with the largest slack at these poses of the goal frame (x, y, yaw; m, rad); the set
    /// itself if it is convex.
    #[must_use]
    pub(crate) fn part(&self, poses: &[[f64; 3]]) -> PartProver {
        PartProver::new(&self.parts.holding(poses).0)
    }

    fn is_covered(&self, block: &Block, halvings: u32) -> bool {
        let samples = samples(block);
        let (part, slack) = self.parts.holding(&samples);
        // If a sample is far outside, no part contains the block.
        if slack >= -1e-6 && PartProver::new(&part).is_inside(block) {
            return true;
        }
        // A sample that lies in no part decides the block.
        let alone = |pose: &[f64; 3]| self.parts.holding(core::slice::from_ref(pose)).1;
        if halvings == 0 || samples.iter().any(|pose| alone(pose) < -1e-6) {
            return false;
        }
        block.halves().is_some_and(|halves| {
            halves
                .iter()
                .all(|half| self.is_covered(half, halvings - 1))
        })
    }
}

/// Converts 2^-32 turn to radians, in plain floats.
pub(crate) fn radians(units: i64) -> f64 {
    units as f64 / 4_294_967_296.0 * core::f64::consts::TAU
}

/// Returns the corners and the middle of a block: m, m, rad.
fn samples(block: &Block) -> [[f64; 3]; 9] {
    let metres = |um: i64| um as f64 * 1e-6;
    let [x0, x1] = block.x_um.map(metres);
    let [y0, y1] = block.y_um.map(metres);
    let [w0, w1] = block.yaw.map(radians);
    [
        [x0, y0, w0],
        [x1, y0, w0],
        [x1, y1, w0],
        [x0, y1, w0],
        [x0, y0, w1],
        [x1, y0, w1],
        [x1, y1, w1],
        [x0, y1, w1],
        [0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (w0 + w1)],
    ]
}

impl Block {
    /// Returns the two halves of the block, cut where it is widest, with a radian counted as a metre; `None` if it
    /// cannot be cut.
    fn halves(&self) -> Option<[Self; 2]> {
        let width = |[lo, hi]: [i64; 2]| hi - lo;
        // 2^-32 turn in micrometres at one metre.
        let yaw = width(self.yaw) as f64 * (core::f64::consts::TAU * 1e6 / 4_294_967_296.0);
        let (x, y) = (width(self.x_um) as f64, width(self.y_um) as f64);
        let cut = |[lo, hi]: [i64; 2]| {
            let half = lo + (hi - lo) / 2;
            ([lo, half], [half, hi])
        };
        let (mut a, mut b) = (*self, *self);
        if x >= y && x >= yaw {
            (a.x_um, b.x_um) = cut(self.x_um);
        } else if y >= yaw {
            (a.y_um, b.y_um) = cut(self.y_um);
        } else {
            (a.yaw, b.yaw) = cut(self.yaw);
        }
        (x.max(y).max(yaw) >= 2.0 && width(a.yaw) > 0).then_some([a, b])
    }
}

impl PartProver {
    /// Encloses the numbers of a part in intervals.
    #[must_use]
    pub(crate) fn new(part: &ConvexPart) -> Self {
        Self {
            boxes: part.boxes().copied().collect(),
            plain: part
                .constraints()
                .map(|set| set.resolve(part.goal))
                .collect(),
            slopes: part
                .constraints()
                .map(|set| set.resolve(part.goal))
                .collect(),
        }
    }

    /// Returns `true` if every pose of the block is proven to lie in the part; `false` means not proven.
    #[must_use]
    pub(crate) fn is_inside(&self, block: &Block) -> bool {
        self.boxes.iter().all(|shape| is_in_box(shape, block))
            && (self.boxes.len() == self.plain.len()
                || corners(block)
                    .into_iter()
                    .all(|corner| self.holds_at(corner, block.yaw, ALL, DEEPEST)))
    }

    /// Returns `true` if every pose at a position (m) over a yaw interval is proven to lie in the part: a fourth of
    /// the work of a block.
    fn is_inside_at(&self, position: [f64; 2], yaw: [i64; 2]) -> bool {
        let at = position.map(Interval::point);
        self.boxes
            .iter()
            .all(|shape| is_position_in_box(shape, at.map(|m| [m, m])) && is_in_arc(shape, yaw))
            && (self.boxes.len() == self.plain.len() || self.holds_at(at, yaw, ALL, DEEPEST))
    }

    /// Returns `true` if the slacks of a selection are proven at a position over a yaw interval.
    fn holds_at(&self, [x, y]: [Interval; 2], yaw: [i64; 2], open: Selection, depth: u32) -> bool {
        let ends = yaw.map(Interval::radians);
        let range = ends[0].hull(ends[1]);
        let [cos, sin] = range.cos_sin();
        let open = self.open(&Planar { x, y, cos, sin }, open);
        if open == NONE {
            return true;
        }
        let at = |yaw: Interval| {
            let [cos, sin] = Slope::cos_sin_of(yaw);
            let pose = Planar {
                x: Slope::constant(x),
                y: Slope::constant(y),
                cos,
                sin,
            };
            self.slopes(&pose, open)
        };
        let over = at(range);
        let middle = at(Interval::point(range.middle()));
        let offset = range - Interval::point(range.middle());
        let unsettled = |(over, middle): (&Slope, &Slope)| {
            !over.value.is_at_least_zero()
                && !(middle.value + over.by_yaw * offset).is_at_least_zero()
        };
        let mut left = over
            .iter()
            .zip(&middle)
            .enumerate()
            .filter(|(_, pair)| unsettled(*pair))
            .map(|(index, _)| index)
            .peekable();
        if left.peek().is_none() {
            return true;
        }
        let (low, high) = (at(ends[0]), at(ends[1]));
        let mut monotonic = true;
        for index in left {
            let (low, high) = (low[index].value, high[index].value);
            // A pose of the block, at an end of the yaw interval, is certainly outside: halving cannot help.
            if low.hi < 0.0 || high.hi < 0.0 {
                return false;
            }
            let slope = over[index].by_yaw;
            let rises = slope.lo >= 0.0 && low.is_at_least_zero();
            let falls = slope.hi <= 0.0 && high.is_at_least_zero();
            monotonic &= rises || falls;
        }
        if monotonic {
            return true;
        }
        if depth == 0 || yaw[1] - yaw[0] < 2 {
            return false;
        }
        let half = yaw[0] + (yaw[1] - yaw[0]) / 2;
        self.holds_at([x, y], [yaw[0], half], open, depth - 1)
            && self.holds_at([x, y], [half, yaw[1]], open, depth - 1)
    }

    /// Returns those constraints of a selection that are not shown to hold at a pose that moves with the yaw: over
    /// a range of yaws, given the pose at its middle. (For boxes only x and y; their yaw is
    /// [`PartProver::arc_holds`].)
    pub(crate) fn unproven(
        &self,
        over: &Planar<Slope>,
        middle: &Planar<Interval>,
        offset: Interval,
        selection: Selection,
    ) -> Selection {
        // Constraints that need no slopes are evaluated first. (Boxes are numbered after everything else.)
        let plain = Planar {
            x: over.x.value,
            y: over.y.value,
            cos: over.cos.value,
            sin: over.sin.value,
        };
        let mut open = NONE;
        let selection = self.open(&plain, selection) | self.boxed(selection);
        let mut over_all = Vec::with_capacity(8);
        let mut note_over = |index: usize, _: &'static str, slack: Slope| {
            over_all.push((index, slack));
        };
        let mut middle_all = Vec::with_capacity(8);
        let mut note_middle = |_: usize, _: &'static str, slack: Interval| middle_all.push(slack);
        if selection != NONE {
            let first = all_slacks(&self.slopes, over, selection, &mut note_over);
            all_slacks(&self.plain, middle, selection, &mut note_middle);
            for (number, shape) in self.boxes.iter().enumerate() {
                let first = first + 4 * number;
                if (first..first + 4).any(|index| selection & selected(index) != NONE) {
                    let both = sides(shape, over.x, over.y)
                        .into_iter()
                        .zip(sides(shape, middle.x, middle.y));
                    for (index, (over, middle)) in both.enumerate() {
                        note_over(first + index, "side", over);
                        note_middle(0, "side", middle);
                    }
                }
            }
        }
        for ((index, over), middle) in over_all.into_iter().zip(middle_all) {
            if !sharp(over, middle, offset).is_at_least_zero() {
                open |= selected(index);
            }
        }
        open
    }

    /// Returns `true` if a pose is certainly outside of the part. (Boxes are not evaluated.)
    pub(crate) fn excludes(&self, pose: &Planar<Interval>) -> bool {
        let mut outside = false;
        let mut note = |_: usize, _: &'static str, slack: Interval| outside |= slack.hi < 0.0;
        all_slacks(&self.plain, pose, ALL, &mut note);
        outside
    }

    /// Returns the part of a selection that may belong to a box: everything if there is a box, since its numbers
    /// come last.
    fn boxed(&self, selection: Selection) -> Selection {
        if self.boxes.is_empty() {
            NONE
        } else {
            selection
        }
    }

    /// Returns `true` if a range of headings (2^-32 turn) lies in the arcs of the part's boxes.
    pub(crate) fn arc_holds(&self, yaw: [i64; 2]) -> bool {
        self.boxes.iter().all(|shape| is_in_arc(shape, yaw))
    }

    /// Returns the slacks of a selection whose values alone do not show that they are at least zero. (Without
    /// boxes.)
    fn open(&self, pose: &Planar<Interval>, selection: Selection) -> Selection {
        let mut open = NONE;
        let mut note = |index: usize, _: &'static str, slack: Interval| {
            if !slack.is_at_least_zero() {
                open |= selected(index);
            }
        };
        all_slacks(&self.plain, pose, selection, &mut note);
        open
    }

    /// Returns the slacks of a selection with their derivatives by the yaw. (Without boxes.)
    fn slopes(&self, pose: &Planar<Slope>, selection: Selection) -> Vec<Slope> {
        let mut all = Vec::with_capacity(8);
        let mut note = |_: usize, _: &'static str, slack: Slope| all.push(slack);
        all_slacks(&self.slopes, pose, selection, &mut note);
        all
    }
}

/// Computes the slacks of a selection, one set after the other; returns the number after the last.
fn all_slacks<S: Scalar>(
    sets: &[Ready<S>],
    pose: &Planar<S>,
    selection: Selection,
    note: &mut impl FnMut(usize, &'static str, S),
) -> usize {
    sets.iter()
        .fold(0, |first, set| set.slacks(pose, selection, first, note))
}

/// Returns the slacks of a box's sides, including the border.
fn sides<S: Scalar>(shape: &BoxSet, x: S, y: S) -> [S; 4] {
    let border = S::exact(BOX_BORDER_M);
    let [[x0, x1], [y0, y1]] = [shape.x, shape.y].map(|ends| ends.map(S::exact));
    [x - x0, x1 - x, y - y0, y1 - y].map(|side| side + border)
}

/// Encloses micrometres in metres.
fn metres(um: i64) -> Interval {
    Interval::point(um as f64) * Interval::point(1e6).reciprocal()
}

/// Returns the four corners of a rectangle, metres.
fn corners(block: &Block) -> [[Interval; 2]; 4] {
    let [x0, x1] = block.x_um.map(metres);
    let [y0, y1] = block.y_um.map(metres);
    [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

/// Returns `true` if an interval lies in another that is widened by a border at both ends.
fn is_within([lo, hi]: [Interval; 2], [from, to]: [Interval; 2], border: f64) -> bool {
    let border = Interval::point(border);
    (lo - from + border).is_at_least_zero() && (to - hi + border).is_at_least_zero()
}

fn is_in_box(shape: &BoxSet, block: &Block) -> bool {
    let position = [block.x_um, block.y_um].map(|ends| ends.map(metres));
    is_position_in_box(shape, position) && is_in_arc(shape, block.yaw)
}

/// Returns `true` if positions, between ends in metres, lie in a box. Headings are ignored.
fn is_position_in_box(shape: &BoxSet, [x, y]: [[Interval; 2]; 2]) -> bool {
    is_within(x, shape.x.map(Interval::point), BOX_BORDER_M)
        && is_within(y, shape.y.map(Interval::point), BOX_BORDER_M)
}

/// Returns `true` if headings (2^-32 turn) lie in a box's arc.
fn is_in_arc(shape: &BoxSet, yaw: [i64; 2]) -> bool {
    if is_whole_circle(shape.yaw_deg) {
        return true;
    }
    let [from_deg, to_deg] = shape.yaw_deg;
    let radians =
        |deg: f64| Interval::point(deg) * Interval::PI * Interval::point(180.0).reciprocal();
    let arc = [radians(from_deg), radians(to_deg)];
    // The turn that brings the block's middle nearest to the arc's.
    let turn = core::f64::consts::TAU;
    let yaw = yaw.map(Interval::radians);
    let middle = 0.5 * (yaw[0].middle() + yaw[1].middle());
    let turns = libm::round((0.5 * (arc[0].middle() + arc[1].middle()) - middle) / turn);
    let shift = Interval::PI * Interval::point(2.0 * turns);
    is_within(yaw.map(|end| end + shift), arc, BOX_BORDER_RAD)
}

/// Encloses the goal's cosine and sine, for comparison with the values stored in a table.
#[must_use]
pub fn goal_cos_sin(goal: PoseDeg) -> [Interval; 2] {
    Interval::cos_sin_deg(goal.yaw_deg)
}
