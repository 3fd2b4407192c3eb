//! Results: a JSON line on stdout for each figure, `{"name", "value", "unit", "goal"[, "most"]}`. Collects the names of those
//! that are beyond their goal, for the error at the end of a job.

use crate::shell::Result;
use serde_json::Value;
use std::fmt::{Display, Write};

/// The figures of a job.
#[derive(Default)]
pub struct Report {
    beyond: Vec<String>,
}

impl Report {
    /// Prints a figure without a goal.
    pub fn note(&self, name: &str, value: impl Display, unit: &str) {
        println!("{}", line(name, &value, unit, &"null", ""));
    }

    /// Prints a figure that may be at most `goal`.
    pub fn at_most<N: Display + PartialOrd>(&mut self, name: &str, value: N, unit: &str, goal: N) {
        println!("{}", line(name, &value, unit, &goal, ""));
        self.require(value <= goal, name);
    }

    /// Prints a figure that must be at least `goal`.
    pub fn at_least<N: Display + PartialOrd>(&mut self, name: &str, value: N, unit: &str, goal: N) {
        println!("{}", line(name, &value, unit, &goal, ""));
        self.require(value >= goal, name);
    }

    /// Prints a figure that must be less than `most`; the goal is what it should reach.
    pub fn less_than<N: Display + PartialOrd>(
        &mut self,
        name: &str,
        value: N,
        unit: &str,
        goal: N,
        most: N,
    ) {
        println!(
            "{}",
            line(name, &value, unit, &goal, &format!(", \"most\": {most}"))
        );
        self.require(value < most, name);
    }

    /// Prints a text that must be `goal`.
    pub fn same_text(&mut self, name: &str, value: &str, unit: &str, goal: &str) {
        let [text, expected] = [value, goal].map(Value::from);
        println!("{}", line(name, &text, unit, &expected, ""));
        self.require(value == goal, name);
    }

    /// Notes what is beyond a goal, unless the condition holds.
    pub fn require(&mut self, holds: bool, what: impl Display) {
        if !holds {
            self.beyond.push(what.to_string());
        }
    }

    /// Ends the job.
    ///
    /// # Errors
    /// If something is beyond a goal: its names.
    pub fn finish(self) -> Result {
        if self.beyond.is_empty() {
            return Ok(());
        }
        Err(format!("beyond a goal: {}", self.beyond.join("; ")).into())
    }
}

/// Prints a figure with additional members between its name and its value.
pub fn print_with(
    name: &str,
    members: &[(&str, u64)],
    value: impl Display,
    unit: &str,
    goal: impl Display,
) {
    let mut line = format!("{{\"name\": {}", Value::from(name));
    for (key, number) in members {
        let _ = write!(line, ", {}: {number}", Value::from(*key));
    }
    println!(
        "{line}, \"value\": {value}, \"unit\": {}, \"goal\": {goal}}}",
        Value::from(unit)
    );
}

fn line(name: &str, value: &dyn Display, unit: &str, goal: &dyn Display, more: &str) -> String {
    let [name, unit] = [name, unit].map(Value::from);
    format!("{{\"name\": {name}, \"value\": {value}, \"unit\": {unit}, \"goal\": {goal}{more}}}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_is_json_and_keeps_its_form() {
        assert_eq!(
            line("a \"b\"", &3, "B", &"null", ""),
            r#"{"name": "a \"b\"", "value": 3, "unit": "B", "goal": null}"#
        );
        let more = line("demo", &7, "ms", &5000, ", \"most\": 20000");
        let value: Value = serde_json::from_str(&more).unwrap();
        assert_eq!(
            (&value["goal"], &value["most"]),
            (&5000.into(), &20_000.into())
        );
    }

    #[test]
    fn report_fails_if_a_figure_is_beyond_its_goal() {
        let mut report = Report::default();
        report.at_most("bytes", 4, "B", 4);
        report.at_least("tests", 50, "tests", 50);
        report.less_than("demo", 19_999, "ms", 5_000, 20_000);
        report.note("cores", 2, "cores");
        assert!(report.finish().is_ok());
        let mut report = Report::default();
        report.at_most("bytes", 5, "B", 4);
        report.at_least("share", f64::NAN, "", 0.5);
        report.same_text("address", "0", "address", "08040000");
        let error = report.finish().unwrap_err().to_string();
        assert_eq!(error, "beyond a goal: bytes; share; address");
    }
}
