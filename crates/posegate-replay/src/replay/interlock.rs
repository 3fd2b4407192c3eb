//! The time for which the interlock was open, the reasons why it was shut, and the setting that kept it shut.

use super::{Lanes, Row};
use posegate::gate::{Reason, Settings, State};
use std::collections::{BTreeMap, VecDeque};

/// The times for which the interlock was open and shut.
#[derive(Clone, Debug, PartialEq)]
pub struct InterlockTimes {
    /// From the first to the last estimate, seconds.
    pub recorded_s: f64,
    /// Time for which the interlock was open, seconds.
    pub open_s: f64,
    /// Number of times that the interlock opened.
    pub openings: u64,
    /// Time for which it was shut, by the code of the reason.
    shut_s: [f64; 64],
    /// The intervals in which the interlock was open, or was shut for one reason.
    pub lanes: Lanes,
    /// The last step.
    last: Option<Last>,
    nearest: Nearest,
}

/// A step of the gate, until the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Last {
    at_s: f64,
    /// The time until which the state remains valid without a further step.
    until_s: f64,
    is_open: bool,
    /// The reasons why the interlock is shut until then, and after it.
    reasons: [Reason; 2],
}

impl Default for InterlockTimes {
    fn default() -> Self {
        Self {
            recorded_s: 0.0,
            open_s: 0.0,
            openings: 0,
            shut_s: [0.0; 64],
            lanes: Lanes::default(),
            last: None,
            nearest: Nearest::default(),
        }
    }
}

impl InterlockTimes {
    /// Adds the step of an estimate.
    pub(super) fn step(&mut self, row: &Row, now_s: f64, settings: &Settings<'_>) {
        if now_s.is_finite() {
            self.nearest.step(row, now_s, settings);
            self.pass(now_s, row.state, row.age_s().unwrap_or(0.0), settings);
        }
    }

    /// Adds a state of the gate, caused by an estimate of an age in seconds. The state ends without a further step if
    /// the estimate gets too old or no permit follows.
    pub(super) fn pass(&mut self, now_s: f64, state: State, age_s: f64, settings: &Settings<'_>) {
        let mut has_ended = false;
        if let Some(last) = self.last {
            has_ended = last.until_s < now_s;
            if now_s > last.at_s {
                self.recorded_s += now_s - last.at_s;
                let valid_s = (last.until_s.min(now_s) - last.at_s).max(0.0);
                let after = now_s - last.at_s - valid_s;
                if last.is_open {
                    self.open_s += valid_s;
                } else {
                    self.shut(last.reasons[0], valid_s);
                }
                self.shut(last.reasons[1], after);
                let until_s = last.at_s + valid_s;
                let first = (!last.is_open).then_some(last.reasons[0]);
                self.lanes.add(last.at_s, until_s, first);
                self.lanes.add(until_s, now_s, Some(last.reasons[1]));
            }
        }
        let was_open = self.last.is_some_and(|last| last.is_open);
        let is_open = state == State::Permitted;
        self.openings += u64::from(is_open && (!was_open || has_ended));
        self.last = Some(Last::of(now_s, state, age_s, settings));
    }

    fn shut(&mut self, reason: Reason, seconds: f64) {
        if let Some(sum) = self.shut_s.get_mut(usize::from(reason.code())) {
            *sum += seconds;
        }
    }

    /// Returns the seconds for which the interlock was shut, by reason; reasons without any time are omitted.
    #[must_use]
    pub fn shut_s_by(&self) -> Vec<(Reason, f64)> {
        let all = Reason::ALL.into_iter().map(|reason| {
            let seconds = self.shut_s.get(usize::from(reason.code()));
            (reason, seconds.copied().unwrap_or(0.0))
        });
        all.filter(|(_, seconds)| *seconds > 0.0).collect()
    }

    /// Returns the reason, as text, why the interlock never opened, and the setting that decides. `None` if it
    /// opened.
    #[must_use]
    pub fn why_shut(&self, settings: &Settings<'_>) -> Option<WhyShut> {
        (self.openings == 0).then(|| self.nearest.why(settings))
    }
}

impl Last {
    fn of(now_s: f64, state: State, age: f64, settings: &Settings<'_>) -> Self {
        let seconds = |ms: u32| f64::from(ms) * 1e-3;
        let oldest = settings.maximum_age_ms.saturating_sub(settings.response_ms);
        let (hold, fresh) = (seconds(settings.permit_hold_ms), seconds(oldest) - age);
        let ends = if fresh < hold {
            Reason::Stale
        } else {
            Reason::Silent
        };
        let (valid_s, reasons) = match state {
            State::Permitted => (hold.min(fresh), [ends; 2]),
            State::Qualifying(_) => (hold.min(fresh), [Reason::Qualifying, ends]),
            State::Inhibited(reason) | State::Latched(reason) => (0.0, [reason; 2]),
            _ => (0.0, [Reason::Silent; 2]),
        };
        Self {
            at_s: now_s,
            until_s: now_s + valid_s.max(0.0),
            is_open: state == State::Permitted,
            reasons,
        }
    }
}

/// The setting that keeps an interlock shut.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WhyShut {
    /// The reason as text.
    pub words: String,
    /// The setting's name, its value, and the least value with which the interlock would have opened. `None` if no
    /// single setting decides.
    pub setting: Option<(&'static str, u32, u32)>,
}

/// The best run of estimates that are permitted by themselves: the nearest approach to an opening.
#[derive(Clone, Debug, Default, PartialEq)]
struct Nearest {
    estimates: u64,
    /// Estimates that are permitted by themselves.
    permits: u64,
    /// Estimates that are denied only because of their age, and the smallest age of these, seconds.
    stale: u64,
    youngest_s: Option<f64>,
    /// The current run: its start, and the gaps before its last estimates, seconds.
    from_s: f64,
    gaps: VecDeque<f64>,
    /// The most estimates of a run.
    longest_run: u64,
    run: u64,
    last_s: f64,
    /// The smallest longest gap of the required number of permits, and the same with the required time since the run
    /// began.
    hold_s: Option<f64>,
    /// The shortest time in which a run of the required number of permits came.
    lasted_s: f64,
    /// Reasons of denials by themselves, with their counts.
    reasons: BTreeMap<Reason, u64>,
}

impl Nearest {
    fn step(&mut self, row: &Row, now_s: f64, settings: &Settings<'_>) {
        self.estimates += 1;
        if let Some(reason) = row.reason() {
            self.run = 0;
            self.gaps.clear();
            *self.reasons.entry(reason).or_default() += 1;
            if reason == Reason::Stale {
                self.stale += 1;
                let age = row.age_s().filter(|age| *age >= 0.0);
                let youngest = self.youngest_s.into_iter().chain(age).reduce(f64::min);
                self.youngest_s = youngest;
            }
            return;
        }
        self.permits += 1;
        if self.run == 0 {
            self.from_s = now_s;
        } else {
            self.gaps.push_back(now_s - self.last_s);
        }
        self.run += 1;
        self.last_s = now_s;
        self.longest_run = self.longest_run.max(self.run);
        let required = usize::from(settings.permits_in_a_row);
        while self.gaps.len() >= required {
            self.gaps.pop_front();
        }
        if self.run >= required as u64 {
            self.lasted_s = self.lasted_s.max(now_s - self.from_s);
            let longest = self.gaps.iter().copied().fold(0.0, f64::max);
            let least = self.hold_s.map_or(longest, |known| known.min(longest));
            self.hold_s = Some(least);
        }
    }

    fn why(&self, settings: &Settings<'_>) -> WhyShut {
        let ms = |seconds: f64| (seconds * 1e3).ceil().clamp(0.0, 4e9) as u32 + 1;
        let required = settings.permits_in_a_row;
        if self.estimates == 0 {
            return WhyShut {
                words: "the recording has no estimate with a time".into(),
                setting: None,
            };
        }
        if let Some(age) = self.youngest_s.filter(|_| self.stale == self.estimates) {
            let least = ms(age) + settings.response_ms;
            return WhyShut {
                words: format!(
                    "every estimate is too old: the youngest has {:.0} ms when it comes. With --max-age-ms {least} or more it would be judged.",
                    age * 1e3
                ),
                setting: Some(("max_age_ms", settings.maximum_age_ms, least)),
            };
        }
        if self.permits == 0 {
            return WhyShut {
                words: format!(
                    "no estimate is permitted by itself; most often the reason is {}",
                    self.commonest()
                ),
                setting: None,
            };
        }
        let Some(hold_s) = self.hold_s else {
            let run = self.longest_run;
            return WhyShut {
                words: format!(
                    "{required} permits in a row are needed, and {run} is the most there is: then an estimate is denied, most often as {}. With --permits-in-a-row {run} it would open.",
                    self.commonest()
                ),
                setting: Some(("permits_in_a_row", u32::from(required), run as u32)),
            };
        };
        let least = ms(hold_s);
        if least > settings.permit_hold_ms {
            return WhyShut {
                words: format!(
                    "{required} permits in a row come {:.0} ms apart at the quickest, and a permit is held for {} ms. With --permit-hold-ms {least} or more (and --max-age-ms above it) it would open.",
                    hold_s * 1e3,
                    settings.permit_hold_ms
                ),
                setting: Some(("permit_hold_ms", settings.permit_hold_ms, least)),
            };
        }
        let oldest = settings.maximum_age_ms.saturating_sub(settings.response_ms);
        if least > oldest {
            let least = least.saturating_add(settings.response_ms);
            return WhyShut {
                words: format!(
                    "{required} permits in a row come {:.0} ms apart at the quickest, and an estimate is used for {oldest} ms. With --max-age-ms {least} or more it would open.",
                    hold_s * 1e3
                ),
                setting: Some(("max_age_ms", settings.maximum_age_ms, least)),
            };
        }
        let lasted = (self.lasted_s * 1e3).floor().clamp(0.0, 4e9) as u32;
        if lasted < settings.inhibit_hold_ms {
            let most = lasted.max(1);
            return WhyShut {
                words: format!(
                    "permits in a row last for {lasted} ms, and the gate stays shut for {} ms after a denial. With --inhibit-hold-ms {most} or less it would open.",
                    settings.inhibit_hold_ms
                ),
                setting: Some(("inhibit_hold_ms", settings.inhibit_hold_ms, most)),
            };
        }
        WhyShut {
            words: format!(
                "no single setting decides; estimates that are denied are so most often as {}. In a gate with a moving robot each permit also counts what the robot can drive until the permission ends.",
                self.commonest()
            ),
            setting: None,
        }
    }

    /// Returns the commonest reason of a denial.
    fn commonest(&self) -> String {
        // The first of equal counts.
        let commonest = self.reasons.iter().rev().max_by_key(|(_, count)| **count);
        commonest.map_or("none".into(), |(reason, _)| reason.name().to_string())
    }
}
