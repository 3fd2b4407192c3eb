//! A camera's image as its detector reads it.

use super::{Lens, Window};

/// The image that a camera's detector reads, pixels. The numbers include region of interest and binning.
///
/// A point at (X, Y, Z) in the camera's optical frame, Z > 0, is seen at `u = fx x + cx`, `v = fy y + cy`
/// with `(x, y) = distort(X/Z, Y/Z)` ([`Camera::lens`]), if it lies in [`Camera::view`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Image width, pixels.
    pub width_px: f64,
    /// Image height, pixels.
    pub height_px: f64,
    /// Focal length along a row, pixels.
    pub fx: f64,
    /// Focal length along a column, pixels.
    pub fy: f64,
    /// Column of the optical axis, pixels.
    pub cx: f64,
    /// Row of the optical axis, pixels.
    pub cy: f64,
    /// A lens, or a window smaller than the image; `None` for the whole image of a pinhole.
    pub(super) sighted: Option<Sighted>,
}

/// The proven lens and window of a camera, and the numbers for which they were proven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sighted {
    pub(super) lens: Lens,
    pub(super) window: Window,
    pub(super) edge: Edge,
    pub(super) numbers: [f64; 6],
}

/// The exact limits of an image through a lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// The largest distance of a normalised point from the optical axis at which the lens is one-to-one.
    pub field: f64,
    /// Width of the border that is excluded from the image, pixels.
    pub border_px: f64,
}

impl Camera {
    /// Creates a pinhole camera that sees in its whole image: width and height, focal lengths, and the
    /// position of the optical axis, each along a row and along a column, pixels.
    #[must_use]
    pub const fn pinhole(size_px: [f64; 2], focal_px: [f64; 2], axis_px: [f64; 2]) -> Self {
        Self {
            width_px: size_px[0],
            height_px: size_px[1],
            fx: focal_px[0],
            fy: focal_px[1],
            cx: axis_px[0],
            cy: axis_px[1],
            sighted: None,
        }
    }

    /// Returns the same image through a lens, with the window that was proven for it.
    pub(crate) const fn through(self, lens: Lens, window: Window, edge: Edge) -> Self {
        Self {
            sighted: Some(Sighted {
                lens,
                window,
                edge,
                numbers: self.numbers(),
            }),
            ..self
        }
    }

    /// Returns how far within the image a normalised point is seen through the lens, pixels: negative
    /// outside, and if the lens is not one-to-one at the point. `None` for images without a lens.
    pub(crate) fn within_px(&self, point: [f64; 2]) -> Option<f64> {
        let Edge { field, border_px } = self.sighted.filter(|s| s.lens != Lens::Pinhole)?.edge;
        let away = libm::hypot(point[0], point[1]);
        if away > field {
            return Some(self.fx * (field - away));
        }
        let [u, v] = self.project(point);
        let slacks = [u, self.width_px - u, v, self.height_px - v];
        Some(slacks.into_iter().fold(f64::INFINITY, f64::min) - border_px)
    }

    const fn numbers(&self) -> [f64; 6] {
        [
            self.width_px,
            self.height_px,
            self.fx,
            self.fy,
            self.cx,
            self.cy,
        ]
    }

    /// Returns the lens through which the image is taken; [`Lens::Pinhole`] for rectified images.
    #[must_use]
    pub const fn lens(&self) -> Lens {
        match self.sighted {
            Some(sighted) => sighted.lens,
            None => Lens::Pinhole,
        }
    }

    /// Returns `true` for a pinhole camera that sees in its whole image: width, height, focal lengths and
    /// axis define it completely.
    #[must_use]
    pub const fn is_whole_pinhole(&self) -> bool {
        self.sighted.is_none()
    }

    /// Returns the normalised points that are certain to be seen: they lie in the image, and the lens is
    /// one-to-one on them. Empty if the camera's numbers have changed since they were proven.
    #[must_use]
    pub fn view(&self) -> Window {
        match self.sighted {
            None => Window::of_pinhole(self, 0.0),
            Some(sighted) if sighted.numbers == self.numbers() => sighted.window,
            Some(_) => Window::EMPTY,
        }
    }

    /// Returns the position of a normalised point (X/Z, Y/Z) in the image, pixels, whether or not it is seen
    /// there. In plain floats: within 1e-9 px.
    #[must_use]
    pub fn project(&self, point: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.lens().distort(point);
        [self.fx * x + self.cx, self.fy * y + self.cy]
    }
}

impl Window {
    /// Creates the image of a pinhole camera without a border of `border_px` pixels on each side: left,
    /// right, top, bottom. If a difference is not an exact `f64`, the plane is rounded inwards.
    pub(crate) fn of_pinhole(camera: &Camera, border_px: f64) -> Self {
        let (left, top) = (below(camera.cx, border_px), below(camera.cy, border_px));
        let right = below(below(camera.width_px, camera.cx), border_px);
        let bottom = below(below(camera.height_px, camera.cy), border_px);
        Self::of_planes(&[
            [camera.fx, 0.0, left],
            [-camera.fx, 0.0, right],
            [0.0, camera.fy, top],
            [0.0, -camera.fy, bottom],
        ])
    }
}

/// Returns `a - b`, rounded down if it is not an exact `f64`.
fn below(a: f64, b: f64) -> f64 {
    let difference = a - b;
    // The rounding error, exactly (Knuth's two-sum).
    let back = difference - a;
    let lost = (a - (difference - back)) - (b + back);
    if lost < 0.0 {
        difference.next_down()
    } else {
        difference
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera::pinhole([640.0, 480.0], [615.0, 610.0], [321.5, 240.25]);

    #[test]
    fn a_pinhole_sees_its_image() {
        let view = CAMERA.view();
        assert_eq!(
            view.planes(),
            [
                [615.0, 0.0, 321.5],
                [-615.0, 0.0, 318.5],
                [0.0, 610.0, 240.25],
                [0.0, -610.0, 239.75],
            ]
        );
        assert_eq!(CAMERA.project([0.1, -0.2]), [383.0, 118.25]);
        assert!(view.contains([0.5, -0.35]) && !view.contains([0.52, 0.0]));
    }

    #[test]
    fn window_of_changed_camera_is_empty() {
        let half = Window::of_pinhole(&CAMERA, 100.0);
        let mut camera = CAMERA.through(
            Lens::Pinhole,
            half,
            Edge {
                field: f64::INFINITY,
                border_px: 100.0,
            },
        );
        assert_eq!(camera.view(), half);
        camera.fx = 614.0;
        assert!(!camera.view().contains([0.0, 0.0]));
    }

    #[test]
    fn differences_round_down() {
        assert_eq!(below(640.0, 320.0), 320.0);
        // 2^53 + 2 - (1 + 2^-52): below 2^53 + 1, which is halfway.
        assert_eq!(
            below(9_007_199_254_740_994.0, 1.0f64.next_up()),
            9_007_199_254_740_992.0
        );
        assert_eq!(below(1.0, 1e-20), 1.0f64.next_down());
        assert_eq!(below(1.0, -1e-20), 1.0);
    }
}
