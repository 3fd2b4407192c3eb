//! Computes robot poses from the detections and calibration that a tag detector publishes, with the tags and the
//! camera of a site.
//!
//! [`Detector::camera`] checks a calibration (ROS's CameraInfo) against the site's camera. [`Detector::look`]
//! computes the poses that fit one image. This module does not depend on ROS: fields are those of
//! `sensor_msgs/msg/CameraInfo` and `apriltag_msgs/msg/AprilTagDetection`.
//!
//! ```
//! use posegate_replay::detector::{CameraInfo, Detector, DetectorSettings, FoundTag};
//! use posegate_site::{SAMPLE, Site};
//!
//! let site = Site::parse(SAMPLE, "site.toml")?;
//! let settings = DetectorSettings { corner_sigma_px: 0.3, max_hamming: 0, radius_squared: 11.3449 };
//! let detector = Detector::new(&site, Some("front"), settings)?;
//! let info = CameraInfo {
//!     width: 640,
//!     height: 480,
//!     k: [615.0, 0.0, 320.0, 0.0, 615.0, 240.0, 0.0, 0.0, 1.0],
//!     ..CameraInfo::default()
//! };
//! let camera = detector.camera(&info)?;
//! // The corners of a tag that is seen from 27 degrees off its normal, at 3.1 m, in pixels.
//! let corners_px = [[284.9, 269.1], [338.1, 270.4], [338.1, 209.6], [284.9, 210.9]];
//! let found = FoundTag { family: "tag36h11".into(), id: 7, hamming: 0, corners_px };
//! let fixes = detector.look(&camera, &[found])?;
//! assert!((fixes[0].pose[0] - 1.0).abs() < 0.01);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::corners::{Fix, FixError, MountedCamera, TagObservation, locate_all};
use super::{AlikeTags, KnownTags};
use posegate::certify::{Calibration, CertifiedCamera, Image, LensError, Roi};
use posegate::gate::Reason;
use posegate::shape::{Camera, Intrinsics, Lens};
use posegate_site::{Site, SiteCamera, lens_of_ros};
use std::collections::BTreeSet;

#[cfg(test)]
mod tests;

/// The largest difference of two calibrations of one camera anywhere in the image, pixels.
const AGREES_PX: f64 = 1.0;
/// Points along a side of the image at which calibrations are compared.
const GRID: u32 = 9;
/// A corner may be this far outside of the image: detectors fit lines beyond the last pixel.
const OUTSIDE_PX: f64 = 1.0;

/// Settings of a [`Detector`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorSettings {
    /// The standard deviation of each coordinate of a corner, pixels, above 0.
    pub corner_sigma_px: f64,
    /// Detections with more corrected bits than this are not used.
    pub max_hamming: i32,
    /// The squared radius of the pose-sets: a chi-square quantile, such as 11.3449 for confidence 0.99.
    pub radius_squared: f64,
}

/// A calibration as it is published with each image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CameraInfo {
    /// Columns of the whole image.
    pub width: u32,
    /// Rows of the whole image.
    pub height: u32,
    /// `plumb_bob`, `rational_polynomial` or `equidistant`; empty without distortion.
    pub distortion_model: String,
    /// The coefficients of the model, in ROS's order.
    pub d: Vec<f64>,
    /// The raw camera's matrix by rows, pixels.
    pub k: [f64; 9],
    /// The rectification matrix by rows; zeros for the identity.
    pub r: [f64; 9],
    /// The rectified image's projection matrix by rows, pixels; zeros if it is that of the raw image.
    pub p: [f64; 12],
    /// Columns and rows that are combined into one pixel; 0 means 1.
    pub binning: [u32; 2],
    /// The published part of the image: first column, first row, columns, rows; zeros for all of it.
    pub roi: [u32; 4],
}

/// A detected tag.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundTag {
    /// The family, with or without the prefix `tag`.
    pub family: String,
    /// The tag's number in its family.
    pub id: i32,
    /// The number of corrected bits.
    pub hamming: i32,
    /// The corners in AprilTag's order, pixels: bottom left, bottom right, top right, top left, as a viewer sees the
    /// upright tag.
    pub corners_px: [[f64; 2]; 4],
}

/// The reason why a detector cannot be made for a site.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DetectorError {
    /// The site has no camera.
    #[error("the site has no camera: add [camera.NAME] to it")]
    NoCamera,
    /// The site has several cameras, and no name is given.
    #[error("the site has the cameras {0}: name one of them")]
    SeveralCameras(String),
    /// The site has no camera of this name.
    #[error("the site has no camera `{name}`: it has {all}")]
    UnknownCamera {
        /// The requested name.
        name: String,
        /// The names of the site's cameras.
        all: String,
    },
    /// The site has no tag.
    #[error("the site has no tag: add [tag.NAME] to it")]
    NoTag,
    /// Two tags have the same family and number.
    #[error(transparent)]
    Alike(#[from] AlikeTags),
    /// The calibration of the site's camera has a tolerance.
    #[error(
        "camera `{0}` has a `tolerance` of its calibration, which poses from corners do not include: calibrate it well enough to leave the tolerance out, or use poses of a filter"
    )]
    Calibration(String),
}

/// The reason why a calibration is not used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraInfoError {
    /// The calibration is missing: the focal length is 0.
    #[error("the camera info has no calibration (fx is 0): calibrate the camera")]
    NotCalibrated,
    /// The distortion model or its number of coefficients is not supported.
    #[error(
        "the camera info has the distortion model `{model}` with {count} coefficients: expected plumb_bob with 5, rational_polynomial with 8, or equidistant with 4"
    )]
    Distortion {
        /// The model.
        model: String,
        /// The number of coefficients.
        count: usize,
    },
    /// The rectification rotates the image.
    #[error(
        "the camera info has a rectification matrix that turns the image, as for a stereo pair: let the detector read the raw image, and write image = \"raw\" in the site"
    )]
    Turned,
    /// The numbers are not a valid calibration.
    #[error("the camera info is not that of a camera: {0}")]
    Invalid(#[from] LensError),
    /// The image has another size than the site's camera.
    #[error(
        "the camera info is for an image of {found}, and the site's camera `{camera}` has {expected}: remap camera_info to that camera, or correct the site"
    )]
    Size {
        /// The site's camera.
        camera: String,
        /// The size in the message.
        found: String,
        /// The size in the site.
        expected: String,
    },
    /// The calibration differs from the site's camera.
    #[error(
        "the camera info differs from the site's camera `{camera}` by up to {apart_px:.1} px (at most {most_px:.1}): another camera, another calibration, or another image (rect or raw); correct the site, then build its tables again"
    )]
    Differs {
        /// The site's camera.
        camera: String,
        /// The largest difference.
        apart_px: f64,
        /// The largest allowed one.
        most_px: f64,
    },
}

/// The reason why an image gives no pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LookError {
    /// No tag was detected.
    #[error("no tag is detected")]
    Nothing,
    /// No detected tag is in the site.
    #[error("the detected tag {family} {id} is not in the site, which has {known}")]
    Unknown {
        /// The detected family.
        family: String,
        /// The detected number.
        id: i32,
        /// The tags of the site.
        known: String,
    },
    /// A detection has more corrected bits than are accepted.
    #[error(
        "the detection of tag {id} has {hamming} corrected bits, at most {most} are accepted (max_hamming)"
    )]
    Hamming {
        /// The number.
        id: i32,
        /// The corrected bits.
        hamming: i32,
        /// The largest accepted number.
        most: i32,
    },
    /// A tag is detected twice, so one of the two is a copy or a reflection.
    #[error("tag {0} is detected twice in one image: remove the copy, or the reflection")]
    Twice(i32),
    /// A corner is not finite or not in the image.
    #[error(
        "a corner of tag {0} is not in the image of the camera info: the detector reads another image"
    )]
    NotInImage(i32),
    /// No pose, or no single pose, fits the corners.
    #[error("the corners of the detected tags give no pose: {0}")]
    Corners(#[from] FixError),
}

impl LookError {
    /// Returns the gate's reason if the detections contradict the site, so that an earlier pose must not be used any more; `None` if
    /// they say nothing about the pose.
    #[must_use]
    pub const fn reason(&self) -> Option<Reason> {
        match self {
            Self::Twice(_) | Self::NotInImage(_) => Some(Reason::CornersDoNotFit),
            Self::Corners(error) => error.reason(),
            _ => None,
        }
    }
}

/// The tags and one camera of a site.
#[derive(Clone, Debug)]
pub struct Detector {
    name: String,
    camera: SiteCamera,
    tags: KnownTags,
    settings: DetectorSettings,
}

impl Detector {
    /// Returns a detector for a camera of a site; `None` selects the only camera.
    ///
    /// # Errors
    /// [`DetectorError`]
    pub fn new(
        site: &Site,
        camera: Option<&str>,
        settings: DetectorSettings,
    ) -> Result<Self, DetectorError> {
        let all = || {
            let names: Vec<&str> = site.cameras.keys().map(String::as_str).collect();
            names.join(", ")
        };
        let (name, camera) =
            match camera {
                Some(name) => site.cameras.get_key_value(name).ok_or_else(|| {
                    DetectorError::UnknownCamera {
                        name: name.into(),
                        all: all(),
                    }
                })?,
                None if site.cameras.len() > 1 => return Err(DetectorError::SeveralCameras(all())),
                None => site.cameras.iter().next().ok_or(DetectorError::NoCamera)?,
            };
        if site.tags.is_empty() {
            return Err(DetectorError::NoTag);
        }
        if camera.tolerance != Intrinsics::NONE {
            return Err(DetectorError::Calibration(name.clone()));
        }
        let tags = KnownTags::of(site);
        if let Some(equal) = tags.alike() {
            return Err(equal.clone().into());
        }
        Ok(Self {
            name: name.clone(),
            camera: *camera,
            tags,
            settings,
        })
    }

    /// Returns the name of the camera in the site file.
    #[must_use]
    pub fn camera_name(&self) -> &str {
        &self.name
    }

    /// Returns the settings.
    #[must_use]
    pub const fn settings(&self) -> DetectorSettings {
        self.settings
    }

    /// Returns the site's camera with the numbers of a published calibration. Takes some milliseconds for a camera
    /// with distortion.
    ///
    /// The site says which image its detector reads, raw or rectified. A site without distortion stands for a pinhole
    /// image, so its image may be the rectified one.
    ///
    /// # Errors
    /// [`CameraInfoError`] if the calibration is invalid, or differs too much from the site's camera.
    pub fn camera(&self, info: &CameraInfo) -> Result<MountedCamera, CameraInfoError> {
        let site = &self.camera;
        let read = |image| {
            let camera = CertifiedCamera::of(&calibration(info, image)?)?.camera;
            self.agrees(&camera).map(|()| camera)
        };
        let camera = match site.calibration.image {
            Image::Rect(_) => read(rectified(info)?),
            _ if site.calibration.lens != Lens::Pinhole => read(Image::Raw),
            _ => read(Image::Raw).or_else(|error| match rectified(info) {
                Ok(image) => read(image),
                Err(_) => Err(error),
            }),
        };
        Ok(MountedCamera {
            camera: camera?,
            mount: site.mount,
            mount_tolerance: site.mount_tolerance,
        })
    }

    /// Checks that a camera agrees with the site's.
    fn agrees(&self, camera: &Camera) -> Result<(), CameraInfoError> {
        let own = &self.camera.camera;
        let size = |camera: &Camera| [camera.width_px, camera.height_px];
        if size(camera) != size(own) {
            let words = |camera: &Camera| format!("{} x {}", camera.width_px, camera.height_px);
            return Err(CameraInfoError::Size {
                camera: self.name.clone(),
                found: words(camera),
                expected: words(own),
            });
        }
        let [width, height] = size(own);
        let mut apart_px = 0.0f64;
        for (column, row) in (0..GRID).flat_map(|k| (0..GRID).map(move |l| (k, l))) {
            let at = |k: u32, size: f64| size * f64::from(k) / f64::from(GRID - 1);
            let ray = [
                (at(column, width) - own.cx) / own.fx,
                (at(row, height) - own.cy) / own.fy,
            ];
            let [[u, v], [other_u, other_v]] = [own.project(ray), camera.project(ray)];
            // Points of this grid may be outside of the image of a lens.
            if (0.0..=width).contains(&u) && (0.0..=height).contains(&v) {
                let apart = libm::hypot(other_u - u, other_v - v);
                apart_px = apart_px.max(if apart.is_finite() { apart } else { 1e9 });
            }
        }
        let most_px = AGREES_PX;
        if apart_px <= most_px {
            return Ok(());
        }
        Err(CameraInfoError::Differs {
            camera: self.name.clone(),
            apart_px,
            most_px,
        })
    }

    /// Returns the poses of the robot that fit the detections of one image, best first: one or two ([`locate_all`]).
    /// Detections of unknown tags and detections with too many corrected bits are ignored.
    ///
    /// # Errors
    /// [`LookError`]. If no detection is usable, the reason of the first one.
    pub fn look(&self, camera: &MountedCamera, found: &[FoundTag]) -> Result<Vec<Fix>, LookError> {
        let mut seen = Vec::new();
        let mut ids = BTreeSet::new();
        let mut ignored = None;
        for found in found {
            let most = self.settings.max_hamming;
            let Some(tag) = self.tags.get(&found.family, i64::from(found.id)) else {
                ignored.get_or_insert_with(|| LookError::Unknown {
                    family: found.family.clone(),
                    id: found.id,
                    known: self.known(),
                });
                continue;
            };
            if !ids.insert((&tag.family, tag.tag.id)) {
                return Err(LookError::Twice(found.id));
            }
            if !(0..=most).contains(&found.hamming) {
                let (id, hamming) = (found.id, found.hamming);
                ignored.get_or_insert(LookError::Hamming { id, hamming, most });
                continue;
            }
            let pixels = found.corners_px.as_flattened();
            if !pixels.iter().all(|pixel| pixel.is_finite()) {
                return Err(FixError::NotFinite.into());
            }
            let is_in = |[u, v]: [f64; 2]| {
                let is_within = |at: f64, size: f64| at >= -OUTSIDE_PX && at <= size + OUTSIDE_PX;
                is_within(u, camera.camera.width_px) && is_within(v, camera.camera.height_px)
            };
            if !found.corners_px.into_iter().all(is_in) {
                return Err(LookError::NotInImage(found.id));
            }
            seen.push(TagObservation {
                tag: &tag.tag,
                tolerance: tag.tolerance,
                corners_px: found.corners_px,
            });
        }
        if seen.is_empty() {
            return Err(ignored.unwrap_or(LookError::Nothing));
        }
        let DetectorSettings {
            corner_sigma_px,
            radius_squared,
            ..
        } = self.settings;
        Ok(locate_all(camera, &seen, corner_sigma_px, radius_squared)?)
    }

    /// Returns the first tags of the site as text.
    fn known(&self) -> String {
        let mut words: Vec<String> = self
            .tags
            .all()
            .take(5)
            .map(|tag| format!("{} {}", tag.family, tag.tag.id))
            .collect();
        if self.tags.all().count() > words.len() {
            words.push("others".into());
        }
        words.join(", ")
    }
}

/// Returns the rectified image of a camera info.
fn rectified(info: &CameraInfo) -> Result<Image, CameraInfoError> {
    const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    if info.r != IDENTITY && info.r != [0.0; 9] {
        return Err(CameraInfoError::Turned);
    }
    let [fx, _, cx, _, _, fy, cy, ..] = info.p;
    let [raw_fx, _, raw_cx, _, raw_fy, raw_cy, ..] = info.k;
    Ok(Image::Rect(if fx == 0.0 {
        [raw_fx, raw_fy, raw_cx, raw_cy]
    } else {
        [fx, fy, cx, cy]
    }))
}

/// Returns the calibration of a camera info, for one of its images.
fn calibration(info: &CameraInfo, image: Image) -> Result<Calibration, CameraInfoError> {
    let [fx, _, cx, _, fy, cy, ..] = info.k;
    if fx == 0.0 {
        return Err(CameraInfoError::NotCalibrated);
    }
    let lens = if info.d.iter().all(|d| *d == 0.0) && info.distortion_model != "equidistant" {
        Lens::Pinhole
    } else {
        let known = lens_of_ros(&info.distortion_model, &info.d);
        known.ok_or_else(|| CameraInfoError::Distortion {
            model: info.distortion_model.clone(),
            count: info.d.len(),
        })?
    };
    let [x_offset, y_offset, width, height] = info.roi;
    Ok(Calibration {
        size_px: [f64::from(info.width), f64::from(info.height)],
        focal_px: [fx, fy],
        axis_px: [cx, cy],
        lens,
        image,
        roi: (info.roi != [0; 4]).then_some(Roi {
            x_offset,
            y_offset,
            width,
            height,
        }),
        binning: info.binning.map(|count| count.max(1)),
        border_px: 0.0,
    })
}
