//! Turns tag detections into estimates: the pose and its covariance from the tags' corners.

use super::{Detection, Exact, Sample};
use crate::KnownTags;
use crate::corners::{Fix, FixError, MountedCamera, TagObservation, is_ambiguous, locate_all};
use posegate::gate::Reason;
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

    /// Returns the estimate from an observation, or both if two poses fit ([`locate_all`]); `None` if no known tag was observed. If there is
    /// no pose for another reason, the estimate has NaN coordinates and no covariance, and the reason.
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
        let found = locate_all(&self.camera, &seen, self.sigma_px, self.radius_squared);
        let is_ambiguous = found.as_ref().is_ok_and(|fixes| is_ambiguous(fixes));
        match &found {
            Ok(_) if is_ambiguous => *self.counts.entry(FixError::Ambiguous).or_default() += 1,
            Ok(_) => self.fixes += 1,
            Err(why) => *self.counts.entry(*why).or_default() += 1,
        }
        let estimate = |fix: &Fix| PoseEstimate {
            x_m: fix.pose[0],
            y_m: fix.pose[1],
            heading: Heading::Radians(fix.pose[2]),
            spread: Some(Uncertainty::Gaussian(fix.covariance)),
        };
        let none = PoseEstimate {
            x_m: f64::NAN,
            y_m: f64::NAN,
            heading: Heading::Radians(f64::NAN),
            spread: None,
        };
        let (belief, other, fault) = match found {
            Ok(fixes) => match fixes.as_slice() {
                [best, others @ ..] => (
                    estimate(best),
                    others.first().map(estimate).map(Box::new),
                    None,
                ),
                [] => (none, None, Some(Reason::CornersDoNotFit)),
            },
            Err(error) => (none, None, Some(error.reason()?)),
        };
        Some(Sample {
            source,
            t_s,
            logged_s: exact_ns.map(|exact| Exact::seconds(exact.logged)),
            exact_ns,
            frame: None,
            z_m: 0.0,
            belief,
            truth: None,
            since_fix_ms: None,
            lever_m: 0.0,
            other,
            is_ambiguous,
            fault,
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
