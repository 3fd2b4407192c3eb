//! A learnt model for the controller: one factor, and smaller ones by the time since the last fix.

use super::InflationModel;
use posegate::set::{Aging, Inflation, MOST_AGES};

/// The unit of an age on the controller, milliseconds.
const UNIT_MS: f64 = 64.0;
/// The largest factor of a step in its units of 2^-6.
const LARGEST: u32 = 65_535;

/// The settings of a controller's source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByAge {
    /// The source's own inflation: the largest factor of all.
    pub inflation: Inflation,
    /// Smaller factors by the time since the last fix.
    pub aging: Aging,
}

impl ByAge {
    /// Returns the steps: the largest time since the last fix in milliseconds, and the factor up to it.
    pub fn steps(&self) -> impl Iterator<Item = (u32, f64)> {
        let used = self.aging.words().into_iter().filter(|word| *word != 0);
        used.map(|word| ((word & 0xffff) * 64, f64::from(word >> 16) / 64.0))
    }
}

/// Returns the steps as JSON: the settings of a source.
#[must_use]
pub fn by_age_json(by_age: &ByAge) -> serde_json::Value {
    let steps = by_age.steps().map(|(until_ms, inflation)| {
        serde_json::json!({
            "until_ms": until_ms, "inflation": inflation, "inflation_q16": (inflation * 65_536.0) as u32,
        })
    });
    steps.collect()
}

impl InflationModel {
    /// Returns `true` if the conditions are times since the last fix: a column `since_..._s`.
    fn is_by_age(&self) -> bool {
        self.condition().starts_with("since_") && self.condition().ends_with("_s")
    }

    /// Returns the time since the last fix at which the data begin, seconds, if that is too late for steps: above 64
    /// ms. A step has no lower end, so its factor would apply to younger estimates too, which are not in the data.
    /// `None` if the conditions are not times since the last fix, or if there is only one.
    #[must_use]
    pub fn begins_late(&self) -> Option<f64> {
        let youngest = self.parts().first()?.from;
        let is_late = self.is_by_age() && self.parts().len() > 1 && youngest * 1000.0 > UNIT_MS;
        is_late.then_some(youngest)
    }

    /// Returns the factors for a controller. Each is at least that of [`InflationModel::inflation`] at every time
    /// since the last fix in the data, and the factors do not decrease with the time. There are no steps if the
    /// conditions are not times since the last fix (a column `since_..._s`), or if the data begin later than 64 ms
    /// after a fix ([`InflationModel::begins_late`]). The controller does not distinguish ages below the data, which
    /// are at most one of its units. A factor above 1023.98 gets no step. If there are more conditions than steps,
    /// the condition whose factor is nearest to the next one is removed. `None` if a condition has no factor.
    #[must_use]
    pub fn by_age(&self) -> Option<ByAge> {
        let largest = self.inflation(None)?;
        let inflation = Inflation::new(largest)?;
        let mut steps: Vec<(u32, Inflation)> = Vec::new();
        if self.is_by_age() && self.begins_late().is_none() {
            let mut most = 1.0f64;
            for part in self.parts() {
                most = most.max(part.inflation);
                // At a border the next condition's factor also applies, so the step ends before it.
                let units = libm::ceil(part.to * 1000.0 / UNIT_MS) - 1.0;
                let factor = Inflation::new(most)?;
                // Rounded up to 2^-6, the factor must fit a step and still be less than the source's own.
                let rounded = factor.q16().div_ceil(1 << 10);
                let is_smaller = rounded <= LARGEST && rounded << 10 < inflation.q16();
                if !((1.0..65_536.0).contains(&units) && is_smaller) {
                    continue;
                }
                let until_ms = units as u32 * 64;
                match steps.last_mut() {
                    Some(last) if last.1 == factor => last.0 = until_ms.max(last.0),
                    Some(last) if last.0 >= until_ms => {}
                    _ => steps.push((until_ms, factor)),
                }
            }
            while steps.len() > MOST_AGES {
                let ratio = |k: usize| {
                    let next = steps.get(k + 1).map_or(inflation, |step| step.1);
                    f64::from(next.q16()) / f64::from(steps[k].1.q16())
                };
                let nearest = (0..steps.len()).min_by(|a, b| ratio(*a).total_cmp(&ratio(*b)))?;
                steps.remove(nearest);
            }
        }
        let aging = Aging::new(&steps)?;
        Some(ByAge { inflation, aging })
    }
}

#[cfg(test)]
mod tests;
