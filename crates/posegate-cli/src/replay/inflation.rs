//! The factors of the covariances: one, or those of a learnt model.

use super::Arguments;
use super::parameter;
use crate::learn::{refused, young_age_warning};
use crate::site_input::{Failure, warn};
use posegate::confidence::radius_squared;
use posegate::gate::InvalidParameter;
use posegate::set::{Aging, Inflation, RadiusSquared};
use posegate_files::files::Files;
use posegate_learn::{ByAge, InflationModel, by_age_json};
use posegate_replay::recording::Text;
use serde_json::{Value, json};
use std::io::Read;

/// The factors, and the column of the time since the last fix.
pub struct Inflated {
    pub factors: ByAge,
    column: Option<String>,
}

impl Inflated {
    pub fn of(
        arguments: &Arguments,
        files: &Files,
        radius: RadiusSquared,
    ) -> Result<Self, Failure> {
        let Some(path) = &arguments.inflation_model else {
            let inflation = Inflation::new(arguments.inflation);
            let inflation = inflation.ok_or_else(|| parameter(InvalidParameter::Inflation))?;
            return Ok(Self {
                factors: ByAge {
                    inflation,
                    aging: Aging::NONE,
                },
                column: None,
            });
        };
        if arguments.set.bounded().is_some() {
            return Err(Failure::usage(
                "--inflation-model is learnt for covariances, not for --set bounded".into(),
                "leave one of them out",
            ));
        }
        let (text, name) = files.read_text(path)?;
        let model = InflationModel::parse(&text, &name).map_err(refused)?;
        let learnt = radius_squared(model.epsilon()).unwrap_or(f64::NAN);
        let used = f64::from(radius.q16()) / 65536.0;
        // The table's radius is rounded to 2^-16.
        if !((learnt - used).abs() <= 1e-4) {
            return Err(Failure::usage(
                format!(
                    "{name} was learnt at epsilon {}, which is not the confidence of the table",
                    model.epsilon()
                ),
                "learn it with --epsilon of the site, or replay with --epsilon of the model",
            ));
        }
        let factors = model.by_age().ok_or_else(|| {
            Failure::usage(
                format!("{name} has no factor for some of its conditions"),
                "learn it from more rows, or with a smaller --epsilon or --confidence",
            )
        })?;
        if let Some(late) = young_age_warning(&model) {
            warn(&format_args!("{name}: {late}"));
        }
        let column = (factors.aging != Aging::NONE).then(|| model.condition().to_owned());
        Ok(Self { factors, column })
    }

    /// Lets a CSV read the time since the last fix. Warns if it has no column for it: the largest factor is then used.
    pub fn reads<R: Read>(&self, text: &mut Text<R>, file: &str) {
        if let Some(column) = &self.column
            && !text.reads_since_fix(column)
        {
            warn(&format_args!(
                "{file}: no column `{column}`: the largest factor of the model is used for every estimate"
            ));
        }
    }

    /// Returns the factors for the summary.
    pub fn to_json(&self) -> Value {
        json!({"largest": f64::from(self.factors.inflation.q16()) / 65536.0, "by_age": by_age_json(&self.factors)})
    }
}
