//! Counts of the results of a campaign.

use crate::fault::{Fault, Kind};
use crate::trial::{Class, End, Trial};
use posegate::gate::Reason;
use std::collections::BTreeMap;

#[derive(Default)]
pub struct Tally {
    counts: BTreeMap<(&'static str, &'static str), u64>,
    reasons: BTreeMap<&'static str, u64>,
}

impl Tally {
    pub fn add(&mut self, kind: Kind, index: u64, fault: &Fault, trial: Trial) {
        *self
            .counts
            .entry((kind.name(), trial.class.name()))
            .or_default() += 1;
        let bad = matches!(
            trial.class,
            Class::WrongPermit | Class::EndedHighWithoutHeartbeat
        );
        if bad || std::env::var_os("POSEGATE_TELL_FAULTS").is_some() {
            eprintln!(
                "{}: fault {index}, cycle {}: {} ({:?}, first seen in cycle {:?}, reason {:?})",
                trial.class.name(),
                fault.cycle(),
                trial.fault_place,
                trial.end,
                trial.wrong_in,
                trial.reason
            );
        }
        let closed = matches!(trial.class, Class::MoreClosed) && trial.end == End::Over;
        if closed && let Some(reason) = trial.reason {
            let reason = u8::try_from(reason).ok().and_then(Reason::from_code);
            let name = reason.map_or("another number", Reason::name);
            *self.reasons.entry(name).or_default() += 1;
        }
    }

    fn count(&self, kind: Option<Kind>, class: Option<Class>) -> u64 {
        self.counts
            .iter()
            .filter(|((of, what), _)| {
                kind.is_none_or(|kind| kind.name() == *of)
                    && class.is_none_or(|class| class.name() == *what)
            })
            .map(|(_, count)| count)
            .sum()
    }

    /// Returns the share of wrong permits in percent.
    pub fn wrong_percent(&self, kind: Option<Kind>) -> f64 {
        let wrong = self.count(kind, Some(Class::WrongPermit));
        100.0 * wrong as f64 / self.count(kind, None).max(1) as f64
    }

    /// Prints one JSON line per figure.
    pub fn print(&self, which: &str, goal: Option<f64>) {
        let line = |name: &str, value: String, unit: &str, goal: Option<f64>| {
            let goal = goal.map_or("null".into(), |goal| format!("{goal}"));
            println!(
                "{{\"name\": \"{which}{name}\", \"value\": {value}, \"unit\": \"{unit}\", \"goal\": {goal}}}"
            );
        };
        for kind in Kind::ALL.map(Some).into_iter().chain([None]) {
            let name = kind.map_or("all", Kind::name);
            let injected = self.count(kind, None).to_string();
            line(
                &format!("faults, {name}: injected"),
                injected,
                "faults",
                None,
            );
            for class in Class::ALL {
                let count = self.count(kind, Some(class)).to_string();
                let text = format!("faults, {name}: {}", class.name());
                line(&text, count, "faults", None);
            }
            let open = self.count(kind, Some(Class::EndedHighWithoutHeartbeat));
            let wrong = self.count(kind, Some(Class::WrongPermit));
            let percent = 100.0 * (open + wrong) as f64 / self.count(kind, None).max(1) as f64;
            line(
                &format!("faults, {name}: wrong permits where no watchdog heeds the heartbeat"),
                format!("{percent:.3}"),
                "%",
                None,
            );
            let percent = format!("{:.3}", self.wrong_percent(kind));
            line(
                &format!("faults, {name}: wrong permits"),
                percent,
                "%",
                goal,
            );
        }
        for (reason, count) in &self.reasons {
            let text = format!("faults closed with {reason}");
            line(&text, count.to_string(), "faults", None);
        }
    }
}
