//! The case study of the paper: site, proven tables, questions and answers.
//!
//! ```no_run
//! use posegate_show::draw::study::{CaseStudy, PoseSetSpec, DOCK, SEE};
//!
//! // Builds and proves the tables: seconds.
//! let study = CaseStudy::run(&|| ())?;
//! // Known to 1 m and 2 degrees, the robot is certain to see the tag, but not to dock.
//! assert!(study.ask(SEE, PoseSetSpec::ONE_METRE)?.holds());
//! assert!(!study.ask(DOCK, PoseSetSpec::ONE_METRE)?.holds());
//! # Ok::<(), posegate_show::draw::study::StudyError>(())
//! ```

use super::belief::PoseSetF64;
use super::ingredients::radians;
use super::placement::Column;
use super::subject::DrawError;
use super::tag_places;
use posegate::bake::{self, BakeError, BakeInput, Layout};
use posegate::chain::StartAssumption;
use posegate::contain::Margin;
use posegate::gate::{Verdict, judge};
use posegate::set::{InputError, RadiusSquared, Uncertainty};
use posegate::table::Table;
use posegate::verify::{ExpectedTable, Proof, VerifyError, verify};
use posegate_plan::{ChainReport, evaluate};
use posegate_replay::{coordinates, factor, factor_text};
use posegate_site::{Site, SiteError, Task};
use std::fmt;
use std::time::Instant;

/// The study's site file.
pub const SITE: &str = include_str!("study.toml");

/// Parking, Fig. 1.
pub const PARK: &str = "park";
/// Docking: its success set is S_w.
pub const DOCK: &str = "dock";
/// Seeing the tag: its success set is S_l.
pub const SEE: &str = "see-t7";
/// The chain of Fig. 2: a look, then docking.
pub const CHAIN: &str = "look-then-dock";

/// The uncertainty of the robot's pose, about the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PoseSetSpec {
    /// A bound.
    Bounded {
        /// Metres.
        translation: f64,
        /// Degrees.
        yaw_deg: f64,
    },
    /// A normal distribution without correlations, at the site's confidence.
    Gaussian {
        /// Standard deviation along x and along y, metres.
        sigma: f64,
        /// Standard deviation of the yaw, degrees.
        sigma_yaw_deg: f64,
    },
}

impl PoseSetSpec {
    /// 1 m and 2 degrees: the paper's robot before it localizes.
    pub const ONE_METRE: Self = Self::bound(1.0);
    /// 2 m and 2 degrees: too uncertain to see the tag.
    pub const TWO_METRES: Self = Self::bound(2.0);
    /// 5 cm and 2 degrees: the robot after it has seen the tag.
    pub const FIVE_CENTIMETRES: Self = Self::bound(0.05);
    /// 10 cm and 2 degrees: certain enough for parking.
    pub const TEN_CENTIMETRES: Self = Self::bound(0.1);

    const fn bound(translation: f64) -> Self {
        Self::Bounded {
            translation,
            yaw_deg: 2.0,
        }
    }

    const fn normal(sigma: f64, sigma_yaw_deg: f64) -> Self {
        Self::Gaussian {
            sigma,
            sigma_yaw_deg,
        }
    }

    /// Returns the pose-set about an estimate (m, m, rad), with the squared radius of a Gaussian set.
    pub(super) fn about(&self, estimate: [f64; 3], radius_squared: RadiusSquared) -> PoseSetF64 {
        let spread = match *self {
            Self::Bounded {
                translation,
                yaw_deg,
            } => Uncertainty::Bounded {
                translation_m: translation,
                yaw_rad: yaw_deg.to_radians(),
            },
            Self::Gaussian {
                sigma,
                sigma_yaw_deg,
            } => {
                let yaw = sigma_yaw_deg.to_radians();
                Uncertainty::Gaussian([
                    [sigma * sigma, 0.0, 0.0],
                    [0.0, sigma * sigma, 0.0],
                    [0.0, 0.0, yaw * yaw],
                ])
            }
        };
        PoseSetF64 {
            estimate,
            spread,
            radius_squared,
        }
    }
}

/// `1 m / 2°`, `5 cm / 2°`, `sigma 0.3 m / 1°`.
impl fmt::Display for PoseSetSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Bounded {
                translation,
                yaw_deg,
            } if translation < 1.0 => write!(f, "{} cm / {yaw_deg}°", translation * 100.0),
            Self::Bounded {
                translation,
                yaw_deg,
            } => write!(f, "{translation} m / {yaw_deg}°"),
            Self::Gaussian {
                sigma,
                sigma_yaw_deg,
            } => write!(f, "sigma {sigma} m / {sigma_yaw_deg}°"),
        }
    }
}

/// The study's questions: is this pose-set, about the goal, inside that task's success set?
pub const QUESTIONS: [(&str, PoseSetSpec); 10] = [
    (PARK, PoseSetSpec::TEN_CENTIMETRES),
    (PARK, PoseSetSpec::ONE_METRE),
    (DOCK, PoseSetSpec::FIVE_CENTIMETRES),
    (DOCK, PoseSetSpec::ONE_METRE),
    (SEE, PoseSetSpec::FIVE_CENTIMETRES),
    (SEE, PoseSetSpec::ONE_METRE),
    (SEE, PoseSetSpec::TWO_METRES),
    (SEE, PoseSetSpec::normal(0.1, 1.0)),
    (SEE, PoseSetSpec::normal(0.3, 1.0)),
    (SEE, PoseSetSpec::normal(0.5, 2.0)),
];

/// A question with the gate's verdict on the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The name of the task.
    pub task: String,
    /// The pose-set.
    pub known: PoseSetSpec,
    /// The gate's verdict.
    pub verdict: Verdict,
}

impl Answer {
    /// Returns `true` if the pose-set is proven inside.
    #[must_use]
    pub const fn holds(&self) -> bool {
        self.verdict.is_permit()
    }

    /// Returns the largest scale at which the pose-set is proven inside.
    const fn scale(&self) -> Margin {
        match self.verdict {
            Verdict::Permit { margin }
            | Verdict::Deny {
                margin: Some(margin),
                ..
            } => margin,
            Verdict::Deny { margin: None, .. } => Margin::from_q16(0),
        }
    }

    /// Returns the largest factor by which the pose-set is proven inside.
    #[must_use]
    pub fn margin(&self) -> f64 {
        factor(self.scale())
    }

    /// Returns `inside` or `NOT inside`.
    #[must_use]
    pub const fn holds_text(&self) -> &'static str {
        if self.holds() { "inside" } else { "NOT inside" }
    }

    /// Returns the margin with three decimals, rounded down: the printed value is still proven.
    #[must_use]
    pub fn margin_text(&self) -> String {
        factor_text(self.scale())
    }

    /// Returns the first pose to leave the table as the pose-set grows, in the world: m, m, rad.
    #[must_use]
    pub fn worst_pose(&self) -> Option<[f64; 3]> {
        match self.verdict {
            Verdict::Permit { .. } => None,
            Verdict::Deny { worst_pose, .. } => worst_pose.map(coordinates),
        }
    }
}

/// A task's table with its proof.
#[derive(Clone, Debug)]
pub struct ProvenTable {
    /// The task's name.
    pub task: String,
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// The proof.
    pub proof: Proof,
    /// Duration of the baking, seconds.
    pub bake_s: f64,
    /// Duration of the proof, seconds.
    pub prove_s: f64,
}

/// The study: site, proven tables, answers.
#[derive(Clone, Debug)]
pub struct CaseStudy {
    /// The site of [`SITE`].
    pub site: Site,
    /// One table per task, in the order of the site.
    pub tables: Vec<ProvenTable>,
    /// The answers to [`QUESTIONS`], in that order.
    pub answers: Vec<Answer>,
    /// The tag's places of Fig. 4: before, and the best ones for growing uncertainty.
    pub places: Vec<Column>,
}

/// The reason why the study failed. Each is an internal error, because the study's input is built
/// in.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The site file is not valid.
    #[error(transparent)]
    Site(#[from] SiteError),
    /// The site does not have a task, its table cannot be read, or it has no picture.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// A task's table has no extent or no step.
    #[error("the task `{0}` has no table")]
    NoTable(String),
    /// The table cannot be baked.
    #[error("the table of `{0}` cannot be baked: {1}")]
    Bake(String, BakeError),
    /// The table is not proven.
    #[error("the table of `{0}` is not proven: {1}")]
    Verify(String, VerifyError),
    /// A pose-set is not valid.
    #[error("the pose-set {0} is not valid: {1}")]
    PoseSet(PoseSetSpec, InputError),
    /// The chain of Fig. 2 cannot be evaluated.
    #[error("the chain of Fig. 2: {0}")]
    Chain(String),
    /// The tag has no best place.
    #[error("no place for the tag: {0}")]
    Place(String),
}

impl CaseStudy {
    /// Returns the number of progress calls of [`CaseStudy::run`].
    ///
    /// # Errors
    /// As [`CaseStudy::run`].
    pub fn steps() -> Result<u64, StudyError> {
        let site = site()?;
        let mut steps = 0;
        for (name, task) in &site.tasks {
            let cells = order(&site, name, task)?.spec.cells();
            let cells = cells.map_err(|error| StudyError::Bake(name.clone(), error))?;
            // Each slab is baked once and proven once.
            steps += 2 * u64::from(cells.slabs);
        }
        Ok(steps + tag_places::STEPS)
    }

    /// Bakes and proves every table and answers every question. `progress` is called for every slab
    /// that is baked or proven.
    ///
    /// # Errors
    /// The first [`StudyError`] that occurs.
    pub fn run(progress: &(dyn Fn() + Sync)) -> Result<Self, StudyError> {
        let site = site()?;
        let mut study = Self {
            tables: Vec::new(),
            answers: Vec::new(),
            places: tag_places::places(
                &site.task(SEE).map_err(DrawError::from)?.success,
                site.epsilon,
                progress,
            )
            .map_err(StudyError::Place)?,
            site,
        };
        for (name, task) in &study.site.tasks {
            study
                .tables
                .push(proven(&study.site, name, task, progress)?);
        }
        for (task, known) in QUESTIONS {
            let answer = study.ask(task, known)?;
            study.answers.push(answer);
        }
        Ok(study)
    }

    /// Returns the task with a name.
    ///
    /// # Errors
    /// [`StudyError::Draw`] if there is no such task.
    pub fn task(&self, name: &str) -> Result<&Task, StudyError> {
        Ok(self.site.task(name).map_err(DrawError::from)?)
    }

    /// Returns the table of a task.
    ///
    /// # Errors
    /// [`StudyError::NoTable`] if the task has no table, [`StudyError::Draw`] if its bytes cannot
    /// be parsed.
    pub fn table(&self, task: &str) -> Result<Table<'_>, StudyError> {
        let proven = self.tables.iter().find(|table| table.task == task);
        let proven = proven.ok_or_else(|| StudyError::NoTable(task.into()))?;
        Ok(Table::parse(&proven.bytes).map_err(DrawError::Table)?)
    }

    /// Returns the gate's verdict on whether a pose-set about the task's goal is inside the task's
    /// success set.
    ///
    /// # Errors
    /// [`StudyError`] if the site does not have the task or its table.
    pub fn ask(&self, task: &str, known: PoseSetSpec) -> Result<Answer, StudyError> {
        let goal = radians(self.task(task)?.success.goal);
        let table = self.table(task)?;
        let set = known.about(goal, table.radius_squared()).pose_set();
        let set = set.map_err(|why| StudyError::PoseSet(known, why))?;
        Ok(Answer {
            task: task.into(),
            known,
            verdict: judge(&table, &set),
        })
    }

    /// Returns the chain of Fig. 2: each task begins with the estimate at its goal, as in the paper. The margin of a step is the
    /// larger of two proven ones, its own and that of the task's table.
    ///
    /// # Errors
    /// [`StudyError::Chain`] if the chain cannot be evaluated.
    pub fn chain(&self) -> Result<ChainReport, StudyError> {
        let fault = |error: &dyn fmt::Display| StudyError::Chain(error.to_string());
        let chain = self.site.chain(CHAIN).map_err(|error| fault(&error))?;
        let report = evaluate(&self.site, CHAIN, chain, StartAssumption::AtGoal);
        let mut report = report.map_err(|error| fault(&error))?;
        for step in &mut report.steps {
            let [translation, yaw] = step.before.enclosing();
            let known = PoseSetSpec::Bounded {
                translation,
                yaw_deg: yaw.to_degrees(),
            };
            let answer = self.ask(step.task.as_deref().unwrap_or_default(), known)?;
            if answer.holds() == step.failure.is_none() {
                let own = step.margin.map_or(0, Margin::q16);
                step.margin = Some(Margin::from_q16(own.max(answer.scale().q16())));
            }
        }
        Ok(report)
    }
}

fn site() -> Result<Site, StudyError> {
    Ok(Site::parse(SITE, "site.toml")?)
}

fn order<'a>(site: &Site, name: &'a str, task: &'a Task) -> Result<BakeInput<'a>, StudyError> {
    let spec = site.table_spec(task).copied();
    Ok(BakeInput {
        task: name,
        success: &task.success,
        spec: spec.ok_or_else(|| StudyError::NoTable(name.into()))?,
        epsilon: site.epsilon,
    })
}

fn proven(
    site: &Site,
    name: &str,
    task: &Task,
    progress: &(dyn Fn() + Sync),
) -> Result<ProvenTable, StudyError> {
    let mut order = order(site, name, task)?;
    order.spec.layout = Layout::Facets;
    let started = Instant::now();
    let bytes = bake::table(&order, progress).map_err(|e| StudyError::Bake(name.into(), e))?;
    let bake_s = started.elapsed().as_secs_f64();
    let claim = ExpectedTable {
        task: name,
        success: &task.success,
        epsilon: site.epsilon,
    };
    let started = Instant::now();
    let proof = verify(&bytes, &claim, progress).map_err(|e| StudyError::Verify(name.into(), e))?;
    Ok(ProvenTable {
        task: name.into(),
        bytes,
        proof,
        bake_s,
        prove_s: started.elapsed().as_secs_f64(),
    })
}
