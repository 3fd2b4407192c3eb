//! Carries a fix forward by odometry: an estimate of half a second ago becomes an estimate of the current pose.
//!
//! A [`Tracker`] keeps the newest fix of a slow source (AMCL, a tag detector) and the increments of the odometry since its stamp. In
//! every control cycle [`Tracker::tracked`] gives a report for *now*: the pose is moved along the path, and the covariance is
//! carried by the adjoint of the path and grows by the odometry's noise. The slip is a bound next to the covariance. A gate evaluates
//! the result as any other report ([`crate::gate::Gate::step_on`]).
//!
//! ```
//! use posegate::motion::MotionBounds;
//! use posegate::report::{FrameId, PoseEstimate, Report};
//! use posegate::set::{Estimate, RadiusSquared, Trust};
//! use posegate::track::{Increment, OdometryErrors, Tracker, TrackerSettings};
//!
//! let settings = TrackerSettings {
//!     errors: OdometryErrors { m_per_sqrt_m: 0.01, rad_per_sqrt_rad: 0.02, rad_per_sqrt_m: 0.01, slip: 0.02, ..OdometryErrors::NONE },
//!     bounds: MotionBounds::of_mm_mrad(300, 0, 1_000),
//!     trust: Trust::FULL,
//!     radius_squared: RadiusSquared::from_q16(743_499).expect("from 1 to 256"),
//!     maximum_gap_ms: 60,
//!     maximum_fix_age_ms: 1_500,
//! };
//! let mut tracker = Tracker::<64>::new(settings).expect("numbers that are not below zero");
//! let estimate = Estimate { x_m: 1.0, y_m: 0.0, yaw_rad: 0.0 };
//! let fix = Report {
//!     source: 0,
//!     frame: FrameId::of("map"),
//!     sequence: 1,
//!     stamp_ms: 1_000,
//!     belief: PoseEstimate::diagonal(estimate, [1e-4, 1e-4, 1e-5]),
//! };
//! // The odometry at 50 Hz, 5 mm ahead each time. The fix arrives late.
//! for cycle in 0..10u32 {
//!     let increment = Increment::of(0.005, 0.0, 0.0, [940 + 20 * cycle, 960 + 20 * cycle]).expect("a short movement");
//!     tracker.odometry(increment)?;
//! }
//! tracker.fix(&fix)?;
//! // The robot is 35 mm ahead of its pose at the stamp of the fix.
//! let tracked = tracker.tracked(1_150)?;
//! assert_eq!(tracked.report.stamp_ms, 1_140);
//! assert_eq!(tracked.report.belief.mean()?.x_um, 1_035_000);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```
//!
//! # Assumptions
//! The errors of the odometry are those of [`OdometryErrors`]. Except for the slip, they are independent of the fix and of each other.
//! Both evaluations of a gate use the tracker's result, as that of a filter: the second evaluation does not detect a fault of its
//! memory. All numbers are integers; roundings and the curvature of the path's error are added outwards.

use crate::gate::{Evidence, Reason};
use crate::motion::MotionBounds;
use crate::num::{BinaryAngle, shifted_product};
use crate::pose::Pose;
use crate::report::{FrameId, Heading, PoseEstimate, Report};
use crate::set::{self, Carriable, Growth, PathNoise, RadiusSquared, Trust, Uncertainty};
use crate::task::Risk;

pub use self::increment::Increment;
pub use self::model::OdometryErrors;

use self::increment::Excess;
use self::model::Noise;
use self::ring::Ring;
use self::way::Way;

#[cfg(test)]
mod error_budget;
mod increment;
mod model;
mod ring;
#[cfg(test)]
mod tests;
mod way;

/// The settings of a tracker.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackerSettings {
    /// The errors of the odometry. Lengths and turns may be those that the robot drove or those that the odometry reported: the bounds hold
    /// for the longer. A length is that of the path, not of the line between its ends.
    pub errors: OdometryErrors,
    /// The largest speeds of the robot. A larger increment is a jump.
    pub bounds: MotionBounds,
    /// The trust in the covariances of fixes. The tracker applies it, so the gate's source is declared with
    /// [`Trust::FULL`].
    pub trust: Trust,
    /// The squared radius of the table ([`crate::table::Table::radius_squared`]), or the largest of several ([`Tracker::cover`]).
    pub radius_squared: RadiusSquared,
    /// The longest time between two increments, and from the newest to now, milliseconds.
    pub maximum_gap_ms: u32,
    /// The largest age of a carried fix, milliseconds. The growth of its set usually ends its use much earlier.
    pub maximum_fix_age_ms: u32,
}

/// A report for now, carried from a fix.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tracked {
    /// The report, with the stamp of the newest odometry.
    pub report: Report,
    /// Bound of the slip and of the rounding errors, in addition to the covariance.
    pub beside: Growth,
}

impl Tracked {
    /// Returns the evidence for [`crate::gate::Gate::step_on`].
    #[must_use]
    pub const fn evidence(&self) -> Evidence<'_> {
        Evidence {
            report: &self.report,
            others: &[],
            beside: self.beside,
            since_fix_ms: None,
            elsewhere: Risk::NONE,
        }
    }
}

/// A fix, and the path since its stamp.
#[derive(Clone, Copy, Debug)]
struct Fix {
    source: u8,
    frame: FrameId,
    sequence: u32,
    stamp_ms: u32,
    /// What is carried, or why the estimate is not valid.
    start: Result<Start, Reason>,
    way: Way,
}

/// The estimate of a fix, read once: its pose, and its set with the trust applied.
#[derive(Clone, Copy, Debug)]
struct Start {
    mean: Pose,
    spread: Carriable,
    /// The bounded part of the set, which is carried separately from the noise of the path, since that is an ellipsoid.
    cylinder: Growth,
}

impl Start {
    fn of(belief: &PoseEstimate, trust: Trust) -> Result<Self, Reason> {
        const NOTHING: [[f64; 3]; 3] = [[1e-12, 0.0, 0.0], [0.0, 1e-12, 0.0], [0.0, 0.0, 1e-12]];
        let mean = belief.mean()?;
        let (spread, cylinder) = match belief.spread.as_ref().ok_or(Reason::CovarianceUnknown)? {
            Uncertainty::Gaussian(covariance) => (Carriable::of(covariance, trust)?, Growth::NONE),
            Uncertainty::Bounded {
                translation_m,
                yaw_rad,
            } => {
                let cylinder = Growth::of(*translation_m, *yaw_rad)
                    .filter(|growth| growth.translation_um() > 0 && growth.yaw_q24() > 0)
                    .ok_or(Reason::BoundInvalid)?;
                let inflated = cylinder.inflated(trust.inflation);
                (Carriable::of(&NOTHING, Trust::FULL)?, inflated)
            }
        };
        Ok(Self {
            mean,
            spread,
            cylinder,
        })
    }
}

/// Carries the newest fix along the odometry. N is the number of increments that are kept for late fixes; increments that together last at most 8 ms
/// are kept as one, so 64 reach back 256 ms at least ([`Tracker::reach_ms`]).
#[derive(Debug)]
pub struct Tracker<const N: usize> {
    settings: TrackerSettings,
    noise: Noise,
    /// The longest time of an increment that cannot be mistaken for another.
    longest_ms: u32,
    /// Increments from the oldest to the newest.
    ring: Ring<N>,
    /// The stamp at which the oldest increment of the ring begins.
    begins_ms: u32,
    /// The stamp of the newest increment, if there is one.
    newest_ms: Option<u32>,
    fix: Option<Fix>,
    /// The number of reports returned, and the stamp of the last.
    sequence: u32,
    given_ms: Option<u32>,
}

#[cfg(feature = "defmt")]
impl<const N: usize> defmt::Format for Tracker<N> {
    fn format(&self, f: defmt::Formatter<'_>) {
        let carries = self.fix.is_some();
        defmt::write!(
            f,
            "Tracker {{ newest_ms: {}, carries: {} }}",
            self.newest_ms,
            carries
        );
    }
}

impl<const N: usize> Tracker<N> {
    /// Returns a tracker without odometry and without a fix. `None` unless the errors are numbers that are not below zero, and the
    /// times are from 1 to 2^31 - 1.
    #[must_use]
    pub fn new(settings: TrackerSettings) -> Option<Self> {
        let is_time = |ms: u32| (1..1 << 31).contains(&ms);
        let are_times = is_time(settings.maximum_gap_ms) && is_time(settings.maximum_fix_age_ms);
        let noise = Noise::of(&settings.errors)?;
        (are_times && settings.trust.is_valid()).then_some(Self {
            settings,
            longest_ms: noise.longest_ms(settings.bounds),
            noise,
            ring: Ring::new(),
            begins_ms: 0,
            newest_ms: None,
            fix: None,
            sequence: 0,
            given_ms: None,
        })
    }

    /// Takes an increment of the odometry: the movement since the previous increment.
    ///
    /// # Errors
    /// [`Reason::OdometryGap`], [`Reason::OdometryJump`] or [`Reason::OdometryBackwards`]. The path is then broken: the tracker
    /// restarts with this increment, and waits for a newer fix. Close the gate with the reason
    /// ([`crate::gate::Gate::inhibit`]).
    pub fn odometry(&mut self, increment: Increment) -> Result<(), Reason> {
        let Some(before) = self.newest_ms else {
            // Its beginning is unknown, so it only marks the time.
            self.restart(increment.step.stamp_ms);
            return Ok(());
        };
        let Increment { step, begins_ms } = increment;
        let passed = step.stamp_ms.wrapping_sub(before);
        let broken = if !(1..1 << 31).contains(&passed) {
            Some(Reason::OdometryBackwards)
        } else if begins_ms != before || !(passed <= self.settings.maximum_gap_ms) {
            // It began at another time: an increment was lost in between.
            Some(Reason::OdometryGap)
        } else if !(passed <= self.longest_ms && step.is_within(self.settings.bounds, passed)) {
            Some(Reason::OdometryJump)
        } else {
            None
        };
        if let Some(reason) = broken {
            self.restart(step.stamp_ms);
            return Err(reason);
        }
        let driven = step.driven(Excess::NONE);
        if let Some(oldest) = self.ring.push(step, driven, begins_ms) {
            self.begins_ms = oldest.stamp_ms;
        }
        self.newest_ms = Some(step.stamp_ms);
        let most = self.settings.maximum_fix_age_ms;
        self.fix
            .take_if(|fix| step.stamp_ms.wrapping_sub(fix.stamp_ms) as i32 > most as i32);
        if let Some(fix) = &mut self.fix {
            fix.way.add(&step, driven, passed, &self.noise);
        }
        Ok(())
    }

    /// Discards the fix. Call it after a fix that cannot be carried, such as one with several hypotheses.
    pub fn drop_fix(&mut self) {
        self.fix = None;
    }

    /// Discards the path and the fix, as after a jump. Call it for odometry that is not a number. The next increment only marks the time.
    pub fn forget(&mut self) {
        self.restart(self.newest_ms.unwrap_or(0));
        self.newest_ms = None;
    }

    fn restart(&mut self, stamp_ms: u32) {
        self.ring.clear();
        self.begins_ms = stamp_ms;
        self.newest_ms = Some(stamp_ms);
        self.fix = None;
    }

    /// Takes the squared radius of another table if it is larger: the bounds of a report hold up to this radius. For a gate whose table changes.
    pub const fn cover(&mut self, radius_squared: RadiusSquared) {
        if radius_squared.q16() > self.settings.radius_squared.q16() {
            self.settings.radius_squared = radius_squared;
        }
    }

    /// Returns how far back the kept increments reach from the newest, milliseconds: a fix that is older is refused with
    /// [`Reason::OdometryTooShort`].
    #[must_use]
    pub fn reach_ms(&self) -> u32 {
        self.newest_ms
            .map_or(0, |newest| newest.wrapping_sub(self.begins_ms))
    }

    /// Takes a fix, also a late one: it is carried along the increments since its stamp.
    ///
    /// All fixes come from one source, each with another sequence number: a source that sends an old estimate with a new stamp would
    /// place the robot where it was. After such a fix, and after one of another source, nothing is carried until the next.
    ///
    /// # Errors
    /// [`Reason::Silent`] if there was no odometry yet; [`Reason::OdometryTooShort`] if the kept increments do not reach back to the
    /// stamp; [`Reason::TimeBackwards`] if the fix is not newer than the carried fix, or newer than the odometry by more than
    /// its longest gap. The tracker then keeps the previous fix. [`Reason::SequenceStuck`], [`Reason::SourceChanged`] or
    /// [`Reason::FrameMismatch`]: the tracker then carries nothing.
    pub fn fix(&mut self, report: &Report) -> Result<(), Reason> {
        let newest = self.newest_ms.ok_or(Reason::Silent)?;
        if let Some(fix) = &self.fix
            && !(1..1 << 31).contains(&report.stamp_ms.wrapping_sub(fix.stamp_ms))
        {
            return Err(Reason::TimeBackwards);
        }
        if let Some(last) = &self.fix {
            let wrong = if report.source != last.source {
                Some(Reason::SourceChanged)
            } else if report.frame != last.frame {
                Some(Reason::FrameMismatch)
            } else if report.sequence == last.sequence {
                Some(Reason::SequenceStuck)
            } else {
                None
            };
            if let Some(reason) = wrong {
                self.fix = None;
                return Err(reason);
            }
        }
        let mut way = Way::new(&self.noise);
        let ahead = report.stamp_ms.wrapping_sub(newest);
        if ahead < 1 << 31 {
            // At the newest odometry or after it. The movement in between counts twice, in both directions: once as the
            // part of the next increment before the fix.
            if !(ahead <= self.settings.maximum_gap_ms) {
                return Err(Reason::TimeBackwards);
            }
            way.leave_out(self.settings.bounds.within(ahead.wrapping_add(1)));
        } else {
            let from_ms = self.begins_ms;
            if !(report.stamp_ms.wrapping_sub(from_ms) < 1 << 31) {
                return Err(Reason::OdometryTooShort);
            }
            let mut since = from_ms;
            for (increment, excess) in (0..N).filter_map(|k| self.ring.get(k)) {
                let passed = increment.stamp_ms.wrapping_sub(since);
                // How long the increment lasted after the fix.
                let after = increment.stamp_ms.wrapping_sub(report.stamp_ms);
                if (1..1 << 31).contains(&after) {
                    if after < passed {
                        // The robot may have moved unevenly: back and forth within its bounds.
                        let share = [after, passed];
                        let driven = increment.driven_part(excess, share);
                        way.add(&increment.part(share), driven, after, &self.noise);
                        way.leave_out(self.settings.bounds.within(unevenness([after, passed])));
                        // The axes of the increment are those before the turn up to the fix.
                        let turned = self
                            .settings
                            .bounds
                            .within(passed.wrapping_sub(after).saturating_add(1));
                        let driven = self.settings.bounds.within(after.saturating_add(1));
                        way.leave_out(driven.swung(turned.yaw_q24()));
                    } else {
                        way.add(increment, increment.driven(excess), passed, &self.noise);
                    }
                }
                since = increment.stamp_ms;
            }
            // A millisecond for the rounding of the stamps.
            way.leave_out(self.settings.bounds.within(1));
        }
        self.fix = Some(Fix {
            source: report.source,
            frame: report.frame,
            sequence: report.sequence,
            stamp_ms: report.stamp_ms,
            start: Start::of(&report.belief, self.settings.trust),
            way,
        });
        Ok(())
    }

    /// Returns the report for now: the newest fix, carried to the newest odometry.
    ///
    /// # Errors
    /// [`Reason::Silent`] without a fix; [`Reason::OdometryGap`] if the newest odometry is too old; [`Reason::Stale`] if the fix is;
    /// and the reasons of a fix whose estimate is not valid.
    pub fn tracked(&mut self, now_ms: u32) -> Result<Tracked, Reason> {
        let newest = self.newest_ms.ok_or(Reason::Silent)?;
        let Some(fix) = &self.fix else {
            return Err(Reason::Silent);
        };
        if !(now_ms.wrapping_sub(newest) <= self.settings.maximum_gap_ms) {
            return Err(Reason::OdometryGap);
        }
        if !(now_ms.wrapping_sub(fix.stamp_ms) <= self.settings.maximum_fix_age_ms) {
            return Err(Reason::Stale);
        }
        // A fix that is newer than the odometry is not carried; its stamp is the newer one.
        let ahead = fix.stamp_ms.wrapping_sub(newest);
        let stamp_ms = if ahead < 1 << 31 {
            fix.stamp_ms
        } else {
            newest
        };
        let (belief, beside) = self.carried(&fix.start?, &fix.way)?;
        let (source, frame) = (fix.source, fix.frame);
        if self.given_ms != Some(stamp_ms) {
            self.sequence = self.sequence.wrapping_add(1);
        }
        self.given_ms = Some(stamp_ms);
        Ok(Tracked {
            report: Report {
                source,
                frame,
                sequence: self.sequence,
                stamp_ms,
                belief,
            },
            beside,
        })
    }

    fn carried(&self, start: &Start, way: &Way) -> Result<(PoseEstimate, Growth), Reason> {
        let mean = start.mean;
        let facing = mean.yaw.cos_sin_q30();
        let [dx, dy] = way.in_world(facing);
        let x = i64::from(mean.x_um).wrapping_add(dx);
        let y = i64::from(mean.y_um).wrapping_add(dy);
        let yaw = mean.yaw.plus(BinaryAngle(way.turn()));
        let noise = way.noise_in_world(facing);
        let mut beside = way.slip(&self.noise);
        // A cylinder has no covariance that the path could turn.
        let by = if start.cylinder == Growth::NONE {
            [dx, dy]
        } else {
            let swung = way.swung(start.cylinder.yaw_q24());
            beside = beside.plus(start.cylinder).plus(Growth::new(swung, 0));
            [0, 0]
        };
        let spread = set::carried(&start.spread, by, &noise)?;
        beside = beside.plus(way.curvature(&spread, self.settings.radius_squared));
        let belief = PoseEstimate {
            x_m: set::metres(x),
            y_m: set::metres(y),
            heading: Heading::Radians(set::radians(yaw.signed())),
            spread: Some(Uncertainty::Gaussian(spread)),
        };
        Ok((belief, beside))
    }
}

/// Returns the largest deviation from an even movement, as the time in milliseconds that a robot at its bounds needs for it, when
/// `after` of an increment of `whole` is left: with a known end, at most `2 after (whole - after) / whole`. Rounded up, with a
/// millisecond for the stamps of the increment.
fn unevenness([after, whole]: [u32; 2]) -> u32 {
    let before = whole.wrapping_sub(after);
    let product = u64::from(after)
        .wrapping_mul(u64::from(before))
        .wrapping_mul(2);
    let ms = product.checked_div(u64::from(whole)).unwrap_or(0);
    (ms as u32).saturating_add(2)
}

/// Returns the noise of a path, in the robot's axes at its start, rotated into world axes: by twice the angle about the mean of both variances.
fn turned(noise: &PathNoise, [c, s]: [i32; 2]) -> PathNoise {
    let (c, s) = (i64::from(c), i64::from(s));
    let PathNoise {
        xx,
        xy,
        yy,
        xt,
        yt,
        tt,
    } = *noise;
    // Hardly above 2^60 each, so a product is about as large as its entry.
    let cosine = c.wrapping_mul(c).wrapping_sub(s.wrapping_mul(s));
    let sine = c.wrapping_mul(s).wrapping_mul(2);
    let by = shifted_product::<60>;
    let once = shifted_product::<30>;
    // Variances are not below zero. What is out of range is refused later: where a sum could wrap back into the range, it saturates.
    let apart = xx.saturating_sub(yy);
    let mean = (xx >> 1).saturating_add(yy >> 1);
    let deviation = (by(cosine, apart) >> 1).saturating_sub(by(sine, xy));
    // Cosine and sine are within 2 of 2^-30, so those of twice the angle together within 2^-27.5, and the matrix is off by as much of its mean.
    let slack = (xx.max(yy) >> 26).wrapping_add(8);
    let across = (xt.saturating_abs().max(yt.saturating_abs()) >> 28).wrapping_add(2);
    let wider = slack.wrapping_add(across);
    PathNoise {
        xx: mean.saturating_add(deviation).saturating_add(wider),
        yy: mean.saturating_sub(deviation).saturating_add(wider),
        xy: (by(sine, apart) >> 1).saturating_add(by(cosine, xy)),
        xt: once(c, xt).wrapping_sub(once(s, yt)),
        yt: once(s, xt).wrapping_add(once(c, yt)),
        tt: tt.wrapping_add(across.wrapping_mul(2)),
    }
}
