//! The reasons for a denial: one list for firmware, command line and documents.

/// What to do about a denial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Advice {
    /// Ask again with the next report.
    Wait,
    /// Improve the estimate first.
    Relocalise,
    /// Improve the estimate by looking at the tag with this id.
    LookAtTag(u32),
    /// Bring the robot to where the task begins.
    Restage,
    /// Manual repair or configuration is needed.
    Service,
}

/// Why a gate denies. Each reason has one cause and one thing to do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[repr(u8)]
pub enum Reason {
    /// Some pose of the pose-set is outside of the success set.
    NotContained = 1,
    /// The pose-set is wider than the whole table.
    PoseSetTooLarge = 2,
    /// The estimate is not on the table.
    OutsideTable = 3,
    /// A coordinate of the estimate is NaN or infinite.
    EstimateNotFinite = 4,
    /// The estimate is beyond 2000 m or 16,384 rad.
    EstimateOutOfRange = 5,
    /// An entry of the covariance is NaN or infinite.
    CovarianceNotFinite = 6,
    /// The covariance was never filled.
    CovarianceZero = 7,
    /// The covariance differs from its transpose.
    CovarianceNotSymmetric = 8,
    /// The covariance is not positive definite.
    CovarianceNotPositiveDefinite = 9,
    /// The pose-set is beyond 268 m or 32 turns.
    CovarianceTooLarge = 10,
    /// An extent of a bounded pose-set is not a positive number.
    BoundInvalid = 11,
    /// The estimate is too old, or from the future.
    Stale = 12,
    /// No longer reported, kept for the logs of older firmware: the gate has no valid table. Reasons 29, 44
    /// and 45 say why.
    TableInvalid = 13,
    /// The source says itself that it does not know its covariance.
    CovarianceUnknown = 14,
    /// The orientation is no rotation.
    OrientationInvalid = 15,
    /// The robot is tilted by more than 5 degrees.
    Tilted = 16,
    /// The report is in another frame than its source was declared with.
    FrameMismatch = 17,
    /// No source of that number was declared.
    SourceUnknown = 18,
    /// Another source than that of the report before.
    SourceChanged = 19,
    /// A report is missing between this one and the one before.
    SequenceGap = 20,
    /// The sequence number stands still while the stamp moves.
    SequenceStuck = 21,
    /// The clock went backwards, or a stamp is not newer than all before.
    TimeBackwards = 22,
    /// The same report again, which still permits; it counts for nothing.
    Repeated = 23,
    /// No report has come for longer than a permit may stand.
    Silent = 24,
    /// Not enough permits in a row yet.
    Qualifying = 25,
    /// The gate was closed a short while ago and stays so for its hold time.
    Holding = 26,
    /// The table is that of another task.
    WrongTask = 27,
    /// The table has another task digest: it was made for another goal, set or confidence.
    WrongSite = 28,
    /// The bytes are not a table, or changed while the gate was running.
    TableDamaged = 29,
    /// The program's own bytes are not those that were sealed.
    CodeDamaged = 30,
    /// A word of the gate's memory differs from its complement, or its settings have changed.
    MemoryDamaged = 31,
    /// The second evaluation does not confirm a permit.
    EvaluationsDisagree = 32,
    /// The interlock's output does not follow.
    InterlockFault = 33,
    /// The self-test did not give the known answers.
    SelfTestFailed = 34,
    /// A control cycle came later than the response time after the one before, while the gate was open.
    CycleLate = 35,
    /// A report has more hypotheses than a gate weighs.
    TooManyHypotheses = 36,
    /// The odometry has a gap, or none has come for too long.
    OdometryGap = 37,
    /// An increment of the odometry is larger than the robot can move.
    OdometryJump = 38,
    /// A stamp of the odometry is not newer than the one before.
    OdometryBackwards = 39,
    /// The odometry does not reach back to the stamp of the fix.
    OdometryTooShort = 40,
    /// The hypotheses of a report leave out more than the confidence allows.
    ElsewhereTooLikely = 41,
    /// The cells were walked as far as the settings allow, without an answer.
    TooCostly = 42,
    /// The fixes contradict the errors that the source claims.
    ModelContradicted = 43,
    /// The table has a later format version than the gate reads.
    TableTooNew = 44,
    /// The table needs a part of the gate that this firmware does not contain.
    PartMissing = 45,
    /// The counter of the controller's clock stands still.
    ClockStopped = 46,
    /// Two poses of the robot fit the corners of a tag, and not both are inside.
    TagPosesAmbiguous = 47,
    /// No pose of the robot fits the corners of the tags.
    CornersDoNotFit = 48,
    /// A detected tag has fewer than four corners.
    TooFewCorners = 49,
}

/// Makes [`Reason::ALL`] and the texts of each reason: its variant, its name in `snake_case`, what to do in a form for programs, a sentence that says what
/// happened, and one that says what to do.
macro_rules! reasons {
    ($($variant:ident $name:literal $advice:ident $meaning:literal $action:literal;)+) => {
        impl Reason {
            /// Every reason, in the order of the codes.
            pub const ALL: [Self; 49] = [$(Self::$variant),+];

            /// The names of all reasons in the order of the codes, each with a zero after it, for C.
            pub const NAMES: &'static str = concat!($($name, "\0"),+);
            /// As [`Reason::NAMES`], for the sentences that say what happened.
            pub const MEANINGS: &'static str = concat!($($meaning, "\0"),+);
            /// As [`Reason::NAMES`], for the sentences that say what to do.
            pub const ACTIONS: &'static str = concat!($($action, "\0"),+);

            /// Returns the name in `snake_case`, the same in every output.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }

            /// Returns a sentence that says what happened.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Self::$variant => $meaning,)+
                }
            }

            /// Returns a sentence that says what to do.
            #[must_use]
            pub const fn action(self) -> &'static str {
                match self {
                    $(Self::$variant => $action,)+
                }
            }

            const fn kind_of_advice(self) -> Advice {
                match self {
                    $(Self::$variant => Advice::$advice,)+
                }
            }
        }
    };
}

reasons! {
    NotContained "not_contained" Relocalise
        "Some pose where the robot may be is not inside the success set as the table holds it."
        "Relocalise: look at a tag from where it is seen well, then ask again. The worst pose says on which side the set leaves.";
    PoseSetTooLarge "pose_set_too_large" Relocalise
        "The pose-set is wider than the whole table on some axis: no place of the robot could make it fit."
        "Relocalise: the filter is far too unsure for this task; a localization task must come first.";
    OutsideTable "outside_table" Restage
        "The estimate itself lies outside of the table's extent: the robot is not near the task's goal."
        "Restage: drive to the task's goal first. If the robot is there, the map frame or the table is wrong.";
    EstimateNotFinite "estimate_not_finite" Service
        "A coordinate of the estimate is NaN or infinite."
        "Service: the filter has diverged or the message is wired wrongly; restart the filter and check the frame.";
    EstimateOutOfRange "estimate_out_of_range" Service
        "The estimate is more than 2000 m from the origin, or its yaw has been wound up beyond 16384 rad."
        "Service: the filter has diverged or the message is wired wrongly; restart the filter and check the frame.";
    CovarianceNotFinite "covariance_not_finite" Service
        "An entry of the covariance is NaN or infinite."
        "Service: check how the covariance is filled and indexed (x, y, yaw; m, rad); restart the filter.";
    CovarianceZero "covariance_zero" Service
        "Every entry of the covariance is zero: the source never filled it."
        "Service: make the source fill its covariance; a detector that leaves it zero needs a bounded set from its error bound.";
    CovarianceNotSymmetric "covariance_not_symmetric" Service
        "The covariance differs from its transpose by more than rounding."
        "Service: check how the covariance is filled and indexed (x, y, yaw; m, rad); restart the filter.";
    CovarianceNotPositiveDefinite "covariance_not_positive_definite" Service
        "The covariance is not positive definite: a variance is zero or negative, or a correlation is 1 or beyond."
        "Service: check how the covariance is filled and indexed (x, y, yaw; m, rad); restart the filter.";
    CovarianceTooLarge "covariance_too_large" Relocalise
        "The pose-set that the covariance describes is more than 268 m or 32 turns wide."
        "Relocalise: the filter does not know where the robot is.";
    BoundInvalid "bound_invalid" Service
        "An extent of the bounded pose-set is zero, negative, not a number, or 268 m or more."
        "Service: give the error bound of the localization task (translation and yaw, both above zero).";
    Stale "stale" Wait
        "The estimate is older than the maximum age, or its stamp lies in the future."
        "Wait for a fresh estimate. If it stays stale, service: the link, or the clocks of robot and controller disagree.";
    TableInvalid "table_invalid" Service
        "The gate has no table (firmware from before table_damaged, table_too_new and part_missing)."
        "Service: flash a table that was made by the same version as the firmware, and verify it.";
    CovarianceUnknown "covariance_unknown" Service
        "The source says that it does not know its covariance (NaN in the first entry)."
        "Service: configure the source to tell its covariance, or give its reports a bounded set.";
    OrientationInvalid "orientation_invalid" Service
        "The orientation is no rotation: its quaternion is not of length 1, or NaN."
        "Service: the message is wired wrongly (the order is x, y, z, w in ROS; w, x, y, z in MAVLink) or was never filled.";
    Tilted "tilted" Restage
        "The robot is tilted by more than 5 degrees, so its pose is not a pose on the floor."
        "Restage: bring the robot to level ground. If it is there, the IMU or its mounting is wrong.";
    FrameMismatch "frame_mismatch" Service
        "The report's numbers are in another frame than the one that its source was declared with."
        "Service: publish the estimate in the map frame of the site, or declare the source with its frame.";
    SourceUnknown "source_unknown" Service
        "The report comes from a source that the gate was not told of."
        "Service: declare the source, or stop it from sending to this gate.";
    SourceChanged "source_changed" Wait
        "The report comes from another source than the one before it: one source must earn the permit alone."
        "Wait for reports of one source. If sources alternate, service: give each its own gate, or fuse them.";
    SequenceGap "sequence_gap" Wait
        "The sequence number is not the next one: a report was lost, or came twice out of order."
        "Wait for consecutive reports. If gaps go on, service: the link loses messages.";
    SequenceStuck "sequence_stuck" Service
        "The sequence number does not change while the stamp does: old estimates get new stamps."
        "Service: something between source and controller repeats estimates with fresh stamps.";
    TimeBackwards "time_backwards" Wait
        "The controller's clock went backwards, or the report is not newer than every one before it, whatever its source."
        "Wait for the next reports. If it goes on, service: a clock is being set, or was never set.";
    Repeated "repeated" Wait
        "The same report came again (sequence number and stamp of the previous one). It was evaluated, still permits, and does not count."
        "Wait for a new report.";
    Silent "silent" Wait
        "No report has come yet, or none for longer than a permit may stand."
        "Wait for a report. If none comes, service: the source has stopped, or the link is down.";
    Qualifying "qualifying" Wait
        "Every report so far permits, but they are not yet as many in a row as the gate asks for."
        "Wait for the next reports.";
    Holding "holding" Wait
        "The gate was closed a short while ago, and stays so for the time that it was told to hold."
        "Wait until the hold time is over.";
    WrongTask "wrong_task" Service
        "The table is valid, and that of another task than the controller expects."
        "Service: flash the table of this task.";
    WrongSite "wrong_site" Service
        "The table is valid, and was made for another goal, success set or confidence of the task than the controller expects (its task digest differs)."
        "Service: build table and firmware from the same site file (`posegate table info` prints a table's task digest).";
    TableDamaged "table_damaged" Service
        "The bytes are not a table (never written, cut short, or with a wrong checksum), or they changed while the gate was running."
        "Service: flash the table again and verify it. If it comes back, the flash is failing, or something writes to it.";
    CodeDamaged "code_damaged" Service
        "The program's own bytes are not those that were sealed, or it was never sealed: the check at start or the scrub found another checksum."
        "Service: if the firmware was never sealed, seal it (`posegate table seal`); else the flash is failing: flash the firmware again.";
    MemoryDamaged "memory_damaged" Service
        "A word of the gate's memory differs from its complement, its settings are not what they were, or the program did not go its proper way."
        "Service: reset the controller; if it comes again, replace it.";
    EvaluationsDisagree "evaluations_disagree" Service
        "The second evaluation, by another formula from the same report, does not confirm the permit of the first."
        "Service: the controller computes wrongly; reset it, and replace it if it comes again.";
    InterlockFault "interlock_fault" Service
        "The interlock's output could not be driven, or the read-back did not follow it in time."
        "Service: check the relay, its contacts and the wiring of the read-back.";
    SelfTestFailed "self_test_failed" Service
        "The self-test did not give the known answers on its built-in table."
        "Service: the controller computes wrongly; flash the firmware again, or replace the controller.";
    CycleLate "cycle_late" Wait
        "The gate was open, and the next control cycle came later than its response time allows."
        "Wait for the next permits. If it comes back: shorten the control cycle, or set response_ms to its longest time.";
    TooManyHypotheses "too_many_hypotheses" Service
        "The report has more than eight hypotheses."
        "Configure the source: report the hypotheses of largest weight, at most eight.";
    OdometryGap "odometry_gap" Wait
        "Increments of the odometry are missing: one came too long after the one before, or the newest is too old."
        "Wait for the next fix. If it comes back: check the odometry's rate and its transport.";
    OdometryJump "odometry_jump" Wait
        "An increment of the odometry is larger than the robot's bounds of movement allow, or turns by more than 45 degrees: a reset, a wrong unit, a wheel that spins, or readings that are too rare."
        "Wait for the next fix. If it comes back: check the units of the odometry and the bounds.";
    OdometryBackwards "odometry_backwards" Wait
        "A stamp of the odometry is not newer than that of the increment before."
        "Wait for the next fix. If it comes back: check the clock of the odometry.";
    OdometryTooShort "odometry_too_short" Wait
        "The fix is older than the increments that are kept, so nobody knows how the robot moved since."
        "Wait for the next fix. If it comes back: keep more increments, or make the fixes come sooner.";
    ElsewhereTooLikely "elsewhere_too_likely" Relocalise
        "The robot may be at none of the report's hypotheses, with a probability that the confidence does not allow."
        "Improve the estimate first; or report more hypotheses, at most eight.";
    TooCostly "too_costly" Relocalise
        "The table's cells were looked up as often as the settings allow, without an answer: the pose-set is wide, or the cells are fine."
        "Relocalise: a smaller pose-set takes fewer look-ups. If it comes back: build the table with facets or coarser cells, or raise most_runs and response_ms.";
    ModelContradicted "model_contradicted" Service
        "The fixes differ from the predictions by more than the errors that the source claims: a camera was knocked, a tag has moved, or the claimed covariance is too small."
        "Service: check camera, tags and calibration, and learn the error model again; then reset the monitor.";
    TableTooNew "table_too_new" Service
        "The table is whole, and its format version is above that which this firmware reads."
        "Service: update the firmware first, or build the table with the version of Posegate that the firmware was built with.";
    PartMissing "part_missing" Service
        "The table needs a part of the gate that this firmware was built without: it has cells, and no facets."
        "Service: build the firmware with the feature `cells`, or the table with `layout = \"facets\"` (`posegate table info` names a table's parts).";
    ClockStopped "clock_stopped" Service
        "The counter of the controller's clock stands still, so no permit would end by its age."
        "Service: start the timer, and check that it runs in every mode of the controller (sleep, debug halt); then reset the gate.";
    TagPosesAmbiguous "tag_poses_ambiguous" Relocalise
        "The corners of the tag fit two poses of the robot, or more, and the task does not succeed from all of them: a small tag, seen head-on, looks the same from both sides of its normal."
        "Relocalise: look at a second tag in the same image, at a larger tag, from nearer, or at the tag from an angle (psi_min_deg).";
    CornersDoNotFit "corners_do_not_fit" Service
        "No pose of the robot fits the detected corners within the noise of the detector: a tag has another size or place than in the site, or the camera another calibration or mount."
        "Service: measure the tag's size (the black border's outer edge) and its place, and compare calibration, image (rect or raw) and mount of the camera with the site.";
    TooFewCorners "too_few_corners" Service
        "A detected tag has fewer than four corners that are finite numbers, so no pose follows from it."
        "Service: make the detector report all four corners of each tag, in pixels.";
}

impl Reason {
    /// Returns the code of the reason on the wire. No reason has the code 0.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Returns the reason with this code, or `None` for a code without a reason.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        let at = usize::from(code).checked_sub(1)?;
        Self::ALL.get(at).copied()
    }

    /// Returns what to do, in a form for programs. `look_at` is the tag by which this task is
    /// localized.
    #[must_use]
    pub const fn advice(self, look_at: Option<u32>) -> Advice {
        match (self.kind_of_advice(), look_at) {
            (Advice::Relocalise, Some(tag)) => Advice::LookAtTag(tag),
            (advice, _) => advice,
        }
    }
}

/// Writes the reason's name: [`Reason::meaning`] and [`Reason::action`] are the sentences.
impl core::fmt::Display for Reason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

impl core::error::Error for Reason {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_names_are_one_to_one() {
        for (index, reason) in Reason::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(reason.code()), index + 1);
            assert_eq!(Reason::from_code(reason.code()), Some(reason));
            assert!(
                reason
                    .name()
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c == '_')
            );
            assert!(reason.meaning().len() > 20 && reason.action().len() > 20);
            assert_eq!(
                Reason::ALL
                    .iter()
                    .filter(|r| r.name() == reason.name())
                    .count(),
                1
            );
        }
        assert_eq!(Reason::from_code(0), None);
        assert_eq!(Reason::from_code(50), None);
    }
}
