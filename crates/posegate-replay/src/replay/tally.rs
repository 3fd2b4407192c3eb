//! Counts permits and denials, and compares them with the truth if it is known.

use super::interlock::InterlockTimes;
use super::{Row, Thresholds};
use posegate::gate::Reason;

/// Counts of the permits of one rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// All estimates that the rule can judge.
    pub estimates: u64,
    /// Estimates that the rule permits.
    pub permits: u64,
    /// Estimates with a known true pose.
    pub with_truth: u64,
    /// Estimates whose known true pose is in the success set.
    pub inside: u64,
    /// Permits although the true pose is outside.
    pub false_permits: u64,
    /// Denials although the true pose is inside.
    pub false_denials: u64,
}

impl Tally {
    fn note(&mut self, permit: bool, inside: Option<bool>) {
        self.estimates += 1;
        self.permits += u64::from(permit);
        if let Some(inside) = inside {
            self.with_truth += 1;
            self.inside += u64::from(inside);
            self.false_permits += u64::from(permit && !inside);
            self.false_denials += u64::from(!permit && inside);
        }
    }

    /// Returns the share of permitted estimates; NaN if there are no estimates.
    #[must_use]
    pub fn availability(&self) -> f64 {
        self.permits as f64 / self.estimates as f64
    }

    /// Returns the tally of a rule that permits all estimates or no estimate.
    const fn of_all(self, permits: bool) -> Self {
        let outside = self.with_truth - self.inside;
        Self {
            permits: if permits { self.estimates } else { 0 },
            false_permits: if permits { outside } else { 0 },
            false_denials: if permits { 0 } else { self.inside },
            ..self
        }
    }
}

/// Minimum, sum and maximum of some numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    pub count: u64,
    pub least: f64,
    pub sum: f64,
    pub most: f64,
}

impl Default for Range {
    fn default() -> Self {
        Self {
            count: 0,
            least: f64::INFINITY,
            sum: 0.0,
            most: f64::NEG_INFINITY,
        }
    }
}

impl Range {
    fn note(&mut self, value: f64) {
        if value.is_finite() {
            self.count += 1;
            self.least = self.least.min(value);
            self.sum += value;
            self.most = self.most.max(value);
        }
    }

    /// Returns minimum, mean and maximum.
    pub fn least_mean_most(&self) -> Option<[f64; 3]> {
        (self.count > 0).then(|| [self.least, self.sum / self.count as f64, self.most])
    }
}

/// All counts of a replay.
#[derive(Clone, Debug)]
pub(super) struct Counts {
    pub verdicts: Tally,
    pub permissions: Tally,
    pub rules: [Tally; 3],
    pub interlock: InterlockTimes,
    pub verdict_reasons: [u64; 64],
    pub gate_reasons: [u64; 64],
    pub ages: Range,
    pub permit_margins: Range,
    pub denial_margins: Range,
    /// Number of true poses inside the pose-set, and of all with a pose-set.
    pub held: [u64; 2],
    pub nees: Range,
    pub errors_m: Range,
    pub errors_yaw: Range,
    /// Rows whose true pose is not finite.
    pub truth_not_finite: u64,
    /// Rows whose true pose was dropped too early.
    pub truth_lost: u64,
    /// Rows with a truth that are in another frame than the truth.
    pub truth_other_frame: u64,
    squares: [f64; 2],
}

impl Default for Counts {
    fn default() -> Self {
        Self {
            verdicts: Tally::default(),
            permissions: Tally::default(),
            rules: [Tally::default(); 3],
            interlock: InterlockTimes::default(),
            verdict_reasons: [0; 64],
            gate_reasons: [0; 64],
            ages: Range::default(),
            permit_margins: Range::default(),
            denial_margins: Range::default(),
            held: [0; 2],
            nees: Range::default(),
            errors_m: Range::default(),
            errors_yaw: Range::default(),
            truth_not_finite: 0,
            truth_lost: 0,
            truth_other_frame: 0,
            squares: [0.0; 2],
        }
    }
}

impl Counts {
    pub fn note(&mut self, row: &Row) {
        let inside = row.against.map(|against| against.inside);
        let permit = row.verdict.is_permit();
        self.verdicts.note(permit, inside);
        self.permissions.note(row.permitted, inside);
        for (tally, permits) in self.rules.iter_mut().zip(row.rules) {
            if let Some(permits) = permits {
                tally.note(permits, inside);
            }
        }
        for (counts, reason) in [
            (&mut self.verdict_reasons, row.reason()),
            (&mut self.gate_reasons, row.step.err()),
        ] {
            if let Some(count) = reason.and_then(|r| counts.get_mut(usize::from(r.code()))) {
                *count += 1;
            }
        }
        if let Some(age) = row.age_s() {
            self.ages.note(age);
        }
        if let Some(margin) = row.margin() {
            let margins = if permit {
                &mut self.permit_margins
            } else {
                &mut self.denial_margins
            };
            margins.note(margin);
        }
        if let Some(against) = &row.against {
            if let Some(held) = against.held {
                self.held[0] += u64::from(held);
                self.held[1] += 1;
            }
            if let Some(nees) = against.nees {
                self.nees.note(nees);
            }
            if against.error_m.is_finite() && against.error_yaw_rad.is_finite() {
                self.errors_m.note(against.error_m);
                self.errors_yaw.note(against.error_yaw_rad);
                self.squares[0] += against.error_m * against.error_m;
                self.squares[1] += against.error_yaw_rad * against.error_yaw_rad;
            }
        }
    }

    /// Returns the root mean square errors, metres and radians, of the recording without alignment.
    pub fn rmse(&self) -> Option<[f64; 2]> {
        let count = self.errors_m.count;
        (count > 0).then(|| self.squares.map(|sum| libm::sqrt(sum / count as f64)))
    }

    pub fn tallies(&self) -> [(&'static str, Tally); 6] {
        let [distance, sigma, ellipse] = self.rules;
        // Without a truth the rule cannot judge.
        let ate = self.rmse().map_or(Tally::default(), |[rmse, _]| {
            self.verdicts.of_all(rmse < Thresholds::IN_USE.ate_m)
        });
        [
            ("gate", self.verdicts),
            ("interlock", self.permissions),
            (super::RULES[0], distance),
            (super::RULES[1], sigma),
            (super::RULES[2], ellipse),
            ("ate", ate),
        ]
    }

    pub fn reasons(&self) -> Vec<(Reason, u64)> {
        named(&self.verdict_reasons)
    }
}

/// Returns the reasons that were given, with their counts.
pub(super) fn named(counts: &[u64; 64]) -> Vec<(Reason, u64)> {
    let all = Reason::ALL.into_iter();
    let counted = all.map(|reason| {
        let count = counts.get(usize::from(reason.code()));
        (reason, count.copied().unwrap_or(0))
    });
    counted.filter(|(_, count)| *count > 0).collect()
}
