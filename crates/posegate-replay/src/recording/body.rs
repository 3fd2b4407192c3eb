//! Frames on the robot: the pose of an antenna or a camera becomes the pose of the robot's base.
//!
//! Entry point: [`BodyFrames`]. A frame without a known place is refused: its pose is not that of the robot.

use super::transforms::{Pose, Transform};
use posegate::report::PoseEstimate;
use posegate::set::Uncertainty;
use posegate::shape::{Pose3Deg, Scalar};
use std::collections::BTreeMap;

/// The names of the robot's base if none is given.
pub(super) const BASES: [&str; 2] = ["base_link", "base_footprint"];
/// The most static transforms that are kept.
const MOST_STATIC: usize = 1 << 12;

/// The places of frames on the robot, by name.
#[derive(Clone, Debug, Default)]
pub struct BodyFrames {
    /// The pose of each frame in the base.
    known: BTreeMap<String, Pose>,
    /// Frames that count as the base if their place is not known.
    named: Vec<String>,
    /// The base, if it has another name than [`BASES`].
    base: Option<String>,
    /// The frame of estimates that name no child frame; `None` for the base.
    of_estimates: Option<String>,
    /// Subtracted from every position in the map, metres.
    origin: [f64; 2],
    /// `true` if covariances lack terms, so that those of the base do not follow from them.
    is_partial: bool,
    /// Static transforms: the parent, the child, and the child's pose in the parent.
    fixed: Vec<(String, String, Pose)>,
}

/// Where a frame is on the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Body {
    /// The base itself.
    Base,
    /// A frame with this pose in the base.
    At(Pose),
}

impl Body {
    /// Returns the distance from the robot's vertical axis, metres.
    pub fn lever_m(&self) -> f64 {
        match self {
            Self::Base => 0.0,
            Self::At(pose) => libm::hypot(pose.position[0], pose.position[1]),
        }
    }
}

impl BodyFrames {
    /// Returns frames with these poses in the base.
    pub fn new<'a>(frames: impl IntoIterator<Item = (&'a String, &'a Pose3Deg)>) -> Self {
        let known = frames.into_iter();
        Self {
            known: known
                .map(|(name, pose)| (bare(name).to_owned(), of_degrees(pose)))
                .collect(),
            ..Self::default()
        }
    }

    /// Accepts these frames: at their known places, else as the base. A single one is also the frame of estimates whose messages
    /// name no child frame.
    #[must_use]
    pub fn with_named(mut self, names: &[String]) -> Self {
        self.named = names.iter().map(|name| bare(name).to_owned()).collect();
        self.of_estimates = match self.named.as_slice() {
            [only] => Some(only.clone()),
            _ => None,
        };
        self
    }

    /// Names the base, in addition to `base_link` and `base_footprint`.
    #[must_use]
    pub fn with_base(mut self, name: Option<&str>) -> Self {
        self.base = name.map(|name| bare(name).to_owned());
        self
    }

    /// Gives the point of the map that is subtracted from the poses of estimates and of the truth, metres.
    #[must_use]
    pub const fn with_origin(mut self, origin: [f64; 2]) -> Self {
        self.origin = origin;
        self
    }

    pub(super) const fn origin(&self) -> [f64; 2] {
        self.origin
    }

    /// States that the covariances of estimates lack terms: then those of frames beside the base are refused.
    #[must_use]
    pub const fn of_partial_covariances(mut self) -> Self {
        self.is_partial = true;
        self
    }

    pub(super) const fn is_partial(&self) -> bool {
        self.is_partial
    }

    /// Adds the places that static transforms give, from the base along any number of them. Places that were known before are kept.
    pub fn add_static(&mut self) {
        let bases = BASES.into_iter().chain(self.base.as_deref());
        let mut reached: Vec<_> = bases.map(|base| (base.to_owned(), Pose::NONE)).collect();
        let mut next = 0;
        while let Some((from, pose)) = reached.get(next).cloned() {
            next += 1;
            for (parent, child, fixed) in &self.fixed {
                let (to, step) = match (*parent == from, *child == from) {
                    (true, _) => (child, *fixed),
                    (_, true) => (parent, fixed.inverse()),
                    _ => continue,
                };
                if !reached.iter().any(|(known, _)| known == to) {
                    reached.push((to.clone(), pose.of(&step)));
                }
            }
        }
        for (name, pose) in reached {
            if !self.is_base(&name) {
                self.known.entry(name).or_insert(pose);
            }
        }
    }

    /// Keeps a static transform for [`Self::add_static`].
    pub(super) fn note_static(&mut self, transform: &Transform) {
        let (parent, child) = (bare(&transform.parent), bare(&transform.child));
        let is_known = |(a, b, _): &(String, String, Pose)| a == parent && b == child;
        if self.fixed.len() < MOST_STATIC && !self.fixed.iter().any(is_known) {
            let fixed = (parent.to_owned(), child.to_owned(), transform.pose);
            self.fixed.push(fixed);
        }
    }

    /// Returns where a frame is on the robot: x, y (m) and yaw (rad); `None` if its place is not known.
    #[must_use]
    pub fn place(&self, name: &str) -> Option<[f64; 3]> {
        let pose = self.known.get(bare(name))?;
        let [x, y, _] = pose.position;
        Some([x, y, super::yaw_of(pose.orientation)])
    }

    /// Returns where the frame of a message is; `None` if it is refused. `child` is the frame that the message names.
    pub(super) fn body(&self, child: Option<&str>, is_estimate: bool) -> Option<Body> {
        let child = match child.map(bare).filter(|child| !child.is_empty()) {
            Some(child) => child,
            // A type without a child frame has poses of the robot, unless the user says otherwise.
            None if is_estimate && self.of_estimates.is_some() => self.of_estimates.as_deref()?,
            None if child.is_none() => return Some(Body::Base),
            None => return (!self.named.is_empty()).then_some(Body::Base),
        };
        if let Some(pose) = self.known.get(child) {
            return Some(Body::At(*pose));
        }
        let is_named = self.named.iter().any(|name| name == child);
        (is_named || self.is_base(child)).then_some(Body::Base)
    }

    fn is_base(&self, name: &str) -> bool {
        BASES.contains(&name) || self.base.as_deref() == Some(name)
    }

    /// Returns the names of the frames with a known place.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        self.known.keys().map(String::as_str).collect()
    }
}

/// Returns the estimate of the base from a pose that was moved to it along a lever, metres: with the bound (translation in metres, yaw in
/// radians) instead of its own uncertainty, if one is given, and with what the step adds to it ([`spread_of_base`]).
pub(crate) fn of_base(
    belief: &PoseEstimate,
    bound: Option<[f64; 2]>,
    lever_m: f64,
    radius_squared: f64,
) -> PoseEstimate {
    let bound = bound.map(|[translation_m, yaw_rad]| Uncertainty::Bounded {
        translation_m,
        yaw_rad,
    });
    let spread = bound.or(belief.spread);
    let spread = if lever_m > 0.0 {
        spread.map(|spread| spread_of_base(spread, lever_m, radius_squared))
    } else {
        spread
    };
    PoseEstimate { spread, ..*belief }
}

/// Returns the uncertainty of the base from that of a frame at a distance from the base's vertical axis. `radius_squared` is that of
/// the pose-set, with the source's inflation.
///
/// A bound grows by the chord of the largest turn. A covariance has the derivative of the step already; what the derivative leaves out
/// is at most `lever yaw^2 / 2` with the largest turn of the set, and a disc of that size is added: a sum of ellipsoids lies in
/// `(1 + k) A + (1 + 1 / k) B` for every k above 0.
fn spread_of_base(spread: Uncertainty, lever_m: f64, radius_squared: f64) -> Uncertainty {
    match spread {
        Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        } => {
            let turn = yaw_rad.min(core::f64::consts::PI);
            Uncertainty::Bounded {
                translation_m: translation_m + 2.0 * lever_m * libm::sin(0.5 * turn),
                yaw_rad,
            }
        }
        Uncertainty::Gaussian(mut rows) => {
            let variance = rows[2][2];
            let left_out = 0.5 * lever_m * radius_squared * variance;
            let added = left_out * left_out / radius_squared;
            let own = rows[0][0].min(rows[1][1]);
            let best = libm::sqrt(added / own);
            let share = if best > 0.0 && best.is_finite() {
                best
            } else {
                1.0
            };
            // Without a turn, or without a valid covariance, nothing is added.
            if added > 0.0 && added.is_finite() {
                for entry in rows.as_flattened_mut() {
                    *entry *= 1.0 + share;
                }
                for axis in [0, 1] {
                    rows[axis][axis] += (1.0 + 1.0 / share) * added;
                }
            }
            Uncertainty::Gaussian(rows)
        }
    }
}

/// Returns a frame's name without the slash that tf2 ignores.
fn bare(name: &str) -> &str {
    name.trim_start_matches('/')
}

/// Returns a pose in metres and as a quaternion.
fn of_degrees(pose: &Pose3Deg) -> Pose {
    let half = |degrees: f64| {
        let [cos, sin] = f64::cos_sin_deg(0.5 * degrees);
        (cos, sin)
    };
    let ((cr, sr), (cp, sp), (cy, sy)) = (
        half(pose.roll_deg),
        half(pose.pitch_deg),
        half(pose.yaw_deg),
    );
    Pose {
        position: [pose.x, pose.y, pose.z],
        orientation: [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(x: f64, y: f64, yaw_deg: f64) -> Pose3Deg {
        Pose3Deg {
            x,
            y,
            z: 0.4,
            roll_deg: 0.0,
            pitch_deg: 0.0,
            yaw_deg,
        }
    }

    fn fixed(parent: &str, child: &str, pose: Pose3Deg) -> Transform {
        Transform {
            stamp_ns: 0,
            parent: parent.into(),
            child: child.into(),
            pose: of_degrees(&pose),
        }
    }

    #[test]
    fn unknown_frame_is_refused_unless_named() {
        let frames = BTreeMap::from([("antenna".to_owned(), turned(0.6, 0.0, 0.0))]);
        let body = BodyFrames::new(&frames);
        assert_eq!(body.body(Some("/base_link"), true), Some(Body::Base));
        assert_eq!(body.body(None, true), Some(Body::Base));
        assert!(matches!(
            body.body(Some("/antenna"), true),
            Some(Body::At(_))
        ));
        assert_eq!(body.body(Some("mast"), true), None);
        assert_eq!(body.body(Some(""), true), None);
        let named = body.clone().with_named(&["mast".into()]);
        assert_eq!(named.body(Some("mast"), true), Some(Body::Base));
        let named = body.with_named(&["antenna".into()]);
        assert!(matches!(named.body(None, true), Some(Body::At(_))));
        // The truth without a child frame is that of the base.
        assert_eq!(named.body(None, false), Some(Body::Base));
    }

    /// A mast 0.5 m ahead that is turned by 90 degrees, and an antenna 0.2 m along the mast's x: at (0.5, 0.2).
    #[test]
    fn static_transforms_are_followed_in_both_directions() {
        let mut body = BodyFrames::default();
        body.note_static(&fixed("mast", "antenna", turned(0.2, 0.0, 0.0)));
        body.note_static(&fixed("base_link", "mast", turned(0.5, 0.0, 90.0)));
        body.note_static(&fixed("wheel", "/base_link", turned(-0.3, 0.0, 0.0)));
        body.add_static();
        for (name, [x, y, yaw]) in [
            ("antenna", [0.5, 0.2, core::f64::consts::FRAC_PI_2]),
            ("wheel", [0.3, 0.0, 0.0]),
        ] {
            let [found_x, found_y, found_yaw] = body.place(name).unwrap();
            let apart = [found_x - x, found_y - y, found_yaw - yaw];
            assert!(apart.iter().all(|d| d.abs() < 1e-12), "{name}: {apart:?}");
        }
        assert_eq!(body.place("elsewhere"), None);
    }
}
