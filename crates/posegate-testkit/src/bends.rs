//! Finds the ellipsoids that the third step of the facet test decides. Repeats the steps before it in floating
//! point, from the description of a set in a frame in `src/contain/frame.rs`.

use core::f64::consts::TAU;
use posegate::table::{Axes, Facet, Facets, Frame, NORMAL_BITS, Piece, Table};
use posegate::wire::{Request, Uncertainty};

/// The slack of a facet for an ellipsoid, metres.
struct Left {
    /// Slack along the normal, less the reach to first order.
    slack: f64,
    /// A lower bound of what the second step subtracts for the bend.
    bend: f64,
}

/// An ellipsoid relative to a table's goal.
struct Set<'a> {
    facets: &'a Facets<'a>,
    /// Offset of the estimate from the goal, world axes, metres.
    place: [f64; 2],
    yaw: f64,
    above_goal: f64,
    /// Squared radius times covariance.
    shape: [[f64; 3]; 3],
    /// Largest yaw offset and largest offset in the plane.
    turn: f64,
    broad: f64,
    /// The table's length unit, metres.
    unit: f64,
}

/// Returns `true` if the third step certainly decided the permit or denial of a set.
pub fn decided(table: &Table<'_>, request: &Request, permitted: bool) -> bool {
    let Some(set) = Set::of(table, request) else {
        return false;
    };
    // Bounds on the effect of rounding the estimate and its heading, and of rounding the set as well.
    let (rounding, roundings) = (3.0 * set.unit, 12.0 * set.unit);
    let left = |piece: &Piece<'_>| -> Vec<Left> {
        let frames = piece.frames();
        frames
            .flat_map(|frame| frame.facets().map(move |facet| (frame, facet)))
            .map(|(frame, facet)| set.left(&frame, facet))
            .collect()
    };
    let bent = |left: &Left| left.slack < left.bend - rounding;
    if permitted {
        // No piece contains the set by the first two steps.
        return set
            .facets
            .pieces()
            .all(|piece| left(&piece).iter().any(bent));
    }
    // A piece contains the set except for the bend: the third step must have denied it.
    let enough = roundings + set.rest();
    set.facets.pieces().any(|piece| {
        let left = left(&piece);
        set.is_in_arc(&piece)
            && left.iter().any(bent)
            && left.iter().all(|left| left.slack > enough)
    })
}

impl<'a> Set<'a> {
    fn of(table: &'a Table<'_>, request: &Request) -> Option<Self> {
        let facets = table.facets()?;
        let Uncertainty::Gaussian(covariance) = request.spread else {
            return None;
        };
        let (goal, estimate) = (table.goal().pose, request.estimate);
        let radius_squared = f64::from(request.radius_squared.q16()) / 65_536.0;
        let shape = covariance.map(|row| row.map(|v| v * radius_squared));
        let [[xx, xy, _], [_, yy, _], [.., tt]] = shape;
        let largest = 0.5 * (xx + yy + (xx - yy).hypot(2.0 * xy));
        let goal_yaw = f64::from(goal.yaw.0) / 4_294_967_296.0 * TAU;
        Some(Self {
            facets,
            place: [
                estimate.x_m - f64::from(goal.x_um) * 1e-6,
                estimate.y_m - f64::from(goal.y_um) * 1e-6,
            ],
            yaw: estimate.yaw_rad,
            above_goal: estimate.yaw_rad - goal_yaw,
            shape,
            turn: tt.sqrt(),
            broad: largest.sqrt(),
            unit: f64::from(1u32 << facets.unit()) * 1e-6,
        })
    }

    fn left(&self, frame: &Frame<'_>, facet: Facet) -> Left {
        let one = f64::from(1 << NORMAL_BITS);
        let a = [facet.x, facet.y].map(|v| f64::from(v) / one);
        let point = [frame.x, frame.y].map(|v| f64::from(v) * self.unit);
        // P of the estimate, its change by the yaw, and the normal in world axes.
        let (seen, lever, normal, bend) = match frame.axes {
            Axes::World => {
                let [x, y] = turned(self.yaw, point);
                ([self.place[0] + x, self.place[1] + y], [-y, x], a, 0.0)
            }
            Axes::Robot => {
                let away = [self.place[0] - point[0], self.place[1] - point[1]];
                let [x, y] = turned(-self.yaw, away);
                ([x, y], [y, -x], turned(self.yaw, a), self.turn * self.broad)
            }
        };
        let g = [normal[0], normal[1], dot(a, lever)];
        let square: f64 = (0..3)
            .flat_map(|i| (0..3).map(move |j| (i, j)))
            .map(|(i, j)| g[i] * self.shape[i][j] * g[j])
            .sum();
        Left {
            slack: f64::from(facet.b) * self.unit - dot(a, seen) - square.sqrt(),
            bend,
        }
    }

    /// Returns an upper bound of the terms beyond first order and the bend.
    fn rest(&self) -> f64 {
        let metres = |length: u16| f64::from(length) * self.unit;
        let (arm, farthest) = (metres(self.facets.arm()), metres(self.facets.farthest()));
        let away = metres(self.facets.lever()) + 1.5 * self.broad;
        let square = self.turn * self.turn;
        0.5 * square * arm + 9.0 / 16.0 * square * farthest + 0.375 * square * self.turn * away
    }

    fn is_in_arc(&self, piece: &Piece<'_>) -> bool {
        let radians = |units: u32| f64::from(units) / 4_294_967_296.0 * TAU;
        let above = (self.above_goal - radians(piece.from)).rem_euclid(TAU);
        let slack = above.min(radians(piece.width) - above);
        // The steps apply to at most half a radian.
        self.turn < 0.499 && (piece.is_whole_circle() || self.turn < slack - 1e-4)
    }
}

fn turned(yaw: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = yaw.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
