//! The subject of a picture: a task's set, its table, and pose-sets.

use super::belief::PoseSetF64;
use super::panel::Window;
use super::section::border;
use posegate::bake::extent;
use posegate::confidence::core_radius;
use posegate::gate::{Verdict, judge};
use posegate::set::{RadiusSquared, Uncertainty};
use posegate::shape::SetEvaluator;
use posegate::shape::{Planar, PoseDeg, Scalar};
use posegate::table::{Table, TableError};
use posegate_replay::{Row, factor_text};
use posegate_site::{Site, Task, UnknownTask};

/// A task with the data to draw.
#[derive(Debug)]
pub struct Subject<'a> {
    /// The site.
    pub site: &'a Site,
    /// The task's name.
    pub name: &'a str,
    /// The task.
    pub task: &'a Task,
    /// The task's set, prepared for evaluation.
    pub depth: SetEvaluator,
    /// The task's table; `None` if none was added.
    pub table: Option<Table<'a>>,
    /// Pose-sets to draw.
    pub beliefs: Vec<PoseSetF64>,
    /// The number of estimates that are not drawn: invalid pose-sets, and those beyond `MOST_ESTIMATES`.
    pub left_out: usize,
}

/// The reason why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// The site has no such task.
    #[error(transparent)]
    Task(#[from] UnknownTask),
    /// The success set is unbounded and has no expected pose-set, or it is empty.
    #[error("no extent can be chosen for the task `{0}`: its success set has no bound, or no pose")]
    NoExtent(String),
    /// The task has no expected pose-set.
    #[error("the task `{0}` has no `expected` pose-set")]
    NothingExpected(String),
    /// No estimate is a valid pose-set.
    #[error("none of the {0} estimates is a pose-set: see `posegate gate` for their reasons")]
    NoPoseSet(usize),
    /// The set has no camera.
    #[error("the success set of the task `{0}` has no camera: there is no image to draw")]
    NoCamera(String),
    /// The bytes are not a table of this version.
    #[error("this version cannot read the table: {0}")]
    Table(TableError),
    /// The table belongs to another task or site.
    #[error("it is a table of {0}")]
    OtherTable(String),
}

/// Largest number of estimates drawn: more cannot be distinguished.
pub const MOST_ESTIMATES: usize = 24;

/// The result of a containment test, with its text.
#[derive(Clone, Debug, PartialEq)]
pub struct ContainmentResult {
    /// With a table: proven inside. Without: inside at every sampled pose.
    pub inside: bool,
    /// `inside, margin 1.366`.
    pub words: String,
}

impl<'a> Subject<'a> {
    /// Creates the subject of a task of a site.
    ///
    /// # Errors
    /// [`DrawError::Task`] if the site has no such task.
    pub fn new(site: &'a Site, name: &'a str) -> Result<Self, DrawError> {
        let task = site.task(name)?;
        Ok(Self {
            site,
            name,
            task,
            depth: task.success.evaluator(),
            table: None,
            beliefs: Vec::new(),
            left_out: 0,
        })
    }

    /// Adds a table of the task.
    ///
    /// # Errors
    /// [`DrawError::Table`] if the bytes are not a table, [`DrawError::OtherTable`] if the table belongs
    /// to another task, or to another set, goal or confidence of it.
    pub fn with_table(mut self, bytes: &'a [u8]) -> Result<Self, DrawError> {
        let table = Table::parse(bytes).map_err(DrawError::Table)?;
        if table.task() != self.name {
            return Err(DrawError::OtherTable(format!(
                "the task `{}`",
                table.task()
            )));
        }
        if table.task_digest() != self.site.task_digest(self.task) {
            return Err(DrawError::OtherTable(
                "another set, goal or confidence of this task: the site file has changed since"
                    .into(),
            ));
        }
        self.table = Some(table);
        Ok(self)
    }

    fn radius(&self) -> RadiusSquared {
        let table = self.table.as_ref().map(Table::radius_squared);
        table
            .or_else(|| core_radius(self.site.epsilon))
            .unwrap_or(RadiusSquared::LARGEST)
    }

    /// Adds the task's expected pose-set, about the goal.
    ///
    /// # Errors
    /// [`DrawError::NothingExpected`] if the task has none.
    pub fn expected(mut self) -> Result<Self, DrawError> {
        let nothing = || DrawError::NothingExpected(self.name.into());
        let expected = self.task.wish.expected.ok_or_else(nothing)?;
        let goal = self.task.success.goal;
        self.beliefs.push(PoseSetF64 {
            estimate: [goal.x, goal.y, goal.yaw_deg.to_radians()],
            spread: Uncertainty::Bounded {
                translation_m: expected.translation,
                yaw_rad: expected.turn_deg.to_radians(),
            },
            radius_squared: self.radius(),
        });
        Ok(self)
    }

    /// Adds the Gaussian pose-sets of estimates: at most `MOST_ESTIMATES`, evenly selected.
    ///
    /// # Errors
    /// [`DrawError::NoPoseSet`] if no estimate is a pose-set.
    pub fn estimates(mut self, rows: &[Row]) -> Result<Self, DrawError> {
        let radius_squared = self.radius();
        let all = rows.iter().map(|row| PoseSetF64 {
            estimate: [row.estimate.x_m, row.estimate.y_m, row.estimate.yaw_rad],
            spread: Uncertainty::Gaussian(row.covariance),
            radius_squared,
        });
        let sets: Vec<PoseSetF64> = all.filter(|belief| belief.pose_set().is_ok()).collect();
        if sets.is_empty() {
            return Err(DrawError::NoPoseSet(rows.len()));
        }
        let every = sets.len().div_ceil(MOST_ESTIMATES);
        self.beliefs.extend(sets.iter().step_by(every));
        self.left_out = rows.len() - self.beliefs.len();
        Ok(self)
    }

    /// Tests if a pose-set is inside: by the gate if there is a table, else at sampled poses.
    #[must_use]
    pub fn held(&self, belief: &PoseSetF64) -> ContainmentResult {
        if let (Some(table), Ok(set)) = (&self.table, belief.pose_set()) {
            let verdict = judge(table, &set);
            let margin = match verdict {
                Verdict::Permit { margin } => Some(margin),
                Verdict::Deny { margin, .. } => margin,
            };
            let inside = verdict.is_permit();
            let words = match margin {
                Some(margin) if inside => format!("proven inside, margin {}", factor_text(margin)),
                Some(margin) => format!("NOT proven inside, margin {}", factor_text(margin)),
                None => "NOT proven inside".into(),
            };
            return ContainmentResult { inside, words };
        }
        let poses = belief.poses();
        let outside = poses
            .iter()
            .filter(|pose| !self.depth.holds(**pose))
            .count();
        let all = poses.len();
        ContainmentResult {
            inside: outside == 0,
            words: if outside == 0 {
                format!("inside at all of {all} poses looked at")
            } else {
                format!("NOT inside: {outside} of {all} poses looked at are outside")
            },
        }
    }

    /// Returns the border of the set at a heading of the goal frame (degrees): polygons in that frame, metres, found on
    /// a lattice of `spacing` metres.
    #[must_use]
    pub fn section(&self, yaw_deg: f64, window: &Window, spacing: f64) -> Vec<Vec<[f64; 2]>> {
        let yaw = (self.goal().yaw_deg + yaw_deg).to_radians();
        let inside = |point: [f64; 2]| {
            let [x, y] = self.in_world(point);
            self.depth.holds([x, y, yaw])
        };
        border(&inside, window, spacing)
    }

    /// Returns the goal.
    #[must_use]
    pub fn goal(&self) -> PoseDeg {
        self.task.success.goal
    }

    /// Converts a point of the goal frame to the world, metres.
    #[must_use]
    pub fn in_world(&self, point: [f64; 2]) -> [f64; 2] {
        let PoseDeg { x, y, yaw_deg } = self.goal();
        let [cos, sin] = f64::cos_sin_deg(yaw_deg);
        Planar { x, y, cos, sin }.to_goal(point)
    }

    /// Converts a point of the world to the goal frame, metres.
    #[must_use]
    pub fn in_goal(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [x, y, _] = self.task.success.to_goal([x, y, 0.0]);
        [x, y]
    }

    /// Returns the window of the goal frame to draw (metres), and the range of headings in degrees: the extent of
    /// the task's table, limited to the set, and widened for the pose-sets.
    ///
    /// # Errors
    /// [`DrawError::NoExtent`] if no extent can be chosen.
    pub fn extent(&self) -> Result<(Window, [f64; 2]), DrawError> {
        let wish = self.task.wish;
        let chosen = wish
            .extent
            .or_else(|| extent(&self.task.success, wish.expected));
        let chosen = chosen.ok_or_else(|| DrawError::NoExtent(self.name.into()))?;
        let own = extent(&self.task.success, None).unwrap_or(chosen);
        let both = |a: [f64; 2], b: [f64; 2]| {
            let both = [a[0].max(b[0]), a[1].min(b[1])];
            if both[0] < both[1] { both } else { a }
        };
        let mut ends = [both(chosen.x, own.x), both(chosen.y, own.y)];
        // A pose-set may stick out: show it, by at most half of the extent on each side.
        let widths = ends.map(|[lo, hi]| hi - lo);
        for belief in &self.beliefs {
            let centre = self.in_goal([belief.estimate[0], belief.estimate[1]]);
            let [rx, ry, _] = belief.extents();
            let reach = rx.max(ry);
            for axis in [0, 1] {
                let [lo, hi] = ends[axis];
                let most = [lo - 0.5 * widths[axis], hi + 0.5 * widths[axis]];
                ends[axis] = [
                    lo.min((centre[axis] - reach).max(most[0])),
                    hi.max((centre[axis] + reach).min(most[1])),
                ];
            }
        }
        let [x, y] = ends.map(|[lo, hi]| {
            let margin = 0.04 * (hi - lo);
            [lo - margin, hi + margin]
        });
        Ok((Window { x, y }, both(chosen.yaw_deg, own.yaw_deg)))
    }
}
