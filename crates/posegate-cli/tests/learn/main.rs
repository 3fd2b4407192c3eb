//! Learnt models hold on rows that they were not learnt from. Bounds hold for their share of the detections, overall and
//! in every accepted region. Inflated sets hold for their share of the estimates. They are not looser than necessary.

mod assumptions;
mod bounds;
mod by_age;
mod command;
mod dependence;
mod distribution;
mod drift;
mod fleets;
mod flips;
mod inflation;
mod provenance;
mod recorded;
mod site;
mod survey;

use posegate_learn::{Detections, ErrorModel, acceptance};

/// A count of hits in a number of trials.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    trials: u64,
    hits: u64,
}

impl Share {
    fn count(&mut self, hit: bool) {
        self.trials += 1;
        self.hits += u64::from(hit);
    }

    fn value(self) -> f64 {
        self.hits as f64 / self.trials.max(1) as f64
    }

    /// Returns `true` if a share of at least `q` is plausible: the hits are not below the binomial 99 % interval.
    fn holds(self, q: f64) -> bool {
        self.hits >= acceptance(self.trials, q, 0.99)[0]
    }
}

/// Returns for each region of a model the shares of later errors within its bounds: translation and yaw.
fn in_regions(model: &ErrorModel, later: &Detections) -> Vec<[Share; 2]> {
    let mut shares = vec![[Share::default(); 2]; model.regions().count()];
    for row in &later.rows {
        let (Some(errors), Some(bounds), Some(region)) = (
            row.errors,
            model.bounds_deg(row.at),
            model.region_deg(row.at),
        ) else {
            continue;
        };
        shares[region][0].count(errors[0] <= bounds.0);
        shares[region][1].count(errors[1] <= bounds.1);
    }
    shares
}
