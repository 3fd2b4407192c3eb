//! Shares of poses that are good enough: below two thresholds, or for a task.

use super::{Errors, Matched};
use posegate::shape::SuccessSet;

/// Returns the share of poses whose errors are below both thresholds, metres and degrees (Correct Rate). NaN if
/// there are no poses.
#[must_use]
pub fn correct_rate(errors: &Errors, translation_below: f64, rotation_below_deg: f64) -> f64 {
    let both = errors.translation.iter().zip(&errors.rotation);
    let correct = both.filter(|(translation, rotation)| {
        **translation < translation_below && rotation.to_degrees() < rotation_below_deg
    });
    correct.count() as f64 / errors.translation.len() as f64
}

/// Shares of poses in a task's success set, on the floor (x, y, yaw). NaN if there are no poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InSet {
    /// Share of the errors in the set: the robot's true pose when its estimate is at the goal
    /// (`goal estimate^-1 reference`). This is the Correct Rate with the task's success set instead of two thresholds.
    pub errors: f64,
    /// Share of the estimate's poses in the set.
    pub estimate: f64,
    /// Share of the reference's poses in the set.
    pub reference: f64,
}

/// Returns the shares of matched poses that are in a success set.
#[must_use]
pub fn in_set(matched: &Matched, set: &SuccessSet) -> InSet {
    let mut inside = [0u32; 3];
    for (reference, estimate) in matched.reference.iter().zip(&matched.estimate) {
        let (reference, estimate) = (reference.level(), estimate.level());
        let (dx, dy) = (reference[0] - estimate[0], reference[1] - estimate[1]);
        // The error in the estimate's frame, then moved to the goal's frame by a planar rotation.
        let goal = set.goal;
        let turn = goal.yaw_deg.to_radians() - estimate[2];
        let (cos, sin) = (libm::cos(turn), libm::sin(turn));
        let error = [
            goal.x + cos * dx - sin * dy,
            goal.y + sin * dx + cos * dy,
            reference[2] + turn,
        ];
        for (count, pose) in inside.iter_mut().zip([error, estimate, reference]) {
            *count += u32::from(set.membership(pose).inside);
        }
    }
    let [errors, estimate, reference] =
        inside.map(|count| f64::from(count) / matched.estimate.len() as f64);
    InSet {
        errors,
        estimate,
        reference,
    }
}
