//! From a calibration to a camera with a proven window.

use super::LensError;
use super::field::FARTHEST;
use super::inner::solid_angle;
use super::proof::Region;
use crate::shape::{Camera, Edge, Lens, Window, edges};

/// The image that a detector reads.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Image {
    /// The image as it comes from the sensor, through the lens.
    Raw,
    /// The rectified image, a pinhole's: fx, fy, cx, cy of the projection matrix P, pixels of the whole
    /// image. Its axes are the raw camera's (the rectification matrix R is the identity).
    Rect([f64; 4]),
}

/// A part of the sensor, in pixels of the whole image without binning (ROS's RegionOfInterest).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Roi {
    /// First column.
    pub x_offset: u32,
    /// First row.
    pub y_offset: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The calibration of a camera, and the part of the image that its detector reads.
///
/// As in the ROS message CameraInfo, the region of interest is applied first and binning after it: a point at
/// column u of the whole image, raw or rectified, is at `(u - x_offset) / binning_x`, to the nearest `f64`. (As
/// in ROS's image_geometry; a rectified part of an image shows the same as the raw part.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Width and height of the whole image, pixels.
    pub size_px: [f64; 2],
    /// Focal lengths of the raw image along a row and a column (of K), pixels.
    pub focal_px: [f64; 2],
    /// Column and row of the optical axis in the raw image (of K), pixels.
    pub axis_px: [f64; 2],
    /// The lens.
    pub lens: Lens,
    /// The image that is read.
    pub image: Image,
    /// The part of the image that is read; `None` for all.
    pub roi: Option<Roi>,
    /// Number of columns and rows that are combined into one, at least 1.
    pub binning: [u32; 2],
    /// Width of the border that is excluded from the image that is read (and from the raw image from which it is
    /// made), pixels, at least 0.
    pub border_px: f64,
}

/// A camera with its proven window, field and coverage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CertifiedCamera {
    /// The camera: the image that the detector reads.
    pub camera: Camera,
    /// Radius of the normalised points on which the lens is proven to be one-to-one; infinite for a pinhole.
    pub field: f64,
    /// The window's solid angle over that of everything that is seen (in the field, and visible from the middle
    /// of the image). No convex polygon can contain the rest. A measure in plain floats: within 1e-3.
    pub kept: f64,
}

/// Largest number of refinements of an outline where the polygon leaves the region.
const REFINEMENTS: u32 = 4;

/// The polygon is shrunk towards its middle by this share, then by twice as much, until it is proven.
const FIRST_SHRINK: f64 = 1e-6;

/// Number of shrinkings before a window counts as not proven: up to 6.6 %.
const SHRINKS: i32 = 17;

impl CertifiedCamera {
    /// Chooses a window and proves it (see [`crate::certify`]): each of its points is in the field and is mapped
    /// to at least `border_px` within the raw image, and within the rectified image if the detector reads that.
    /// Takes some milliseconds.
    ///
    /// # Errors
    /// [`LensError`] if a number is out of range, the lens folds within the image, or no visible point remains.
    pub fn of(calibration: &Calibration) -> Result<Self, LensError> {
        check(calibration)?;
        let raw = Part::of(calibration)?;
        let border_px = calibration.border_px;
        let whole = |camera: Camera| {
            let seen = if border_px == 0.0 {
                camera
            } else {
                camera.through(
                    Lens::Pinhole,
                    Window::of_pinhole(&camera, border_px),
                    Edge {
                        field: f64::INFINITY,
                        border_px,
                    },
                )
            };
            Self {
                camera: seen,
                field: f64::INFINITY,
                kept: 1.0,
            }
        };
        let raw_camera = raw.camera(calibration.focal_px, calibration.axis_px);
        let rect_camera = match calibration.image {
            Image::Raw => None,
            Image::Rect([fx, fy, cx, cy]) => Some(raw.camera([fx, fy], [cx, cy])),
        };
        let same = rect_camera.is_none_or(|rect| rect == raw_camera);
        if calibration.lens == Lens::Pinhole && same {
            return Ok(whole(raw_camera));
        }
        let mut region = Region {
            lens: calibration.lens,
            field: calibration.lens.field()?.min(FARTHEST),
            raw: raw_camera,
            rect: None,
            border_px,
        };
        let edge = Edge {
            field: region.field,
            border_px,
        };
        let Some(rect) = rect_camera else {
            region.refuse_folds()?;
            let (window, kept) = region.window()?;
            return Ok(Self {
                camera: raw_camera.through(region.lens, window, edge),
                field: region.field,
                kept,
            });
        };
        let planes = Window::of_pinhole(&rect, border_px);
        let [left, right, top, bottom] = *planes.planes() else {
            return Err(LensError::Unproven);
        };
        region.rect = Some([left, right, top, bottom]);
        region.refuse_ghosts(&rect)?;
        // If the raw image fills the rectified one, all of that is seen.
        let raw_alone = Region {
            rect: None,
            ..region
        };
        if raw_alone.holds(&[left, top, right, bottom]) {
            return Ok(Self {
                field: region.field,
                ..whole(rect)
            });
        }
        let (window, kept) = region.window()?;
        Ok(Self {
            camera: rect.through(Lens::Pinhole, window, edge),
            field: region.field,
            kept,
        })
    }
}

impl Region {
    /// Returns a proven window, and its solid angle over the outline's.
    fn window(&self) -> Result<(Window, f64), LensError> {
        let nothing = LensError::Nothing { field: self.field };
        let mut outline = self.outline().ok_or(nothing)?;
        let mut polygon = outline.inner();
        for _ in 0..REFINEMENTS {
            if !self.refine(&mut outline, &polygon) {
                break;
            }
            polygon = outline.inner();
        }
        if polygon.len() < 3 {
            return Err(nothing);
        }
        let count = polygon.len() as f64;
        let middle = [0, 1].map(|axis| polygon.iter().map(|p| p[axis]).sum::<f64>() / count);
        for doublings in 0..SHRINKS {
            let share = 1.0 - libm::ldexp(FIRST_SHRINK, doublings);
            let smaller: Vec<[f64; 2]> = polygon
                .iter()
                .map(|p| [0, 1].map(|axis| middle[axis] + share * (p[axis] - middle[axis])))
                .collect();
            let planes = planes(&smaller);
            if self.holds(&planes) {
                let kept = solid_angle(&smaller) / outline.solid_angle();
                return Ok((Window::of_planes(&planes), kept));
            }
        }
        Err(LensError::Unproven)
    }

    /// Returns an error if the raw image reaches beyond a fold of its lens.
    fn refuse_folds(&self) -> Result<(), LensError> {
        if self.field >= FARTHEST {
            return Ok(());
        }
        let corners = self.corners_px().into_iter();
        let missed = corners.filter(|corner| self.lift(*corner).is_none());
        let axis = [self.raw.cx, self.raw.cy];
        let from_axis = |[u, v]: [f64; 2]| libm::hypot(u - axis[0], v - axis[1]);
        match missed.max_by(|a, b| from_axis(*a).total_cmp(&from_axis(*b))) {
            None => Ok(()),
            Some(corner) => {
                // Towards that corner, as far as the field reaches.
                let direction = [
                    (corner[0] - axis[0]) / self.raw.fx,
                    (corner[1] - axis[1]) / self.raw.fy,
                ];
                let length = libm::hypot(direction[0], direction[1]);
                let end = self.project(direction.map(|part| part / length * self.field));
                Err(LensError::Folds {
                    fold_px: from_axis(end),
                    image_px: from_axis(corner),
                })
            }
        }
    }

    /// Returns an error if the rectified image shows points of the raw one twice, beyond a fold of its lens.
    fn refuse_ghosts(&self, rect: &Camera) -> Result<(), LensError> {
        const ALONG: u32 = 64;
        if self.field >= FARTHEST {
            return Ok(());
        }
        let endless = Self {
            field: f64::INFINITY,
            ..*self
        };
        let mut worst: Option<LensError> = None;
        for step in 0..=ALONG {
            let share = f64::from(step) / f64::from(ALONG);
            let (u, v) = (share * rect.width_px, share * rect.height_px);
            for [u, v] in [[u, 0.0], [u, rect.height_px], [0.0, v], [rect.width_px, v]] {
                let point = [(u - rect.cx) / rect.fx, (v - rect.cy) / rect.fy];
                let radius = libm::hypot(point[0], point[1]);
                let ghost = Self {
                    rect: None,
                    ..endless
                };
                if radius > self.field && ghost.contains(point) {
                    let image_px = libm::hypot(u - rect.cx, v - rect.cy);
                    let found = LensError::Folds {
                        fold_px: image_px * self.field / radius,
                        image_px,
                    };
                    let farther = match worst {
                        Some(LensError::Folds {
                            image_px: known, ..
                        }) => image_px > known,
                        _ => true,
                    };
                    if farther {
                        worst = Some(found);
                    }
                }
            }
        }
        worst.map_or(Ok(()), Err)
    }
}

/// Returns the planes of a polygon's edges, counter-clockwise.
fn planes(polygon: &[[f64; 2]]) -> Vec<[f64; 3]> {
    edges(polygon)
        .map(|[[ax, ay], [bx, by]]| {
            let (dx, dy) = (bx - ax, by - ay);
            let length = libm::hypot(dx, dy);
            let (a, b) = (-dy / length, dx / length);
            [a, b, -(a * ax + b * ay)]
        })
        .collect()
}

/// The part of the sensor that is read, and its binning.
struct Part {
    offset: [f64; 2],
    binning: [f64; 2],
    size_px: [f64; 2],
}

impl Part {
    fn of(calibration: &Calibration) -> Result<Self, LensError> {
        let [width, height] = calibration.size_px;
        let whole = Roi {
            x_offset: 0,
            y_offset: 0,
            width: 0,
            height: 0,
        };
        let roi = calibration.roi.filter(|roi| *roi != whole);
        let (offset, size) = match roi {
            None => ([0.0, 0.0], [width, height]),
            Some(roi) => (
                [roi.x_offset, roi.y_offset].map(f64::from),
                [roi.width, roi.height].map(f64::from),
            ),
        };
        let (right, bottom) = (offset[0] + size[0], offset[1] + size[1]);
        if right > width || bottom > height {
            return Err(LensError::Roi {
                right,
                bottom,
                width,
                height,
            });
        }
        let binning = calibration.binning.map(f64::from);
        let size_px = [0, 1].map(|axis| libm::floor(size[axis] / binning[axis]));
        let border_px = calibration.border_px;
        if size_px.iter().any(|size| !(2.0 * border_px < *size)) {
            let [width, height] = size_px;
            return Err(LensError::Border {
                border_px,
                width,
                height,
            });
        }
        Ok(Self {
            offset,
            binning,
            size_px,
        })
    }

    /// Returns the camera of this part, from the numbers of the whole image.
    fn camera(&self, focal_px: [f64; 2], axis_px: [f64; 2]) -> Camera {
        Camera::pinhole(
            self.size_px,
            [0, 1].map(|axis| focal_px[axis] / self.binning[axis]),
            [0, 1].map(|axis| (axis_px[axis] - self.offset[axis]) / self.binning[axis]),
        )
    }
}

/// Checks that all numbers are finite and in their ranges.
fn check(calibration: &Calibration) -> Result<(), LensError> {
    let Calibration {
        size_px: [width, height],
        focal_px: [fx, fy],
        axis_px: [cx, cy],
        border_px,
        ..
    } = *calibration;
    let rect = match calibration.image {
        Image::Raw => [fx, fy, cx, cy],
        Image::Rect(rect) => rect,
    };
    let above_0 = |number: f64| number.is_finite() && number > 0.0;
    let [first, second] = calibration.binning.map(f64::from);
    let numbers = [
        ("the image's width", width, above_0(width)),
        ("the image's height", height, above_0(height)),
        ("fx", fx, above_0(fx)),
        ("fy", fy, above_0(fy)),
        ("cx", cx, cx.is_finite()),
        ("cy", cy, cy.is_finite()),
        ("fx of the rectified image", rect[0], above_0(rect[0])),
        ("fy of the rectified image", rect[1], above_0(rect[1])),
        ("cx of the rectified image", rect[2], rect[2].is_finite()),
        ("cy of the rectified image", rect[3], rect[3].is_finite()),
        (
            "border_px",
            border_px,
            border_px.is_finite() && border_px >= 0.0,
        ),
        ("binning_x", first, first >= 1.0),
        ("binning_y", second, second >= 1.0),
    ];
    match numbers.into_iter().find(|(_, _, sound)| !sound) {
        Some((what, value, _)) => Err(LensError::Number { what, value }),
        None => Ok(()),
    }
}
