//! The gate of a controller, and the tracker that carries fixes along odometry.

use crate::error::refused_argument;
use crate::table::PyTable;
use crate::trust::trust;
use crate::uncertainty::belief;
use posegate::gate::{Evidence, Gate, Reason, Settings, Source, State, Step};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::Aging;
use posegate::table::Table;
use posegate::task::Risk;
use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use self_cell::self_cell;

/// The number of increments that a tracker keeps for late fixes.
const INCREMENTS: usize = 128;

/// What a gate borrows: its table's bytes, its task and its source.
struct Owned {
    bytes: Vec<u8>,
    task: String,
    digest: [u8; 32],
    sources: [Source; 1],
    times: Settings<'static>,
}

self_cell! {
    struct Configured {
        owner: Owned,

        #[covariant]
        dependent: Settings,
    }
}

self_cell! {
    struct Running {
        owner: Configured,

        #[not_covariant]
        dependent: Gate,
    }
}

/// The state machine of the motion controller: it opens after consecutive permits, and closes at once on a denial.
///
/// Call `step` for each report, and `tick` in every other control cycle: at most 20 ms apart, or an open gate closes.
/// Times are in milliseconds, of one clock that never stops. A report comes every `period_ms`, up to `jitter_ms` after its stamp.
/// `max_speed` (m/s) and `max_yaw_rate` (rad/s) bound the robot's movement: each pose-set grows by it until the permission ends.
///
/// >>> import posegate
/// >>> table = posegate.Table.open("demo-out/dock.posegate")
/// >>> gate = posegate.Gate(table, period_ms=50, jitter_ms=50)
/// >>> cov = [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]
/// >>> for t in range(0, 200, 10):
/// ...     step = gate.step(t, t, 0.01, 0.0, 0.0, cov) if t % 50 == 0 else gate.tick(t)
/// >>> step.is_open
/// True
/// >>> gate.step(200, 200, 0.07, 0.0, 0.0, cov)
/// GateStep(is_open=False, state='inhibited', reason='not_contained')
#[pyclass(name = "Gate", module = "posegate")]
pub struct PyGate {
    running: Running,
    sequence: u32,
    frame: FrameId,
}

/// The state of a gate after a step: whether the interlock may be open, and the reason if the report does not permit.
///
/// >>> import posegate
/// >>> gate = posegate.Gate(posegate.Table.open("demo-out/dock.posegate"))
/// >>> step = gate.tick(0)
/// >>> step.is_open, step.state, step.reason
/// (False, 'inhibited', 'silent')
#[pyclass(frozen, eq, name = "GateStep", module = "posegate")]
#[derive(PartialEq)]
pub struct PyGateStep {
    /// True if the interlock may be open.
    #[pyo3(get)]
    is_open: bool,
    /// The name of the gate's state: inhibited, qualifying, permitted or latched.
    #[pyo3(get)]
    state: &'static str,
    /// The name of the reason why the report does not permit, or without a report why the gate is closed.
    #[pyo3(get)]
    reason: Option<&'static str>,
}

impl From<Step> for PyGateStep {
    fn from(step: Step) -> Self {
        Self {
            is_open: step.permission.is_permit() && step.state == State::Permitted,
            state: step.state.name(),
            reason: step.verdict.err().map(Reason::name),
        }
    }
}

#[pymethods]
impl PyGateStep {
    fn __bool__(&self) -> bool {
        self.is_open
    }

    fn __repr__(&self) -> String {
        let reason = self
            .reason
            .map_or_else(|| "None".into(), |reason| format!("'{reason}'"));
        format!(
            "GateStep(is_open={}, state='{}', reason={reason})",
            if self.is_open { "True" } else { "False" },
            self.state
        )
    }
}

/// An estimate with its stamp, and other hypotheses about the robot's pose: the gate permits only if the pose-set of every one is inside.
///
/// `others` are estimates (x, y, yaw, cov) of the same moment; `elsewhere` is the probability that the robot is at none of them.
///
/// >>> import posegate
/// >>> gate = posegate.Gate(posegate.Table.open("demo-out/dock.posegate"), permits_in_a_row=1)
/// >>> cov = [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]
/// >>> gate.step_on(100, posegate.Evidence(100, 0.0, 0.0, 0.0, cov, others=[(0.01, 0.0, 0.0, cov)])).reason is None
/// True
/// >>> gate.step_on(150, posegate.Evidence(150, 0.0, 0.0, 0.0, cov, others=[(0.07, 0.0, 0.0, cov)])).reason
/// 'not_contained'
#[pyclass(frozen, name = "Evidence", module = "posegate")]
pub struct PyEvidence {
    stamp_ms: u32,
    belief: PoseEstimate,
    others: Vec<PoseEstimate>,
    elsewhere: Risk,
    sequence: Option<u32>,
}

#[pymethods]
impl PyEvidence {
    #[new]
    #[pyo3(signature = (stamp_ms, x, y, yaw, cov, *, others=vec![], elsewhere=0.0, sequence=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        stamp_ms: u32,
        x: f64,
        y: f64,
        yaw: f64,
        cov: &Bound<'_, PyAny>,
        others: Vec<(f64, f64, f64, Bound<'_, PyAny>)>,
        elsewhere: f64,
        sequence: Option<u32>,
    ) -> PyResult<Self> {
        if !(0.0..1.0).contains(&elsewhere) {
            return Err(refused_argument(
                py,
                format!("elsewhere is {elsewhere}"),
                "give a probability, a number from 0 to below 1",
            ));
        }
        // The product is exact; rounded up, so that no probability above 0 counts as none.
        let elsewhere = Risk::from_q32((elsewhere * 2.0_f64.powi(32)).ceil() as u32);
        let others = others
            .iter()
            .map(|(x, y, yaw, cov)| belief([*x, *y, *yaw], cov));
        Ok(Self {
            stamp_ms,
            belief: belief([x, y, yaw], cov)?,
            others: others.collect::<PyResult<_>>()?,
            elsewhere,
            sequence,
        })
    }
}

#[pymethods]
impl PyGate {
    #[new]
    #[pyo3(signature = (table, *, frame="map", period_ms=50, jitter_ms=50, max_speed=0.0, max_yaw_rate=0.0, cross_terms="filled", inflation=1.0, permits_in_a_row=3, now_ms=0))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        table: &PyTable,
        frame: &str,
        period_ms: u32,
        jitter_ms: u32,
        max_speed: f64,
        max_yaw_rate: f64,
        cross_terms: &str,
        inflation: f64,
        permits_in_a_row: u16,
        now_ms: u32,
    ) -> PyResult<Self> {
        let bytes = table.bytes().to_vec();
        let (task, digest) = {
            let table =
                Table::parse(&bytes).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
            (table.task().to_owned(), table.task_digest())
        };
        let frame = FrameId::of(frame);
        let source = Source {
            frame,
            trust: trust(py, cross_terms, inflation)?,
            aging: Aging::NONE,
            motion: motion(py, max_speed, max_yaw_rate)?,
        };
        let owned = Owned {
            bytes,
            task,
            digest,
            sources: [source],
            times: Settings {
                permits_in_a_row,
                // No memory of a controller limits the work of a decision here.
                most_runs: u32::MAX,
                ..Settings::for_source(period_ms, jitter_ms)
            },
        };
        let configured = Configured::new(owned, |owned| Settings {
            task: &owned.task,
            task_digest: owned.digest,
            sources: &owned.sources,
            ..owned.times
        });
        let running = Running::try_new(configured, |configured| {
            let bytes = &configured.borrow_owner().bytes;
            Gate::new(bytes, configured.borrow_dependent(), now_ms)
        });
        let running = running.map_err(|error| {
            refused_argument(
                py,
                format!("an argument of Gate is not valid: {error}"),
                "no check can be switched off: give a frame, and times and counts above 0",
            )
        })?;
        Ok(Self {
            running,
            sequence: 0,
            frame,
        })
    }

    /// Evaluates an estimate at the time `now_ms`: its stamp, m, m, rad, and its covariance by rows or a `Bounded`. `sequence` is the source's number of the
    /// report; without it, no report counts as lost.
    #[pyo3(signature = (now_ms, stamp_ms, x, y, yaw, cov, sequence=None))]
    #[allow(clippy::too_many_arguments)]
    fn step(
        &mut self,
        now_ms: u32,
        stamp_ms: u32,
        x: f64,
        y: f64,
        yaw: f64,
        cov: &Bound<'_, PyAny>,
        sequence: Option<u32>,
    ) -> PyResult<PyGateStep> {
        self.sequence = sequence.unwrap_or(self.sequence.wrapping_add(1));
        let report = report(self.frame, self.sequence, stamp_ms, [x, y, yaw], cov)?;
        Ok(self.with(|gate| gate.step(now_ms, &report)).into())
    }

    /// Evaluates, at the time `now_ms`, what a tracker carries to it, or an `Evidence`. Without a usable fix of a tracker the gate closes, with the
    /// reason.
    fn step_on(&mut self, now_ms: u32, evidence: &Bound<'_, PyAny>) -> PyResult<PyGateStep> {
        if let Ok(evidence) = evidence.cast::<PyEvidence>() {
            let evidence = evidence.get();
            self.sequence = evidence.sequence.unwrap_or(self.sequence.wrapping_add(1));
            let report = Report {
                source: 0,
                frame: self.frame,
                sequence: self.sequence,
                stamp_ms: evidence.stamp_ms,
                belief: evidence.belief,
            };
            let evidence = Evidence {
                others: &evidence.others,
                elsewhere: evidence.elsewhere,
                ..Evidence::of(&report)
            };
            return Ok(self.with(|gate| gate.step_on(now_ms, &evidence)).into());
        }
        let tracker: &Bound<'_, PyTracker> = evidence.cast()?;
        let tracker = &mut tracker.try_borrow_mut()?.tracker;
        let step = self.with(|gate| {
            // The tracker may have been made for another table.
            if let Ok(table) = gate.table() {
                tracker.cover(table.radius_squared());
            }
            match tracker.tracked(now_ms) {
                Ok(tracked) => gate.step_on(now_ms, &tracked.evidence()),
                Err(reason) => gate.inhibit(now_ms, reason),
            }
        });
        Ok(step.into())
    }

    /// Advances the time without a report.
    fn tick(&mut self, now_ms: u32) -> PyGateStep {
        self.with(|gate| gate.tick(now_ms)).into()
    }

    /// Ends a latched fault and the permits so far.
    fn reset(&mut self, py: Python<'_>, now_ms: u32) -> PyResult<()> {
        let done = self.with(|gate| gate.reset(now_ms));
        done.map_err(|error| refused_argument(py, error.to_string(), "make the gate again"))
    }

    /// The name of the state: inhibited, qualifying, permitted or latched.
    #[getter]
    fn state(&mut self) -> &'static str {
        self.with(|gate| gate.state().name())
    }
}

impl PyGate {
    fn with<T>(&mut self, work: impl FnOnce(&mut Gate<'_>) -> T) -> T {
        self.running.with_dependent_mut(|_, gate| work(gate))
    }
}

/// Carries a fix forward along odometry, as the controller does: a slow source gives a pose-set for now.
///
/// `noise` has the deviations of the odometry: m per root of a metre, rad per root of a radian, rad per root of a metre; `slip` is its
/// largest error as a share of each movement. `max_speed` (m/s) and `max_yaw_rate` (rad/s) bound an increment.
///
/// >>> import posegate
/// >>> table = posegate.Table.open("demo-out/dock.posegate")
/// >>> tracker = posegate.Tracker(table, max_speed=0.5, max_yaw_rate=1.0)
/// >>> for t in range(0, 200, 20):
/// ...     tracker.odometry(0.001, 0.0, 0.0, t, t + 20)
/// >>> tracker.fix(100, 0.0, 0.0, 0.0, [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]])
/// >>> x, y, yaw = tracker.tracked(200)["pose"]
/// >>> round(x, 4)
/// 0.005
/// >>> gate = posegate.Gate(table, period_ms=20, jitter_ms=20)
/// >>> gate.step_on(200, tracker).reason is None
/// True
#[pyclass(name = "Tracker", module = "posegate")]
pub struct PyTracker {
    tracker: Tracker<INCREMENTS>,
    frame: FrameId,
    sequence: u32,
}

#[pymethods]
impl PyTracker {
    #[new]
    #[pyo3(signature = (table, *, max_speed, max_yaw_rate, frame="map", noise=(0.02, 0.05, 0.02), slip=0.02, cross_terms="filled", inflation=1.0, max_gap_ms=200, max_fix_age_ms=5000))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        table: &PyTable,
        max_speed: f64,
        max_yaw_rate: f64,
        frame: &str,
        noise: (f64, f64, f64),
        slip: f64,
        cross_terms: &str,
        inflation: f64,
        max_gap_ms: u32,
        max_fix_age_ms: u32,
    ) -> PyResult<Self> {
        let settings = TrackerSettings {
            errors: OdometryErrors {
                m_per_sqrt_m: noise.0,
                rad_per_sqrt_rad: noise.1,
                rad_per_sqrt_m: noise.2,
                slip,
                turn_slip: slip,
                ..OdometryErrors::NONE
            },
            bounds: motion(py, max_speed, max_yaw_rate)?,
            trust: trust(py, cross_terms, inflation)?,
            radius_squared: table.radius_squared(),
            maximum_gap_ms: max_gap_ms,
            maximum_fix_age_ms: max_fix_age_ms,
        };
        let tracker = Tracker::new(settings).ok_or_else(|| {
            refused_argument(
                py,
                "an argument of Tracker is out of range".into(),
                "give deviations and a share from 0 on, and at least 1 millisecond",
            )
        })?;
        Ok(Self {
            tracker,
            frame: FrameId::of(frame),
            sequence: 0,
        })
    }

    /// Adds a movement between two times: metres ahead, metres to the left, radians to the left. The end of one movement is the beginning of the
    /// next. Returns the name of the reason if the path is broken: a gap or a jump.
    fn odometry(
        &mut self,
        py: Python<'_>,
        ahead: f64,
        left: f64,
        turn: f64,
        from_ms: u32,
        to_ms: u32,
    ) -> PyResult<Option<&'static str>> {
        let increment = Increment::of(ahead, left, turn, [from_ms, to_ms]).ok_or_else(|| {
            refused_argument(
                py,
                format!("a movement of {ahead} m, {left} m, {turn} rad is too large"),
                "give the movement of one cycle: at most 4 m and an eighth of a turn",
            )
        })?;
        Ok(self.tracker.odometry(increment).err().map(Reason::name))
    }

    /// Takes a fix with its stamp: m, m, rad, and its covariance by rows or a `Bounded`. Returns the name of the reason if it cannot be carried.
    #[pyo3(signature = (stamp_ms, x, y, yaw, cov))]
    fn fix(
        &mut self,
        stamp_ms: u32,
        x: f64,
        y: f64,
        yaw: f64,
        cov: &Bound<'_, PyAny>,
    ) -> PyResult<Option<&'static str>> {
        self.sequence = self.sequence.wrapping_add(1);
        let report = report(self.frame, self.sequence, stamp_ms, [x, y, yaw], cov)?;
        Ok(self.tracker.fix(&report).err().map(Reason::name))
    }

    /// Returns the pose at the time of the newest odometry: a dict with `stamp_ms` and `pose`, or `reason` if there is none.
    fn tracked<'py>(
        &mut self,
        py: Python<'py>,
        now_ms: u32,
    ) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
        let found = pyo3::types::PyDict::new(py);
        match self.tracker.tracked(now_ms) {
            Ok(tracked) => {
                let pose = tracked.report.belief.mean();
                found.set_item("stamp_ms", tracked.report.stamp_ms)?;
                let pose = pose.map(posegate_replay::coordinates);
                found.set_item("pose", pose.ok().map(<(f64, f64, f64)>::from))?;
            }
            Err(reason) => found.set_item("reason", reason.name())?,
        }
        Ok(found)
    }
}

fn motion(py: Python<'_>, speed: f64, rate: f64) -> PyResult<MotionBounds> {
    MotionBounds::in_any_direction(speed, rate).ok_or_else(|| {
        refused_argument(
            py,
            format!("max_speed {speed} and max_yaw_rate {rate} are not speeds of a robot"),
            "give numbers from 0 to 1000 m/s and from 0 to 24 rad/s",
        )
    })
}

fn report(
    frame: FrameId,
    sequence: u32,
    stamp_ms: u32,
    pose: [f64; 3],
    cov: &Bound<'_, PyAny>,
) -> PyResult<Report> {
    Ok(Report {
        source: 0,
        frame,
        sequence,
        stamp_ms,
        belief: belief(pose, cov)?,
    })
}
