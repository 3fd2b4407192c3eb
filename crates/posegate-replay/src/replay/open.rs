//! The interlock's open moments compared with the truth: at each step of the gate, also between the estimates.

use super::MOST_WAITING;
use crate::{Trajectory, TruthLookup};
use posegate::shape::SuccessSet;
use std::collections::VecDeque;

/// Steps of the gate after which the interlock was open, and whether the robot was in the success set.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OpenMoments {
    /// Steps of the gate after which the interlock was open.
    pub open: u64,
    /// Such steps with a known true pose.
    pub with_truth: u64,
    /// Such steps whose true pose was outside of the success set.
    pub outside: u64,
    /// Steps whose true pose may still come, seconds.
    waiting: VecDeque<f64>,
}

impl OpenMoments {
    /// Adds a step between two estimates.
    pub(super) fn step(&mut self, t_s: f64, has_truth: bool) {
        self.open += 1;
        if has_truth {
            self.waiting.push_back(t_s);
            if self.waiting.len() > MOST_WAITING {
                self.waiting.pop_front();
            }
        }
    }

    /// Adds the step of an estimate. `inside` is `None` without a truth.
    pub(super) fn estimate(&mut self, inside: Option<bool>) {
        self.open += 1;
        if let Some(inside) = inside {
            self.note(inside);
        }
    }

    /// Looks up the truth of the steps that wait, as far as it is known.
    pub(super) fn settle(&mut self, track: &Trajectory, success: &SuccessSet, all: bool) {
        while let Some(t_s) = self.waiting.front() {
            match track.at(*t_s) {
                TruthLookup::NotYet if !all => return,
                TruthLookup::Pose(truth) => self.note(success.membership(truth).inside),
                _ => {}
            }
            self.waiting.pop_front();
        }
    }

    const fn note(&mut self, inside: bool) {
        self.with_truth += 1;
        self.outside += !inside as u64;
    }
}
