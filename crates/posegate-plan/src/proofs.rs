//! Proofs of the sets that plans rely on. Many plans of one task rely on the same sets, so each is proven once.

use std::collections::BTreeMap;
use std::sync::Mutex;

use super::StepReport;
use super::certificate::is_certain;
use posegate::certify::Prover;
use posegate::contain::Margin;
use posegate::shape::SuccessSet;

/// The statement to prove.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sharpness {
    /// The set lies in the success set.
    Holds,
    /// The same for a set that is enlarged by as much of the table's margin as can be proven.
    Margin,
}

/// Shares of a table's margin for which a proof is tried.
const SHARES: [f64; 4] = [0.98, 0.9, 0.75, 0.0];

/// A task and the numbers of a set, bit by bit.
type Key = (String, Vec<u64>);

/// The proven margins of sets. The key is a task's name, so all plans that share the proofs must be of one site.
#[derive(Debug, Default)]
pub(super) struct Proofs {
    /// The proven margin in units of 2^-16; `None` if the set could not be proven to fit.
    known: Mutex<BTreeMap<Key, Option<u32>>>,
}

impl Proofs {
    /// Proves that the set a step relies on lies inside its success set, scaled by a share of the table's margin, but at
    /// least by `least`. The reported margin is then the proven one.
    pub fn certify(
        &self,
        report: &mut StepReport,
        success: &SuccessSet,
        sharpness: Sharpness,
        least: f64,
    ) -> bool {
        let key = key(report, sharpness);
        let known = self.known.lock().ok();
        let known = known.and_then(|known| known.get(&key).copied());
        let proven = known.unwrap_or_else(|| {
            let proven = proven(report, success, sharpness, least);
            if let Ok(mut known) = self.known.lock() {
                known.insert(key, proven);
            }
            proven
        });
        if let Some(q16) = proven {
            report.margin = Some(Margin::from_q16(q16));
        }
        proven.is_some()
    }
}

fn proven(
    report: &StepReport,
    success: &SuccessSet,
    sharpness: Sharpness,
    least: f64,
) -> Option<u32> {
    let margin = report.margin.map_or(0.0, posegate_replay::factor);
    let prover = Prover::new(success);
    let shares = match sharpness {
        Sharpness::Holds => &SHARES[SHARES.len() - 1..],
        Sharpness::Margin => &SHARES,
    };
    let mut tried = f64::INFINITY;
    for share in shares {
        let scale = (share * margin).clamp(least, 8.0);
        if scale >= tried {
            break;
        }
        if is_certain(&prover, success, &report.before, scale) {
            return Some(libm::floor(scale * 65_536.0) as u32);
        }
        tried = scale;
    }
    None
}

fn key(report: &StepReport, sharpness: Sharpness) -> Key {
    let belief = &report.before;
    let mut numbers: Vec<f64> = [belief.pose.as_slice(), &belief.spread, &belief.certain].concat();
    if let Some(random) = &belief.random {
        numbers.extend(random.covariance.iter());
        numbers.push(random.radius_squared);
    }
    let margin = report.margin.map_or(0, Margin::q16);
    let sharp = u64::from(sharpness == Sharpness::Margin);
    let numbers = numbers.into_iter().map(f64::to_bits);
    let all = numbers.chain([u64::from(margin), sharp]);
    (report.task.clone().unwrap_or_default(), all.collect())
}
