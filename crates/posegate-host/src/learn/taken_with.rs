//! The camera and the tags of detections: a bound is valid only for this camera and these tags.

use serde::{Deserialize, Serialize};

/// The camera and the tags of the detections from which bounds were learnt. Unknown values are not compared.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TakenWith {
    /// The camera's name, for people. Not compared: another site may give it another name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// The focal length along a row, pixels; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fx: Option<f64>,
    /// The focal length along a column, pixels; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fy: Option<f64>,
    /// Width and height of the image, pixels; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image: Option<[f64; 2]>,
    /// The model of the lens, as ROS names it; `none` without distortion. `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens: Option<String>,
    /// The width of the tags, metres: of the border that detectors measure. `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_size: Option<f64>,
    /// The family of the tags, as detectors name it; `None` if unknown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
}

/// The share by which two calibrations of one camera, or two measurements of one tag, may differ.
const EQUAL_WITHIN: f64 = 0.01;

impl TakenWith {
    /// Returns the fault of the description; `None` if it is valid.
    #[must_use]
    pub fn fault(&self) -> Option<&'static str> {
        let numbers = [self.fx, self.fy, self.tag_size];
        let sides = self.image.into_iter().flatten();
        let mut all = numbers.into_iter().flatten().chain(sides);
        all.any(|value| !(value > 0.0 && value.is_finite()))
            .then_some("focal lengths, image and tag size are numbers above 0")
    }

    /// Returns a description of the first difference from another camera or other tags; `None` if all values that
    /// both know are equal.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<String> {
        let number = |name: &str, a: Option<f64>, b: Option<f64>, unit: &str| {
            let (a, b) = (a?, b?);
            ((a - b).abs() > EQUAL_WITHIN * a.abs().max(b.abs()))
                .then(|| format!("{name} {a} {unit}, not {b} {unit}"))
        };
        let text = |name: &str, a: &Option<String>, b: &Option<String>| {
            let (a, b) = (a.as_ref()?, b.as_ref()?);
            (a != b).then(|| format!("{name} {a}, not {b}"))
        };
        let image = || {
            let (a, b) = (self.image?, other.image?);
            (a != b).then(|| {
                format!(
                    "images of {} x {} px, not {} x {} px",
                    a[0], a[1], b[0], b[1]
                )
            })
        };
        number("fx", self.fx, other.fx, "px")
            .or_else(|| number("fy", self.fy, other.fy, "px"))
            .or_else(image)
            .or_else(|| text("a lens of the model", &self.lens, &other.lens))
            .or_else(|| number("tags of", self.tag_size, other.tag_size, "m"))
            .or_else(|| text("tags of the family", &self.family, &other.family))
    }
}
