//! Tables (CSV) that `posegate-learn` reads, made from recordings.

use super::corners::{MountedCamera, TagObservation, locate_all};
use super::recording::{Item, Recording, RecordingError, Sample, TagLocalizer};
use super::replay::RejectedTruth;
use super::{KnownTags, Trajectory, TruthLookup};
use posegate::report::{FrameId, Heading};
use posegate::set::Uncertainty;
use posegate::shape::{PoseDeg, Shape, SuccessSet, Visibility};
use posegate_site::SiteTag;
use std::fmt::Write as _;
use std::sync::Arc;

/// The header of a table of estimates.
pub const ESTIMATES: &str = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\n";
/// The header of a table of views of tags.
const VIEWS: &str = "t_s,d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad,second_err_translation_m,second_err_yaw_rad\n";
/// Views are taken up to this distance, metres.
const FARTHEST: f64 = 1e3;

/// A table of the rows of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// The text, with a header.
    pub text: String,
    /// The number of rows.
    pub rows: u64,
    /// The number of estimates (or images) that give no row.
    pub left_out: u64,
}

/// Returns the row of an estimate: its stamp (s), pose (m, m, rad), covariance and true pose. `None` if the pose is not finite, or without a
/// covariance.
#[must_use]
pub fn estimate_row(
    t_s: f64,
    pose: [f64; 3],
    spread: Option<Uncertainty>,
    truth: Option<[f64; 3]>,
) -> Option<String> {
    let Some(Uncertainty::Gaussian([[xx, xy, xt], [_, yy, yt], [_, _, tt]])) = spread else {
        return None;
    };
    let [x, y, yaw] = pose;
    let numbers = [t_s, x, y, yaw, xx, xy, xt, yy, yt, tt];
    if !numbers.iter().all(|number| number.is_finite()) {
        return None;
    }
    let truth = match truth {
        Some([x, y, yaw]) => format!("{x:?},{y:?},{yaw:?}"),
        None => ",,".to_owned(),
    };
    let mut row = String::new();
    for number in numbers {
        let _ = write!(row, "{number:?},");
    }
    row.push_str(&truth);
    row.push('\n');
    Some(row)
}

/// The estimates and the images of a recording in memory, and all true poses.
pub struct Played {
    /// The estimates and the detections.
    items: Vec<Item>,
    /// The true poses.
    track: Option<Trajectory>,
    /// The counts of refused true poses.
    pub refused: RejectedTruth,
    /// The name of the world frame.
    world: Arc<str>,
}

impl Played {
    /// Reads a recording to its end: the items stamped in `range` (first and last, seconds). `track` has the true poses of a file, and takes
    /// those of the recording; it must keep all.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn read(
        recording: &mut dyn Recording,
        track: Option<Trajectory>,
        world: &str,
        range: [f64; 2],
    ) -> Result<Self, RecordingError> {
        let mut found = Self {
            items: Vec::new(),
            track,
            refused: RejectedTruth::default(),
            world: world.into(),
        };
        let is_wanted = |t_s: f64| range[0] <= t_s && t_s <= range[1];
        while let Some(item) = recording.next()? {
            match item {
                Item::Truth(pose) => {
                    if let Some(track) = &mut found.track {
                        found.refused.push(&pose, FrameId::of(world), track);
                    }
                }
                Item::Estimate(Sample { t_s, .. }) | Item::Detections { t_s, .. } => {
                    if is_wanted(t_s) {
                        found.items.push(item);
                    }
                }
            }
        }
        if let Some(track) = &mut found.track {
            track.complete();
        }
        Ok(found)
    }

    /// Returns `true` if there is neither an estimate nor an image.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Returns the table of estimates with a known true pose. `localizer` makes estimates of detections; without it they are left out. Also
    /// left out are estimates in another frame, without a covariance, and of images that two poses fit.
    pub fn estimates(&self, localizer: &mut Option<TagLocalizer>) -> Table {
        let mut table = Table {
            text: ESTIMATES.into(),
            ..Table::default()
        };
        for item in &self.items {
            let of_image;
            let sample = match item {
                Item::Estimate(sample) => Some(sample),
                Item::Detections {
                    source,
                    t_s,
                    exact_ns,
                    found,
                    ..
                } => {
                    of_image = localizer
                        .as_mut()
                        .and_then(|looks| looks.estimate(*source, *t_s, *exact_ns, found));
                    of_image.as_ref()
                }
                Item::Truth(_) => continue,
            };
            match sample.and_then(|sample| self.row(sample)) {
                Some(row) => {
                    table.text.push_str(&row);
                    table.rows += 1;
                }
                None => table.left_out += 1,
            }
        }
        table
    }

    fn row(&self, sample: &Sample) -> Option<String> {
        let frame = sample.frame.as_ref();
        if sample.is_ambiguous || frame.is_some_and(|frame| **frame != *self.world) {
            return None;
        }
        let belief = &sample.belief;
        let yaw = match belief.heading {
            Heading::Quaternion(entries) => super::recording::yaw_of(entries),
            Heading::Radians(yaw) | Heading::RollPitchYaw([_, _, yaw]) => yaw,
        };
        let truth = sample.truth.or_else(|| self.true_pose(sample.t_s))?;
        estimate_row(
            sample.t_s,
            [belief.x_m, belief.y_m, yaw],
            belief.spread,
            Some(truth),
        )
    }

    fn true_pose(&self, t_s: f64) -> Option<[f64; 3]> {
        match self.track.as_ref()?.at(t_s) {
            TruthLookup::Pose(pose) => Some(pose),
            TruthLookup::NotYet | TruthLookup::None => None,
        }
    }

    /// Returns the table of views: for each image and each tag that a camera at the true pose has in its image, whether the detector found it and
    /// a pose fits, and the errors of one or both poses that the tag alone gives. `sigma_px` is the deviation of corners, pixels;
    /// `radius_squared` that of the pose-sets. Images without a true pose are left out.
    #[must_use]
    pub fn views(
        &self,
        camera: &MountedCamera,
        tags: &KnownTags,
        sigma_px: f64,
        radius_squared: f64,
    ) -> Table {
        let mut table = Table {
            text: VIEWS.into(),
            ..Table::default()
        };
        for item in &self.items {
            let Item::Detections { t_s, found, .. } = item else {
                continue;
            };
            let Some(truth) = self.true_pose(*t_s) else {
                table.left_out += 1;
                continue;
            };
            for tag in tags.all() {
                let known = |family: &str, id: i32| tags.get(family, i64::from(id)) == Some(tag);
                let seen = found.iter().find(|found| known(&found.family, found.id));
                let (view, is_in_image) = view(camera, tag, truth);
                if seen.is_none() && !is_in_image {
                    continue;
                }
                let fixes = seen.and_then(|seen| {
                    let look = TagObservation {
                        tag: &tag.tag,
                        tolerance: tag.tolerance,
                        corners_px: seen.corners_px,
                    };
                    locate_all(camera, &[look], sigma_px, radius_squared).ok()
                });
                let errors = fixes.iter().flatten().take(2).map(|fix| {
                    let [dx, dy] = [0, 1].map(|axis| fix.pose[axis] - truth[axis]);
                    let turn = fix.pose[2] - truth[2];
                    let turn = libm::atan2(libm::sin(turn), libm::cos(turn));
                    format!(",{:?},{:?}", libm::hypot(dx, dy), libm::fabs(turn))
                });
                let errors: Vec<String> = errors.collect();
                let [d, phi, psi] = view;
                let _ = write!(
                    table.text,
                    "{t_s:?},{d:?},{phi:?},{psi:?},{}",
                    u8::from(!errors.is_empty())
                );
                for pose in 0..2 {
                    table
                        .text
                        .push_str(errors.get(pose).map_or(",,", String::as_str));
                }
                table.text.push('\n');
                table.rows += 1;
            }
        }
        table
    }
}

/// Returns the view of a tag from a pose of the robot: d (m), phi and psi (degrees), and `true` if the tag faces the camera with all corners in
/// the image.
fn view(camera: &MountedCamera, tag: &SiteTag, [x, y, yaw]: [f64; 3]) -> ([f64; 3], bool) {
    let goal = PoseDeg {
        x,
        y,
        yaw_deg: yaw.to_degrees(),
    };
    let set = SuccessSet {
        goal,
        shape: Shape::Visibility(Visibility {
            camera: camera.camera,
            mount: camera.mount,
            tag: tag.tag,
            d_max: FARTHEST,
            phi_max_deg: 90.0,
            psi_max_deg: 90.0,
            z_near: 0.05,
            tag_tolerance: posegate::shape::Tolerance::NONE,
            mount_tolerance: posegate::shape::Tolerance::NONE,
            sharpness: None,
            error_room: None,
        }),
    };
    let membership = set.membership([x, y, yaw]);
    let view = membership.sight.map_or([f64::NAN; 3], |sight| {
        [sight.d, sight.phi.to_degrees(), sight.psi.to_degrees()]
    });
    (view, membership.inside)
}
