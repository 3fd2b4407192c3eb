//! Simulated drives until the interlock was open often enough, and what a judge found at the moments at which it was.

use crate::oracle::Rng;
use rayon::prelude::*;

/// Counts of openings and of moments with an open interlock.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Times at which the interlock opened.
    pub openings: u64,
    /// Moments at which it was open.
    pub moments: u64,
    /// Moments with a possible pose outside of the success set.
    pub outside: u64,
    /// Fixes that arrived late.
    pub late: u64,
    /// Fixes that arrived before the odometry of their time.
    pub early: u64,
    /// Moments with less than a centimetre of slack.
    pub near: u64,
    /// The least slack, micrometres.
    pub least_um: i64,
}

impl Found {
    const NONE: Self = Self {
        openings: 0,
        moments: 0,
        outside: 0,
        late: 0,
        early: 0,
        near: 0,
        least_um: i64::MAX,
    };

    fn plus(self, other: Self) -> Self {
        Self {
            openings: self.openings + other.openings,
            moments: self.moments + other.moments,
            outside: self.outside + other.outside,
            late: self.late + other.late,
            early: self.early + other.early,
            near: self.near + other.near,
            least_um: self.least_um.min(other.least_um),
        }
    }

    /// Counts a moment at which the interlock is open and a possible pose is this far beyond the border of the set, metres (inside:
    /// below zero). Returns `true` for the first that is outside.
    pub fn note(&mut self, beyond: f64) -> bool {
        self.moments += 1;
        self.near += u64::from(beyond > -0.01);
        self.least_um = self.least_um.min((-beyond * 1e6) as i64);
        self.outside += u64::from(beyond > 1e-9);
        beyond > 1e-9 && self.outside == 1
    }
}

/// Repeats a drive until the interlock has opened this often, on all processor cores; the same for a seed.
pub fn driven(openings: u64, seed: u64, drive: impl Fn(&mut Rng, &mut Found) + Sync) -> Found {
    let streams = Rng::streams(seed);
    let each = openings.div_ceil(streams.len() as u64);
    let found = streams
        .into_par_iter()
        .map(|mut rng| {
            let mut found = Found::NONE;
            while found.openings < each {
                drive(&mut rng, &mut found);
            }
            found
        })
        .reduce(|| Found::NONE, Found::plus);
    println!("{found:?}");
    found
}
