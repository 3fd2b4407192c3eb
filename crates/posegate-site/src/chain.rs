//! Chains of tasks, and how the robot drives, from TOML.

use std::collections::BTreeMap;

use super::error::SiteError;
use super::names::named;
use super::reader::{Node, Table};
use super::{Site, Task, keys, places, poses};
use posegate::set::Estimate;
use posegate::shape::{PoseDeg, Tolerance};
use posegate::task::{BoundedDriveModel, Leg, Odometry};

/// A chain of tasks: the robot's knowledge of its pose at the start, and the steps.
#[derive(Clone, Debug, PartialEq)]
pub struct SiteChain {
    /// The knowledge of the pose at the start.
    pub start: ChainStart,
    /// The steps. Empty if the chain is only a start for the planner.
    pub steps: Vec<ChainStep>,
}

/// The frame of a start's pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartFrame {
    /// The world.
    #[default]
    World,
    /// The goal frame of the task to plan for: one start serves all docks with equal approaches.
    Goal,
}

/// The robot's knowledge of its pose at the start of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainStart {
    /// The frame of `pose` and of a covariance.
    pub frame: StartFrame,
    /// The estimated pose.
    pub pose: PoseDeg,
    /// The largest distance of the estimate from `pose` when the chain begins.
    pub spread: Tolerance,
    /// The largest distance of the true pose from the estimate.
    pub known: StartUncertainty,
}

impl ChainStart {
    /// Returns the start in the world frame, for a task with this goal.
    #[must_use]
    pub fn toward(&self, goal: PoseDeg) -> Self {
        if self.frame == StartFrame::World {
            return self.clone();
        }
        let turn = goal.yaw_deg.to_radians();
        let (s, c) = (libm::sin(turn), libm::cos(turn));
        let known = match self.known {
            StartUncertainty::Gaussian {
                covariance,
                epsilon,
            } => {
                let own = nalgebra::Matrix3::from_fn(|row, column| covariance[row][column]);
                let turned = nalgebra::Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
                let world = turned * own * turned.transpose();
                let half = |row, column| 0.5 * (world[(row, column)] + world[(column, row)]);
                StartUncertainty::Gaussian {
                    covariance: core::array::from_fn(|row| {
                        core::array::from_fn(|column| half(row, column))
                    }),
                    epsilon,
                }
            }
            bounded => bounded,
        };
        Self {
            frame: StartFrame::World,
            pose: PoseDeg {
                x: goal.x + c * self.pose.x - s * self.pose.y,
                y: goal.y + s * self.pose.x + c * self.pose.y,
                yaw_deg: goal.yaw_deg + self.pose.yaw_deg,
            },
            spread: self.spread,
            known,
        }
    }

    /// Returns the confidence of every Gaussian set of a chain with this start: the start's own, or the
    /// site's.
    #[must_use]
    pub const fn epsilon(&self, site: &Site) -> f64 {
        match self.known {
            StartUncertainty::Gaussian { epsilon, .. } => epsilon,
            StartUncertainty::Bounded { .. } => site.epsilon,
        }
    }
}

/// The uncertainty of an estimate: bounds or a covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartUncertainty {
    /// The true pose is within a cylinder around the estimate.
    Bounded {
        /// Metres, at least 0.
        translation: f64,
        /// Degrees, from 0 to 180.
        yaw_deg: f64,
    },
    /// The error is Gaussian with this covariance.
    Gaussian {
        /// Symmetric, no eigenvalue below 0, in m^2, m rad and rad^2, world axes.
        covariance: [[f64; 3]; 3],
        /// The confidence of the set. The site's value if the file gives none.
        epsilon: f64,
    },
}

impl SiteChain {
    /// Returns a chain in the map relative to the site's origin.
    pub(super) fn less(mut self, [x, y]: [f64; 2]) -> Self {
        if self.start.frame == StartFrame::World {
            self.start.pose = poses::less(self.start.pose, [x, y]);
        }
        for step in &mut self.steps {
            if let ChainStep::Navigate { from, .. } = step {
                (from.x_m, from.y_m) = (from.x_m - x, from.y_m - y);
            }
        }
        self
    }
}

/// A step of a chain.
#[derive(Clone, Debug, PartialEq)]
pub enum ChainStep {
    /// A task of the site, by name.
    Task(String),
    /// A drive.
    Navigate {
        /// The start of the path.
        from: Estimate,
        /// The legs of the path, radians.
        legs: Vec<Leg>,
        /// The error growth of the drive.
        model: DriveModel,
    },
}

/// The growth of the pose error while driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DriveModel {
    /// Bounds on the drift.
    Bounded(BoundedDriveModel),
    /// Gaussian noise of the odometry.
    Gaussian(Odometry),
}

/// The driving of the site's robots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Navigation {
    /// The model of drives without a model of their own; `None` if the file has none.
    pub model: Option<DriveModel>,
    /// The largest distance of the estimate from a drive's end when the controller stops.
    pub controller: Tolerance,
}

impl Default for Navigation {
    fn default() -> Self {
        Self {
            model: None,
            controller: Tolerance::NONE,
        }
    }
}

pub(super) fn navigation(node: &Node<'_>) -> Result<Navigation, SiteError> {
    let table = node.table(&[&keys::DRIVE_MODEL, &keys::CONTROLLER])?;
    Ok(Navigation {
        model: match table.optional(&keys::DRIVE_MODEL) {
            Some(node) => Some(model(&node)?),
            None => None,
        },
        controller: match table.optional(&keys::CONTROLLER) {
            Some(node) => places::expected(&node)?,
            None => Tolerance::NONE,
        },
    })
}

pub(super) fn chain(
    node: &Node<'_>,
    tasks: &BTreeMap<String, Task>,
    navigation: &Navigation,
    epsilon: f64,
) -> Result<SiteChain, SiteError> {
    let table = node.table(&[&keys::CHAIN_START, &keys::CHAIN_STEPS])?;
    let start = start(&table.required(&keys::CHAIN_START)?, epsilon)?;
    let steps = match table.optional(&keys::CHAIN_STEPS) {
        None => vec![],
        Some(node) => node
            .array()?
            .iter()
            .map(|node| step(node, tasks, navigation))
            .collect::<Result<_, _>>()?,
    };
    if start.frame == StartFrame::Goal && !steps.is_empty() {
        return Err(table
            .error_at_key(
                keys::CHAIN_STEPS.name,
                format!("{} starts in a goal frame and has steps", table.title()),
            )
            .expected("a start in the world, or no steps")
            .help("remove `steps`, or `frame` from the start"));
    }
    Ok(SiteChain { start, steps })
}

fn start(node: &Node<'_>, site_epsilon: f64) -> Result<ChainStart, SiteError> {
    let table = node.table(&[
        &keys::X,
        &keys::Y,
        &keys::YAW,
        &keys::CHAIN_BOUNDED,
        &keys::CHAIN_COVARIANCE,
        &keys::CHAIN_SPREAD,
        &keys::CHAIN_FRAME,
        &keys::EPSILON,
    ])?;
    let pose = PoseDeg {
        x: table.number(&keys::X)?,
        y: table.number(&keys::Y)?,
        yaw_deg: table.number(&keys::YAW)?,
    };
    let epsilon = table.optional(&keys::EPSILON);
    let known = match (
        table.optional(&keys::CHAIN_BOUNDED),
        table.optional(&keys::CHAIN_COVARIANCE),
    ) {
        (Some(bounded), None) => {
            if let Some(epsilon) = epsilon {
                return Err(epsilon
                    .error("a bounded start has no `epsilon`: it holds for certain")
                    .help("remove `epsilon`, or give a `covariance`"));
            }
            let bounded = bounded.table(&[&keys::TOLERANCE_TRANSLATION, &keys::KNOWN_YAW])?;
            StartUncertainty::Bounded {
                translation: bounded.number(&keys::TOLERANCE_TRANSLATION)?,
                yaw_deg: bounded.number(&keys::KNOWN_YAW)?,
            }
        }
        (None, Some(node)) => StartUncertainty::Gaussian {
            covariance: covariance(&node)?,
            epsilon: epsilon.map_or(Ok(site_epsilon), |node| node.number())?,
        },
        (Some(_), Some(node)) => {
            return Err(node
                .error("a start is `bounded`, or has a `covariance`")
                .help("remove one or the other"));
        }
        (None, None) => {
            table
                .required(&keys::CHAIN_BOUNDED)
                .map(|_| StartUncertainty::Bounded {
                    translation: 0.0,
                    yaw_deg: 0.0,
                })?
        }
    };
    let spread = match table.optional(&keys::CHAIN_SPREAD) {
        Some(node) => places::expected(&node)?,
        None => Tolerance::NONE,
    };
    let frame = match table.optional(&keys::CHAIN_FRAME) {
        Some(node) => node.among([("world", StartFrame::World), ("goal", StartFrame::Goal)])?,
        None => StartFrame::World,
    };
    Ok(ChainStart {
        frame,
        pose,
        spread,
        known,
    })
}

fn covariance(node: &Node<'_>) -> Result<[[f64; 3]; 3], SiteError> {
    let rows: Vec<Vec<f64>> = node
        .array()?
        .iter()
        .map(|row| row.array()?.iter().map(Node::number).collect())
        .collect::<Result<_, _>>()?;
    let rows: Vec<[f64; 3]> = rows
        .into_iter()
        .filter_map(|row| row.try_into().ok())
        .collect();
    let rows: [[f64; 3]; 3] = rows
        .try_into()
        .map_err(|_| node.error(format!("`{}` is not three rows of three", node.path())))?;
    let matrix = nalgebra::Matrix3::from_fn(|row, column| rows[row][column]);
    let largest = matrix.amax();
    if (matrix - matrix.transpose()).amax() > 1e-9 * largest {
        return Err(node
            .error(format!("`{}` is not symmetric", node.path()))
            .help("the entry in row i and column k is that in row k and column i"));
    }
    if matrix.symmetric_eigen().eigenvalues.min() < -1e-12 * largest {
        return Err(node
            .error(format!(
                "`{}` has an eigenvalue below 0: it is not a covariance",
                node.path()
            ))
            .help("write variances on the diagonal; no correlation may exceed 1"));
    }
    Ok(rows)
}

fn step(
    node: &Node<'_>,
    tasks: &BTreeMap<String, Task>,
    navigation: &Navigation,
) -> Result<ChainStep, SiteError> {
    let table = node.any_table()?;
    if table.has(keys::STEP_TASK.name) {
        let table = node.table(&[&keys::STEP_TASK])?;
        let name = table.required(&keys::STEP_TASK)?;
        named(&name, "task", tasks)?;
        return Ok(ChainStep::Task(name.text()?.to_owned()));
    }
    let table = node.table(&[&keys::NAVIGATE, &keys::DRIVE_MODEL])?;
    let (from, legs) = path(&table.required(&keys::NAVIGATE)?)?;
    Ok(ChainStep::Navigate {
        from,
        legs,
        model: own_model(&table, navigation)?,
    })
}

fn own_model(table: &Table<'_>, navigation: &Navigation) -> Result<DriveModel, SiteError> {
    match (table.optional(&keys::DRIVE_MODEL), navigation.model) {
        (Some(node), _) => model(&node),
        (None, Some(model)) => Ok(model),
        (None, None) => model(&table.required(&keys::DRIVE_MODEL)?),
    }
}

fn path(node: &Node<'_>) -> Result<(Estimate, Vec<Leg>), SiteError> {
    let nodes = node.array()?;
    let Some((first, rest)) = nodes.split_first() else {
        return Err(node.error(format!("`{}` has no place", node.path())));
    };
    if rest.is_empty() {
        return Err(node
            .error(format!(
                "`{}` has only one place: nothing is driven",
                node.path()
            ))
            .help("write where the path begins and where it leads; both may be the same place"));
    }
    let from = place(first)?;
    let mut legs = vec![];
    let mut at = from;
    for node in rest {
        let leg = if node.is_table() {
            let table = node.table(&[&keys::ARC])?;
            let [x_m, y_m] = table.required(&keys::ARC)?.pair()?;
            Leg::Arc { x_m, y_m }
        } else {
            Leg::Straight(place(node)?)
        };
        let (motion, end) = leg.motion(&at);
        if matches!(leg, Leg::Arc { .. }) && motion.rot1.abs() > 2.8 {
            return Err(node
                .error(format!(
                    "`{}` lies behind the robot: the arc is nearly a whole circle",
                    node.path()
                ))
                .help("drive it in two arcs, or straight"));
        }
        at = end;
        legs.push(leg);
    }
    Ok((from, legs))
}

fn place(node: &Node<'_>) -> Result<Estimate, SiteError> {
    let numbers: Vec<f64> = node
        .array()?
        .iter()
        .map(Node::number)
        .collect::<Result<_, _>>()?;
    let [x_m, y_m, yaw_deg] = numbers[..] else {
        return Err(node.error(format!("`{}` is not x, y, yaw_deg", node.path())));
    };
    Ok(Estimate {
        x_m,
        y_m,
        yaw_rad: yaw_deg.to_radians(),
    })
}

fn model(node: &Node<'_>) -> Result<DriveModel, SiteError> {
    let kind = node.any_table()?.required(&keys::DRIVE_KIND)?;
    match kind.text()? {
        "bounded" => {
            let table = node.table(&[
                &keys::DRIVE_KIND,
                &keys::K_TURN,
                &keys::K_DRIFT,
                &keys::K_SLIP,
            ])?;
            Ok(DriveModel::Bounded(BoundedDriveModel {
                k_turn: table.number(&keys::K_TURN)?,
                k_drift: table.number(&keys::K_DRIFT)?,
                k_slip: table.number(&keys::K_SLIP)?,
            }))
        }
        "gaussian" => {
            let table = node.table(&[
                &keys::DRIVE_KIND,
                &keys::A1,
                &keys::A2,
                &keys::A3,
                &keys::A4,
            ])?;
            Ok(DriveModel::Gaussian(Odometry {
                a1: table.number(&keys::A1)?,
                a2: table.number(&keys::A2)?,
                a3: table.number(&keys::A3)?,
                a4: table.number(&keys::A4)?,
            }))
        }
        _ => Err(kind.unknown_word(["bounded", "gaussian"])),
    }
}
