//! The Stanford diagram of a recording: position error against protection level, in units of the alert limit.
//!
//! For a pose-set X and a success set S all three are scales of X: factors on its radius, or on both extents of a
//! bounded set. So heading counts like position, and S may have any shape:
//! - the **protection level** is 1: the pose-set that the gate was given;
//! - the **alert limit** is the margin m, a lower bound on the scale s* at which X would leave S;
//! - the **error** is the scale k at which the border of X passes through the true pose.
//!
//! The diagram shows k / m over 1 / m. A permit is a point at 1 / m <= 1, because a permit has a margin of at least 1.
//! A true pose outside of S has k >= s* >= m: every false permit is in the region of hazardously misleading information
//! (HMI). Not every point there is a false permit: X may leave S elsewhere first.

use super::Row;

/// Number of steps of each axis. One more step holds everything beyond the end.
pub const STEPS: usize = 48;
/// The end of both axes, in units of the alert limit.
pub const END: f64 = 2.4;

/// The region of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// Permitted, and the pose-set contains the truth.
    Nominal,
    /// Permitted. The pose-set does not contain the truth, which is still within the alert limit.
    Misleading,
    /// Permitted, but the truth is beyond the alert limit.
    Hazardous,
    /// Denied, and the pose-set contains the truth.
    Unavailable,
    /// Denied, and the pose-set does not contain the truth.
    UnavailableMisleading,
}

impl Region {
    /// All regions.
    pub const ALL: [Self; 5] = [
        Self::Nominal,
        Self::Misleading,
        Self::Hazardous,
        Self::Unavailable,
        Self::UnavailableMisleading,
    ];

    /// Returns the region's name, in snake case.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nominal => "nominal",
            Self::Misleading => "misleading",
            Self::Hazardous => "hazardously_misleading",
            Self::Unavailable => "unavailable",
            Self::UnavailableMisleading => "unavailable_and_misleading",
        }
    }
}

/// Counts of errors and protection levels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Stanford {
    /// Counts by row (protection level) and column (error). Each step excludes its lower end and includes its upper
    /// end.
    cells: Vec<u64>,
    regions: [u64; 5],
    left_out: u64,
}

impl Stanford {
    pub(super) fn note(&mut self, row: &Row) {
        let Some(against) = row.against else {
            return;
        };
        let (Some(scale), Some(margin)) = (against.scale, row.margin()) else {
            self.left_out += 1;
            return;
        };
        let held = scale <= 1.0;
        let region = match (row.verdict.is_permit(), held) {
            (true, true) => Region::Nominal,
            (true, false) if scale <= margin => Region::Misleading,
            (true, false) => Region::Hazardous,
            (false, true) => Region::Unavailable,
            (false, false) => Region::UnavailableMisleading,
        };
        if let Some(count) = self.regions.get_mut(region as usize) {
            *count += 1;
        }
        if self.cells.is_empty() {
            self.cells = vec![0; (STEPS + 1) * (STEPS + 1)];
        }
        let (error, level) = if margin > 0.0 {
            (scale / margin, 1.0 / margin)
        } else {
            (f64::INFINITY, f64::INFINITY)
        };
        if let Some(count) = self
            .cells
            .get_mut(step_of(level) * (STEPS + 1) + step_of(error))
        {
            *count += 1;
        }
    }

    /// Returns the number of points in a region.
    #[must_use]
    pub fn region(&self, region: Region) -> u64 {
        self.regions.get(region as usize).copied().unwrap_or(0)
    }

    /// Returns the number of points.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.regions.iter().sum()
    }

    /// Returns the number of estimates with a known truth but without a pose-set or a margin: impossible, stale, or
    /// in another frame.
    #[must_use]
    pub const fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Returns the non-empty cells: column (error), row (protection level), count. The last step of each axis holds
    /// everything beyond its end.
    pub fn steps(&self) -> impl Iterator<Item = (usize, usize, u64)> {
        let all = self.cells.iter().enumerate();
        all.filter(|(_, count)| **count > 0)
            .map(|(place, count)| (place % (STEPS + 1), place / (STEPS + 1), *count))
    }
}

/// Returns the step of an axis that holds a value. The upper end is included: a margin of exactly 1 is a permit.
fn step_of(value: f64) -> usize {
    let step = libm::ceil(value * (STEPS as f64 / END)) - 1.0;
    (step.max(0.0) as usize).min(STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margin_of_one_is_in_a_permit_region() {
        let limit = libm::round(STEPS as f64 / END) as usize;
        assert_eq!(step_of(1.0), limit - 1);
        assert_eq!(step_of(1.0 + 1e-9), limit);
        assert_eq!((step_of(0.0), step_of(END)), (0, STEPS - 1));
        assert_eq!(step_of(f64::INFINITY), STEPS);
    }
}
