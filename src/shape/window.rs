//! The normalised points that a camera is certain to see.

use core::fmt;

/// A convex polygon of normalised points (X/Z, Y/Z): those with `a x + b y + c >= 0` for each of its
/// planes `[a, b, c]`.
///
/// In space a plane is the half-space `a X + b Y + c Z >= 0` of the camera's optical frame.
#[derive(Clone, Copy, PartialEq)]
pub struct Window {
    planes: [[f64; 3]; Self::MOST],
    count: usize,
}

impl Window {
    /// Largest number of planes of a window; each costs a facet.
    pub const MOST: usize = 16;

    /// The empty window.
    pub const EMPTY: Self = {
        let mut planes = [[0.0; 3]; Self::MOST];
        planes[0] = [0.0, 0.0, -1.0];
        Self { planes, count: 1 }
    };

    /// Creates the window of the points with `a x + b y + c >= 0` for every plane. Empty if there are no planes
    /// or too many, or if one of their numbers is not finite.
    #[must_use]
    pub fn of_planes(planes: &[[f64; 3]]) -> Self {
        let sound = planes.iter().flatten().all(|number| number.is_finite());
        let mut window = Self {
            planes: [[0.0; 3]; Self::MOST],
            count: planes.len(),
        };
        match window.planes.get_mut(..planes.len()) {
            Some(own) if sound && !planes.is_empty() => own.copy_from_slice(planes),
            _ => return Self::EMPTY,
        }
        window
    }

    /// Returns the planes `[a, b, c]`, at least one.
    #[must_use]
    pub fn planes(&self) -> &[[f64; 3]] {
        &self.planes[..self.count]
    }

    /// Returns `true` if the window contains a point; in plain floats.
    #[must_use]
    pub fn contains(&self, [x, y]: [f64; 2]) -> bool {
        self.planes()
            .iter()
            .all(|[a, b, c]| a * x + b * y + c >= 0.0)
    }
}

impl fmt::Debug for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.planes()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_planes_give_an_empty_window() {
        for planes in [&[][..], &[[0.0, 0.0, 1.0]; 17], &[[f64::NAN, 0.0, 1.0]]] {
            assert_eq!(Window::of_planes(planes), Window::EMPTY);
        }
        let all = Window::of_planes(&[[0.0, 0.0, 1.0]; 16]);
        assert!(all.contains([1e9, -1e9]) && all.planes().len() == 16);
        assert!(!Window::EMPTY.contains([0.0, 0.0]));
    }
}
