//! A robot in a hall with straight walls: its table of facets, and a test of pose-sets in plain floats, which shares no code with the
//! core.

use crate::oracle::Rng;
use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec};
use posegate::verify::build;
use posegate_site::Site;
use std::f64::consts::PI;

/// The success set: a robot of 0.8 m by 0.6 m in a hall of 4 m by 4 m.
pub const SUCCESS: &str = r#"{ shape = "footprint", footprint = [[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]], region = [[2, 2], [-2, 2], [-2, -2], [2, -2]] }"#;
/// The corners of the robot in its own frame, metres.
pub const CORNERS: [[f64; 2]; 4] = [[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]];
/// The outward directions of the walls in the goal frame.
pub const WALLS: [[f64; 2]; 4] = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
/// From the middle of the hall to a wall, metres.
pub const TO_WALL_M: f64 = 2.0;

/// Returns the section of a site file with the task `hall` at a goal: x, y in metres, yaw in degrees.
#[must_use]
pub fn task([x, y, yaw_deg]: [f64; 3]) -> String {
    format!(
        "\n[task.hall]\nkind = \"work\"\ngoal = {{ x = {x:?}, y = {y:?}, yaw_deg = {yaw_deg:?} }}\nsuccess = {SUCCESS}\n"
    )
}

/// Returns the site with this hall alone.
///
/// # Panics
/// If the goal is not finite.
#[must_use]
pub fn site(goal: [f64; 3]) -> Site {
    Site::parse(&task(goal), "site.toml").expect("a site")
}

/// Returns the proven table of facets of a task, for every heading and up to `reach` metres from the goal.
///
/// # Panics
/// If the site has no such task, or the table cannot be built.
#[must_use]
pub fn facets(site: &Site, task: &str, reach: f64) -> Vec<u8> {
    let order = BakeInput {
        task,
        success: &site.task(task).expect("a task").success,
        spec: TableSpec {
            extent: Extent {
                x: [-reach, reach],
                y: [-reach, reach],
                yaw_deg: [-180.0, 180.0],
            },
            step: Step {
                xy: 0.05,
                yaw_deg: 5.0,
            },
            layout: Layout::Facets,
        },
        epsilon: site.epsilon,
    };
    build(&order, &|| ()).expect("a table").0
}

/// A reported set: the estimate, and the axes of the ellipsoid `mean + F u`, `|u| <= 1`, in (x, y, yaw); F is lower triangular with the
/// yaw first.
#[derive(Clone, Copy, Debug)]
pub struct Believed {
    pub mean: [f64; 3],
    /// The turn at u = (1, 0, 0).
    pub turn: f64,
    pub x: [f64; 3],
    pub y: [f64; 3],
}

/// Returns how far a drive leads along a direction at most, of those tried, ahead or back along the robot's axis of the moment: from a heading to one that
/// differs by `share` of the swing. `length` is the longest way, metres, `swing` the largest turn, radians, at an even rate or less. Each drive that is tried is
/// possible: the robot turns to a heading, keeps it, and turns to its last heading.
#[must_use]
pub fn farthest([x, y]: [f64; 2], length: f64, swing: f64, [first, share]: [f64; 2]) -> f64 {
    let from = first - y.atan2(x);
    if swing == 0.0 {
        return length * from.cos().abs();
    }
    // The integral of the cosine's magnitude.
    let integral = |angle: f64| {
        let halves = (angle / PI + 0.5).floor();
        2.0 * halves + (angle - PI * halves).sin()
    };
    let last = from + swing * share;
    // The heading that is kept: the nearest to the direction, or the farthest to either side.
    let aligned = (from / PI).round() * PI;
    let spare = 0.5 * (swing - (last - from).abs());
    let headings = [from.min(last) - spare, from.max(last) + spare, from, last];
    let ends = [from, last].map(|end| (end, integral(end)));
    let ways = headings
        .into_iter()
        .chain([aligned])
        .filter_map(|kept: f64| {
            let rest = swing - ends.map(|(end, _)| (kept - end).abs()).iter().sum::<f64>();
            (rest >= -1e-12).then(|| {
                let at = integral(kept);
                let moving = ends.map(|(_, end)| (at - end).abs());
                moving[0] + moving[1] + rest.max(0.0) * kept.cos().abs()
            })
        });
    length / swing * ways.fold(0.0, f64::max)
}

impl Believed {
    /// Returns a set whose axes have up to `most` metres and radians.
    pub fn drawn(rng: &mut Rng, [metres, radians]: [f64; 2]) -> Self {
        let size = rng.log_within(0.003, metres);
        let row = [0; 3].map(|_| rng.within(-1.0, 1.0) * size);
        let other = [0; 3].map(|_| rng.within(-1.0, 1.0) * size);
        Self {
            mean: [0.0, 0.0, rng.within(-3.1, 3.1)],
            turn: rng.log_within(0.003, radians),
            x: row,
            y: other,
        }
    }

    /// Returns the covariance whose set at the squared radius is this.
    #[must_use]
    pub fn covariance(&self, radius_squared: f64) -> [[f64; 3]; 3] {
        let rows = [self.x, self.y, [self.turn, 0.0, 0.0]];
        rows.map(|a| {
            rows.map(|b| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / radius_squared)
        })
    }

    /// Returns the least distance of the robot's corners from any wall over the set after a drive, metres; negative beyond a wall.
    /// The robot drives as in [`farthest`].
    #[must_use]
    pub fn room(&self, length: f64, swing: f64) -> f64 {
        self.rooms(length, swing)
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the room before each wall.
    fn rooms(&self, length: f64, swing: f64) -> [f64; 4] {
        let along = WALLS.map(|[x, y]| [0, 1, 2].map(|k| x * self.x[k] + y * self.y[k]));
        let middle = WALLS.map(|[x, y]| x * self.mean[0] + y * self.mean[1]);
        let mut least = [f64::INFINITY; 4];
        for k in -20..=20 {
            let u = (f64::from(k) / 20.0 * std::f64::consts::FRAC_PI_2).sin();
            let r = (1.0 - u * u).max(0.0).sqrt();
            let reach = along.map(|[first, a, b]| first * u + r * a.hypot(b));
            let first = self.mean[2] + self.turn * u;
            for share in [-1.0, -0.5, 0.0, 0.5, 1.0] {
                let (s, c) = (first + swing * share).sin_cos();
                let corners = CORNERS.map(|[vx, vy]| [c * vx - s * vy, s * vx + c * vy]);
                for (number, wall) in WALLS.into_iter().enumerate() {
                    let tips = corners.map(|[x, y]| wall[0] * x + wall[1] * y);
                    let corner = tips.into_iter().fold(f64::NEG_INFINITY, f64::max);
                    let at_rest = TO_WALL_M - middle[number] - corner - reach[number];
                    // No drive leads farther than its length.
                    if at_rest - length < least[number] {
                        let left = at_rest - farthest(wall, length, swing, [first, share]);
                        least[number] = least[number].min(left);
                    }
                }
            }
        }
        least
    }

    /// Moves the estimate along a direction until the distance is `room`, by 3 m at most. `None` if there is no such place.
    #[must_use]
    pub fn placed(mut self, direction: f64, room: f64, length: f64, swing: f64) -> Option<Self> {
        let (s, c) = direction.sin_cos();
        (self.mean[0], self.mean[1]) = (0.0, 0.0);
        let mut way = 3.0_f64;
        for (wall, before) in WALLS.into_iter().zip(self.rooms(length, swing)) {
            let left = before - room;
            if left < 0.0 {
                return None;
            }
            let towards = wall[0] * c + wall[1] * s;
            if towards > 0.0 {
                way = way.min(left / towards);
            }
        }
        (self.mean[0], self.mean[1]) = (c * way, s * way);
        Some(self)
    }
}
