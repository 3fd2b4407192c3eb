//! Counts faults of a recording's estimates. No estimate is left out because of them.

use super::Sample;
use posegate::report::{Heading, PoseEstimate};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The most names of other frames that are stored; further ones are only counted.
const NAMES: usize = 32;
/// The largest difference of a quaternion's squared length from 1: the gate's limit.
const UNIT: f64 = 1.0 / 32768.0;

/// Counts of faulty estimates in a recording. An estimate may be counted several times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// All estimates.
    pub estimates: u64,
    /// Stamps before the previous one of the same source.
    pub time_backwards: u64,
    /// Stamps equal to the previous one of the same source.
    pub duplicate_stamps: u64,
    /// Stamps that are not finite.
    pub time_not_finite: u64,
    /// Estimates with a coordinate or a heading that is NaN or infinite.
    pub pose_not_finite: u64,
    /// Quaternions whose length is not 1.
    pub quaternion_not_unit: u64,
    /// The largest angle between the robot's vertical axis and that of the frame, radians.
    pub most_tilt_rad: f64,
    /// Estimates in another frame than the world frame.
    pub other_frame: u64,
    /// The number of estimates in each other frame, by the frame's name.
    pub frames: BTreeMap<String, u64>,
    /// Estimates without a covariance.
    pub without_covariance: u64,
    last: BTreeMap<u8, f64>,
}

impl Findings {
    /// Counts an estimate. `world` is the name of the world frame.
    pub fn note(&mut self, sample: &Sample, world: &str) {
        self.estimates += 1;
        if sample.t_s.is_finite() {
            if let Some(before) = self.last.insert(sample.source, sample.t_s) {
                self.time_backwards += u64::from(sample.t_s < before);
                self.duplicate_stamps += u64::from(sample.t_s == before);
            }
        } else {
            self.time_not_finite += 1;
        }
        // A detection without a pose has its own reason.
        if sample.fault.is_none() {
            let is_finite = is_finite(&sample.belief) && sample.z_m.is_finite();
            self.pose_not_finite += u64::from(!is_finite);
            self.quaternion_not_unit += u64::from(!is_unit(&sample.belief.heading));
            self.without_covariance += u64::from(sample.belief.spread.is_none());
            self.most_tilt_rad = self.most_tilt_rad.max(tilt_rad(&sample.belief.heading));
        }
        if let Some(frame) = &sample.frame
            && frame.trim_start_matches('/') != world.trim_start_matches('/')
        {
            self.other_frame += 1;
            self.note_frame(frame);
        }
    }

    fn note_frame(&mut self, frame: &Arc<str>) {
        if let Some(count) = self.frames.get_mut(frame.as_ref()) {
            *count += 1;
        } else if self.frames.len() < NAMES {
            self.frames.insert(frame.as_ref().into(), 1);
        }
    }

    /// Returns the counts by name, without those of single frames.
    #[must_use]
    pub const fn named(&self) -> [(&'static str, u64); 8] {
        [
            ("estimates", self.estimates),
            ("time_backwards", self.time_backwards),
            ("duplicate_stamps", self.duplicate_stamps),
            ("time_not_finite", self.time_not_finite),
            ("pose_not_finite", self.pose_not_finite),
            ("quaternion_not_unit", self.quaternion_not_unit),
            ("other_frame", self.other_frame),
            ("without_covariance", self.without_covariance),
        ]
    }
}

/// Returns the angle between the vertical axes of the robot and of the frame; 0 if it is not known.
fn tilt_rad(heading: &Heading) -> f64 {
    let cosine = match *heading {
        Heading::Radians(_) => return 0.0,
        Heading::RollPitchYaw([roll, pitch, _]) => libm::cos(roll) * libm::cos(pitch),
        Heading::Quaternion([x, y, z, w]) => {
            1.0 - 2.0 * (x * x + y * y) / (x * x + y * y + z * z + w * w)
        }
    };
    let tilt = libm::acos(cosine.clamp(-1.0, 1.0));
    if tilt.is_finite() { tilt } else { 0.0 }
}

fn is_finite(belief: &PoseEstimate) -> bool {
    let heading = match belief.heading {
        Heading::Radians(yaw) => yaw.is_finite(),
        Heading::RollPitchYaw(angles) => angles.iter().all(|angle| angle.is_finite()),
        Heading::Quaternion(entries) => entries.iter().all(|entry| entry.is_finite()),
    };
    heading && belief.x_m.is_finite() && belief.y_m.is_finite()
}

fn is_unit(heading: &Heading) -> bool {
    match heading {
        Heading::Quaternion(entries) if entries.iter().all(|entry| entry.is_finite()) => {
            let square: f64 = entries.iter().map(|entry| entry * entry).sum();
            (square - 1.0).abs() <= UNIT
        }
        _ => true,
    }
}
