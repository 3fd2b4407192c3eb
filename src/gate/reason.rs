//! Why a gate denies: one list for firmware, command line and documents.

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
    /// The gate has no valid table.
    TableInvalid = 13,
}

impl Reason {
    /// Every reason, in the order of the codes.
    pub const ALL: [Self; 13] = [
        Self::NotContained,
        Self::PoseSetTooLarge,
        Self::OutsideTable,
        Self::EstimateNotFinite,
        Self::EstimateOutOfRange,
        Self::CovarianceNotFinite,
        Self::CovarianceZero,
        Self::CovarianceNotSymmetric,
        Self::CovarianceNotPositiveDefinite,
        Self::CovarianceTooLarge,
        Self::BoundInvalid,
        Self::Stale,
        Self::TableInvalid,
    ];

    /// The number of the reason on the wire; 0 is no reason.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The reason of a number.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.code() == code)
    }

    /// The name in `snake_case`, the same everywhere.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotContained => "not_contained",
            Self::PoseSetTooLarge => "pose_set_too_large",
            Self::OutsideTable => "outside_table",
            Self::EstimateNotFinite => "estimate_not_finite",
            Self::EstimateOutOfRange => "estimate_out_of_range",
            Self::CovarianceNotFinite => "covariance_not_finite",
            Self::CovarianceZero => "covariance_zero",
            Self::CovarianceNotSymmetric => "covariance_not_symmetric",
            Self::CovarianceNotPositiveDefinite => "covariance_not_positive_definite",
            Self::CovarianceTooLarge => "covariance_too_large",
            Self::BoundInvalid => "bound_invalid",
            Self::Stale => "stale",
            Self::TableInvalid => "table_invalid",
        }
    }

    /// What happened, in a sentence.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::NotContained => {
                "Some pose where the robot may be is not inside the success set as the table holds it."
            }
            Self::PoseSetTooLarge => {
                "The pose-set is wider than the whole table on some axis: no place of the robot could make it fit."
            }
            Self::OutsideTable => {
                "The estimate itself lies outside of the table's extent: the robot is not near the task's goal."
            }
            Self::EstimateNotFinite => "A coordinate of the estimate is NaN or infinite.",
            Self::EstimateOutOfRange => {
                "The estimate is more than 2000 m from the origin, or its yaw has been wound up beyond 16384 rad."
            }
            Self::CovarianceNotFinite => "An entry of the covariance is NaN or infinite.",
            Self::CovarianceZero => {
                "Every entry of the covariance is zero: the source never filled it."
            }
            Self::CovarianceNotSymmetric => {
                "The covariance differs from its transpose by more than rounding."
            }
            Self::CovarianceNotPositiveDefinite => {
                "The covariance is not positive definite: a variance is zero or negative, or a correlation is 1 or beyond."
            }
            Self::CovarianceTooLarge => {
                "The pose-set that the covariance describes is more than 268 m or 32 turns wide."
            }
            Self::BoundInvalid => {
                "An extent of the bounded pose-set is zero, negative, not a number, or 268 m or more."
            }
            Self::Stale => {
                "The estimate is older than the maximum age, or its stamp lies in the future."
            }
            Self::TableInvalid => {
                "The gate has no table: its bytes are damaged, cut short, or of another format version."
            }
        }
    }

    /// What to do about it.
    #[must_use]
    pub const fn action(self) -> &'static str {
        match self {
            Self::NotContained => {
                "Relocalise: look at a tag from where it is seen well, then ask again. The worst pose says on which side the set leaves."
            }
            Self::PoseSetTooLarge => {
                "Relocalise: the filter is far too unsure for this task; a localization task must come first."
            }
            Self::OutsideTable => {
                "Restage: drive to the task's goal first. If the robot is there, the map frame or the table is wrong."
            }
            Self::EstimateNotFinite | Self::EstimateOutOfRange => {
                "Service: the filter has diverged or the message is wired wrongly; restart the filter and check the frame."
            }
            Self::CovarianceNotFinite
            | Self::CovarianceNotSymmetric
            | Self::CovarianceNotPositiveDefinite => {
                "Service: check how the covariance is filled and indexed (x, y, yaw; m, rad); restart the filter."
            }
            Self::CovarianceZero => {
                "Service: make the source fill its covariance; a detector that leaves it zero needs a bounded set from its error bound."
            }
            Self::CovarianceTooLarge => "Relocalise: the filter does not know where the robot is.",
            Self::BoundInvalid => {
                "Service: give the error bound of the localization task (translation and yaw, both above zero)."
            }
            Self::Stale => {
                "Wait for a fresh estimate. If it stays stale, service: the link, or the clocks of robot and controller disagree."
            }
            Self::TableInvalid => {
                "Service: flash a table that was made by this tool version for this task, and verify it."
            }
        }
    }
}

impl core::fmt::Display for Reason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

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
        assert_eq!(Reason::from_code(14), None);
    }
}
