//! Blocks of poses: a rectangle of positions over an interval of headings.
//!
//! For fixed yaw, footprint and visibility sets (pinhole) are convex in (x, y): their slacks are
//! concave functions of the position. A rectangle is then inside exactly when its four corners are,
//! for every yaw of the block; what is left is one-dimensional. Over the yaw, a slack is bounded
//! from below by its values, by its middle value and its derivative (mean value form), or, where it
//! is monotonic, by its smaller end; where none suffices the yaw interval is halved.

use super::{Interval, Slope, sharp};
use crate::shape::{
    ALL, BoxSet, NONE, Planar, PoseDeg, Resolved, Scalar, Selection, Shape, SuccessSet,
    is_whole_circle, selected,
};
use std::vec::Vec;

/// A closed block of poses in the goal frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Lower and upper end, micrometres.
    pub x_um: [i64; 2],
    /// Lower and upper end, micrometres.
    pub y_um: [i64; 2],
    /// Lower and upper end, 2^-32 turn; any number of turns, less than a quarter of one wide for
    /// footprints and visibility.
    pub yaw: [i64; 2],
}

/// How wide the border of a box is taken to be, metres.
///
/// A box's limits are decimal numbers (0.06) and so are the cells' edges; as `f64` each is off by
/// its rounding. The error budget of [`crate::contain`] has a line for this and the next.
pub const BOX_BORDER_M: f64 = 1e-11;

/// How wide the border of a box is taken to be, radians: slab edges are whole units of 2^-32 turn
/// (1.47e-9 rad), a box's degrees are not.
pub const BOX_BORDER_RAD: f64 = 2e-9;

/// Halvings of the yaw interval before a block counts as not proven: 2^-10 of a slab.
const DEEPEST: u32 = 10;

/// A success set made ready for proofs: the numbers of the site enclosed once.
#[derive(Debug)]
pub struct Prover<'a> {
    set: &'a SuccessSet,
    sight: Option<(Resolved<Interval>, Resolved<Slope>)>,
}

impl<'a> Prover<'a> {
    /// Encloses the numbers of a success set.
    #[must_use]
    pub fn new(set: &'a SuccessSet) -> Self {
        let sight = match &set.shape {
            Shape::Visibility(shape) => Some((shape.resolve(set.goal), shape.resolve(set.goal))),
            Shape::Box(_) | Shape::Footprint(_) => None,
        };
        Self { set, sight }
    }

    /// Whether every pose of the block lies in the success set. `true` is a proof; `false` means
    /// not proven.
    #[must_use]
    pub fn is_inside(&self, block: &Block) -> bool {
        match &self.set.shape {
            Shape::Box(shape) => is_in_box(shape, block),
            Shape::Footprint(_) | Shape::Visibility(_) => corners(block)
                .into_iter()
                .all(|corner| self.holds_at(corner, block.yaw, ALL, DEEPEST)),
        }
    }

    /// Whether the slacks of a selection hold at a position over a yaw interval.
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
            // A pose of the block, at an end, that is surely outside: no halving will help.
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

    /// Of a selection of the constraints, those that are not shown to hold at a pose that moves with the
    /// yaw: over a range of yaws and at its middle. (Of boxes x and y; their yaw is
    /// [`Prover::arc_holds`].)
    pub(crate) fn unproven(
        &self,
        over: &Planar<Slope>,
        middle: &Planar<Interval>,
        offset: Interval,
        selection: Selection,
    ) -> Selection {
        // What needs no slopes goes first.
        let plain = Planar {
            x: over.x.value,
            y: over.y.value,
            cos: over.cos.value,
            sin: over.sin.value,
        };
        let selection = match (&self.set.shape, &self.sight) {
            (Shape::Box(_), _) => selection,
            (Shape::Visibility(_), None) => return selection,
            _ => self.open(&plain, selection),
        };
        let mut over_all = Vec::with_capacity(8);
        let mut note_over = |index: usize, _: &'static str, slack: Slope| {
            over_all.push((index, slack));
        };
        let mut middle_all = Vec::with_capacity(8);
        let mut note_middle = |_: usize, _: &'static str, slack: Interval| middle_all.push(slack);
        match (&self.set.shape, &self.sight) {
            (Shape::Box(shape), _) => {
                for (index, side) in sides(shape, over.x, over.y).into_iter().enumerate() {
                    note_over(index, "side", side);
                }
                for side in sides(shape, middle.x, middle.y) {
                    note_middle(0, "side", side);
                }
            }
            (Shape::Footprint(shape), _) => {
                shape.slacks(over, selection, &mut note_over);
                shape.slacks(middle, selection, &mut note_middle);
            }
            (Shape::Visibility(_), Some((plain, slopes))) => {
                slopes.slacks(over, selection, &mut note_over);
                plain.slacks(middle, selection, &mut note_middle);
            }
            (Shape::Visibility(_), None) => {}
        }
        let mut open = NONE;
        for ((index, over), middle) in over_all.into_iter().zip(middle_all) {
            if !sharp(over, middle, offset).is_at_least_zero() {
                open |= selected(index);
            }
        }
        open
    }

    /// Whether a range of headings (2^-32 turn) lies in a box's arc; true for other shapes.
    pub(crate) fn arc_holds(&self, yaw: [i64; 2]) -> bool {
        match &self.set.shape {
            Shape::Box(shape) => is_in_arc(shape, yaw),
            Shape::Footprint(_) | Shape::Visibility(_) => true,
        }
    }

    /// The slacks of a selection whose values alone do not show that they are at least zero.
    fn open(&self, pose: &Planar<Interval>, selection: Selection) -> Selection {
        let mut open = NONE;
        let mut note = |index: usize, _: &'static str, slack: Interval| {
            if !slack.is_at_least_zero() {
                open |= selected(index);
            }
        };
        match (&self.set.shape, &self.sight) {
            (Shape::Footprint(shape), _) => shape.slacks(pose, selection, &mut note),
            (_, Some((plain, _))) => plain.slacks(pose, selection, &mut note),
            (_, None) => return ALL,
        }
        open
    }

    /// The slacks of a selection with their derivatives by the yaw.
    fn slopes(&self, pose: &Planar<Slope>, selection: Selection) -> Vec<Slope> {
        let mut all = Vec::with_capacity(8);
        let mut note = |_: usize, _: &'static str, slack: Slope| all.push(slack);
        match (&self.set.shape, &self.sight) {
            (Shape::Footprint(shape), _) => shape.slacks(pose, selection, &mut note),
            (_, Some((_, slopes))) => slopes.slacks(pose, selection, &mut note),
            (_, None) => {}
        }
        all
    }
}

/// The slacks of a box's sides, with the border.
fn sides<S: Scalar>(shape: &BoxSet, x: S, y: S) -> [S; 4] {
    let border = S::exact(BOX_BORDER_M);
    let [[x0, x1], [y0, y1]] = [shape.x, shape.y].map(|ends| ends.map(S::exact));
    [x - x0, x1 - x, y - y0, y1 - y].map(|side| side + border)
}

/// The four corners of a rectangle, metres.
fn corners(block: &Block) -> [[Interval; 2]; 4] {
    let metres = |um: i64| Interval::point(um as f64) * Interval::point(1e6).reciprocal();
    let [x0, x1] = block.x_um.map(metres);
    let [y0, y1] = block.y_um.map(metres);
    [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

/// Whether an interval lies in another, whose ends are as wide as a border.
fn is_within([lo, hi]: [Interval; 2], [from, to]: [Interval; 2], border: f64) -> bool {
    let border = Interval::point(border);
    (lo - from + border).is_at_least_zero() && (to - hi + border).is_at_least_zero()
}

fn is_in_box(shape: &BoxSet, block: &Block) -> bool {
    let metres = |um: i64| Interval::point(um as f64) * Interval::point(1e6).reciprocal();
    is_within(
        block.x_um.map(metres),
        shape.x.map(Interval::point),
        BOX_BORDER_M,
    ) && is_within(
        block.y_um.map(metres),
        shape.y.map(Interval::point),
        BOX_BORDER_M,
    ) && is_in_arc(shape, block.yaw)
}

/// Whether headings (2^-32 turn) lie in a box's arc.
fn is_in_arc(shape: &BoxSet, yaw: [i64; 2]) -> bool {
    if is_whole_circle(shape.yaw_deg) {
        return true;
    }
    let [from_deg, to_deg] = shape.yaw_deg;
    let radians =
        |deg: f64| Interval::point(deg) * Interval::PI * Interval::point(180.0).reciprocal();
    let arc = [radians(from_deg), radians(to_deg)];
    // The turn that brings the block's middle next to the arc's.
    let turn = core::f64::consts::TAU;
    let yaw = yaw.map(Interval::radians);
    let middle = 0.5 * (yaw[0].middle() + yaw[1].middle());
    let turns = libm::round((0.5 * (arc[0].middle() + arc[1].middle()) - middle) / turn);
    let shift = Interval::PI * Interval::point(2.0 * turns);
    is_within(yaw.map(|end| end + shift), arc, BOX_BORDER_RAD)
}

/// The goal's cosine and sine enclosed, for comparing them with what a table stores.
#[must_use]
pub fn goal_cos_sin(goal: PoseDeg) -> [Interval; 2] {
    Interval::cos_sin_deg(goal.yaw_deg)
}
