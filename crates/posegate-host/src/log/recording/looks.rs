//! Turns tag detections into estimates: the pose and its covariance from the tags' corners.

use super::{Detection, Exact, Sample};
use crate::log::KnownTags;
use crate::log::corners::{FixError, MountedCamera, TagObservation, locate};
use posegate::report::{Heading, PoseEstimate};
use posegate::set::Uncertainty;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A camera and the tags that it may observe.
#[derive(Clone, Debug)]
pub struct TagLocalizer {
    camera: MountedCamera,
    tags: KnownTags,
    sigma_px: f64,
    radius_squared: f64,
    counts: BTreeMap<FixError, u64>,
    fixes: u64,
    unknown: u64,
    frame: Option<Arc<str>>,
}

impl TagLocalizer {
    /// Returns a localizer for the tags of a site. `sigma_px` is the standard deviation of a corner's coordinates,
    /// pixels; `radius_squared` is that of the pose-sets. A tag that an image does not identify counts as unknown.
    #[must_use]
    pub fn new(camera: MountedCamera, tags: KnownTags, sigma_px: f64, radius_squared: f64) -> Self {
        Self {
            camera,
            tags,
            sigma_px,
            radius_squared,
            counts: BTreeMap::new(),
            fixes: 0,
            unknown: 0,
            frame: None,
        }
    }

    /// Records the frame of an observation. A camera has only one.
    ///
    /// # Errors
    /// The frame of earlier observations and this one, if they differ: they come from two cameras.
    pub fn note_frame(&mut self, frame: &Arc<str>) -> Result<(), [Arc<str>; 2]> {
        match &self.frame {
            None => self.frame = Some(frame.clone()),
            Some(before) if before == frame => {}
            Some(before) => return Err([before.clone(), frame.clone()]),
        }
        Ok(())
    }

    /// Returns the frame of the observations.
    #[must_use]
    pub fn frame(&self) -> Option<&str> {
        self.frame.as_deref()
    }

    /// Returns the estimate from an observation; `None` if no known tag was observed. If there is no pose for another
    /// reason, the estimate has NaN coordinates and no covariance: the gate denies it.
    pub fn estimate(
        &mut self,
        source: u8,
        t_s: f64,
        exact_ns: Option<Exact>,
        found: &[Detection],
    ) -> Option<Sample> {
        let seen: Vec<TagObservation<'_>> = found
            .iter()
            .filter_map(|found| {
                let tag = self.tags.get(&found.family, i64::from(found.id));
                tag.map(|tag| TagObservation {
                    tag: &tag.tag,
                    tolerance: tag.tolerance,
                    corners_px: found.corners_px,
                })
            })
            .collect();
        self.unknown += (found.len() - seen.len()) as u64;
        let fix = locate(&self.camera, &seen, self.sigma_px, self.radius_squared);
        match fix {
            Ok(_) => self.fixes += 1,
            Err(why) => *self.counts.entry(why).or_default() += 1,
        }
        let (pose, spread) = match fix {
            Ok(fix) => (fix.pose, Some(Uncertainty::Gaussian(fix.covariance))),
            Err(FixError::NoTag) => return None,
            Err(_) => ([f64::NAN; 3], None),
        };
        Some(Sample {
            source,
            t_s,
            logged_s: exact_ns.map(|exact| Exact::seconds(exact.logged)),
            exact_ns,
            frame: None,
            z_m: 0.0,
            belief: PoseEstimate {
                x_m: pose[0],
                y_m: pose[1],
                heading: Heading::Radians(pose[2]),
                spread,
            },
            truth: None,
            since_fix_ms: None,
            lever_m: 0.0,
        })
    }

    /// Returns the number of observations with a pose, of detections of unknown tags, and of observations without a
    /// pose, by cause.
    #[must_use]
    pub fn counts(&self) -> Vec<(&'static str, u64)> {
        let mut all = Vec::from([("fixes", self.fixes), ("unknown_tags", self.unknown)]);
        all.extend(self.counts.iter().map(|(why, count)| (why.name(), *count)));
        all
    }
}
