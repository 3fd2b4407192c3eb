//! Facets in floats: does one piece certainly contain a set?
//!
//! The terms are those of `contain::slab` for one slab: the whole set.

use super::spread::{Point, Spread, Square};
use crate::contain::facet_clearance_q14;
use crate::table::{Axes, Facets};
use std::vec::Vec;

/// Extent units that the integer code can round against acceptance at one facet: its own slack of 17 at most, as much again of what is rounded to
/// the nearest, 1 for the slack of the estimate, and 6 for terms that are rounded up. Together 41, times the length of a normal.
const ROUNDED: f64 = 44.0;
/// The largest turn that the integer code tests as one slab, radians; less than its half.
const MOST_TURN: f64 = 0.4999;
/// Upper bound of the rounding of turns and their powers: 2 of 2^-15.
const TURN_ROUNDED: f64 = 2.0 / 32_768.0;
/// A normal is at most this long.
const NORMAL: f64 = 1.0 + 1.0 / 128.0;
/// Slack of an arc, 2^-32 turn: 3 of the integer code, and the errors of the headings here.
const ARC_SLACK: u32 = 8;

/// A facet layout, lengths in micrometres.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pieces: Vec<Piece>,
    frames: Vec<Frame>,
    facets: Vec<Facet>,
    unit: f64,
    /// An estimate farther than this on an axis is left to the integer code.
    reach: f64,
    lever: f64,
}

#[derive(Clone, Copy, Debug)]
struct Piece {
    from: u32,
    width: u32,
    frames: [usize; 2],
}

#[derive(Clone, Copy, Debug)]
struct Frame {
    axes: Axes,
    x: f64,
    y: f64,
    facets: [usize; 2],
}

/// A half-plane `x X + y Y <= b`.
#[derive(Clone, Copy, Debug)]
struct Facet {
    x: f64,
    y: f64,
    /// The bound minus the largest effect of the estimate's rounding.
    inner: f64,
}

/// The point of the estimate in a frame.
#[derive(Clone, Copy)]
struct Seen {
    x: f64,
    y: f64,
    /// The effect of the yaw on the point, per radian.
    lever: [f64; 2],
}

/// A set with the terms that all frames of a layout share.
struct Terms {
    /// The largest rounding of the integer code at a facet, micrometres.
    rounded: f64,
    /// Half the square and a sixth of the cube of the turn.
    bent: [f64; 2],
    /// In robot axes, the effect of the turn on the offsets.
    turned: f64,
    /// At least the extent along a normal, without the effect of the yaw.
    broad: f64,
}

impl Layout {
    pub fn new(layout: &Facets<'_>) -> Self {
        let unit = f64::from(1u32 << layout.unit());
        let (mut pieces, mut frames, mut facets) = (Vec::new(), Vec::new(), Vec::new());
        for piece in layout.pieces() {
            let first_frame = frames.len();
            for frame in piece.frames() {
                let first = facets.len();
                let turns = (frame.x, frame.y) != (0, 0);
                for facet in frame.facets() {
                    let clearance = facet_clearance_q14(
                        facet,
                        frame.axes,
                        turns,
                        layout.unit(),
                        layout.lever(),
                    );
                    let b = f64::from(facet.b) * unit;
                    let clearance = clearance as f64 / 16_384.0;
                    facets.push(Facet {
                        x: f64::from(facet.x) / 16_384.0,
                        y: f64::from(facet.y) / 16_384.0,
                        // Twice: the lever of the yaw is rounded as the point is.
                        inner: b - (2.0 * clearance + 1.0) * unit - 2.0,
                    });
                }
                frames.push(Frame {
                    axes: frame.axes,
                    x: f64::from(frame.x) * unit,
                    y: f64::from(frame.y) * unit,
                    facets: [first, facets.len()],
                });
            }
            pieces.push(Piece {
                from: piece.from,
                width: piece.width,
                frames: [first_frame, frames.len()],
            });
        }
        Self {
            pieces,
            frames,
            facets,
            unit,
            reach: (f64::from(layout.reach()) - 1.0) * unit,
            lever: f64::from(layout.lever()) * unit,
        }
    }

    /// Returns `true` only if the integer code accepts the set by one piece.
    #[inline]
    pub fn contains(&self, spread: &Spread) -> bool {
        let Some(terms) = self.terms(spread) else {
            return false;
        };
        // In axes of the robot, where its frames have constant normals.
        let turned = if self.lever > 0.0 {
            spread.above.turned(spread.estimate.facing)
        } else {
            spread.above
        };
        self.pieces.iter().any(|piece| {
            piece.holds_arc(spread)
                && self
                    .frames(piece)
                    .iter()
                    .all(|frame| self.holds(frame, spread, &turned, &terms))
        })
    }

    /// Returns the terms of a set, or `None` if the integer code evaluates the set in another way.
    #[inline(always)]
    fn terms(&self, spread: &Spread) -> Option<Terms> {
        let at = &spread.estimate;
        let limit = self.unit * 8_192.0;
        let weight = spread.turn * (self.lever + 2.0 * self.unit) + 2.0 * self.unit;
        let fits = at.x.abs() <= self.reach
            && at.y.abs() <= self.reach
            && spread.broad <= limit
            && weight <= limit
            && (self.lever == 0.0 || spread.turn <= MOST_TURN);
        if !fits {
            return None;
        }
        let unit = ((spread.broad + weight) / 16_384.0).max(1.0);
        let broad = spread.broad * NORMAL + 5.0 * unit;
        let turn = spread.turn + TURN_ROUNDED;
        let square = turn * turn + TURN_ROUNDED;
        let cube = square * turn + TURN_ROUNDED;
        Some(Terms {
            rounded: ROUNDED * unit,
            bent: [square / 2.0, cube / 6.0],
            // The first column and the two others, each at most as long as the offset.
            turned: broad * (turn * core::f64::consts::SQRT_2 + square / 2.0),
            broad,
        })
    }

    /// Returns `true` if every facet of a frame is certain to hold.
    #[inline(always)]
    fn holds(&self, frame: &Frame, spread: &Spread, turned: &Square, terms: &Terms) -> bool {
        let (above, more, side) = match frame.axes {
            Axes::World => (&spread.above, 0.0, 1.0),
            Axes::Robot => (turned, terms.turned, -1.0),
        };
        let seen = frame.seen(&spread.estimate);
        let [lx, ly] = seen.lever;
        let less = terms.rounded + more;
        let [square, cube] = terms.bent;
        let swing = (lx.abs() + ly.abs()) * NORMAL;
        let enough = less + terms.broad + swing * (spread.turn + square + cube);
        self.facets(frame).iter().all(|facet| {
            let slack = facet.inner - (facet.x * seen.x + facet.y * seen.y);
            slack >= enough || {
                // C and S: the part of the point that turns along the normal, and ahead of it.
                let c = side * (facet.x * ly - facet.y * lx);
                let s = facet.x * lx + facet.y * ly;
                let left = slack - less - (-c).max(0.0) * square - s.abs() * cube;
                left >= 0.0 && left * left >= above.along([facet.x, facet.y, s]) * (1.0 + 1e-9)
            }
        })
    }

    #[inline(always)]
    fn frames(&self, piece: &Piece) -> &[Frame] {
        let [from, to] = piece.frames;
        &self.frames[from..to]
    }

    #[inline(always)]
    fn facets(&self, frame: &Frame) -> &[Facet] {
        let [from, to] = frame.facets;
        &self.facets[from..to]
    }
}

impl Piece {
    const fn is_whole_circle(&self) -> bool {
        self.width == u32::MAX
    }

    /// Returns `true` only if the integer code finds the headings of a set in the arc.
    #[inline(always)]
    fn holds_arc(&self, spread: &Spread) -> bool {
        if self.is_whole_circle() {
            return true;
        }
        let above = spread.estimate.above_goal.wrapping_sub(self.from);
        let turn = spread.largest_turn();
        let room = above.min(self.width.saturating_sub(above));
        above <= self.width && turn + f64::from(ARC_SLACK) + 256.0 <= f64::from(room)
    }
}

impl Frame {
    /// Returns the point of a pose.
    #[inline(always)]
    fn seen(&self, pose: &Point) -> Seen {
        let [c, s] = pose.facing;
        match self.axes {
            Axes::World => {
                let (x, y) = (c * self.x - s * self.y, s * self.x + c * self.y);
                Seen {
                    x: pose.x + x,
                    y: pose.y + y,
                    lever: [-y, x],
                }
            }
            Axes::Robot => {
                let (dx, dy) = (pose.x - self.x, pose.y - self.y);
                let (x, y) = (c * dx + s * dy, c * dy - s * dx);
                Seen {
                    x,
                    y,
                    lever: [y, -x],
                }
            }
        }
    }
}
