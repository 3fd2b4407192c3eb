//! A learnt model for tags of another size, seen by the same camera.

use super::{Cells, Document, ErrorModel};

impl ErrorModel {
    /// Returns the model for tags of another size (m), seen by the camera of the data at the same mount. `lever` is
    /// an upper bound of the distance of the camera from the robot's reference point along the floor. `rise` bounds
    /// the displacement of the camera along the floor by a tilt of the detector's pose: its height above the
    /// reference point times the sine of the largest tilt, 0 for fits on the floor. Both are in metres. `None` if the
    /// model does not state the size of its tags, or a number is impossible.
    ///
    /// A tag that is k times as large has the same image at k times the distance. So at distance d, the angular
    /// errors are those at d / k with the tags of the data, and lengths from tag to camera are k times as wrong. The
    /// robot's reference point is `lever` from the camera, and this length does not grow. With the bounds E (m) and Y
    /// (rad) at d / k, the position error is at most `k E + |1 - k| (Y lever + rise)`, and the yaw error Y. The share
    /// of the observations within both bounds is still [`ErrorModel::coverage`].
    ///
    /// Focal lengths are not scaled: another focal length changes the perspective in the image, and thus the errors
    /// of the angles.
    #[must_use]
    pub fn for_tags_of(&self, size: f64, lever: f64, rise: f64) -> Option<Self> {
        let taken_with = self.document.taken_with.clone()?;
        let k = size / taken_with.tag_size?;
        let is_length = |length: f64| length >= 0.0 && length.is_finite();
        if !(k > 0.0 && k.is_finite() && is_length(lever) && is_length(rise)) {
            return None;
        }
        let mut document = Document {
            taken_with: Some(crate::TakenWith {
                tag_size: Some(size),
                ..taken_with
            }),
            ..self.document.clone()
        };
        let ends = document.region.iter_mut().map(|region| &mut region.d_m);
        let cells = document.cell.iter_mut().map(|cell| &mut cell.d_m);
        for end in ends.chain(cells).flatten() {
            *end *= k;
        }
        for edges in [&mut document.edges, &mut document.p_detect.edges] {
            edges.d_m.iter_mut().for_each(|edge| *edge *= k);
        }
        let cells = Cells::of(&document.edges, self.cells.parts)?;
        let views = match &self.views {
            None => None,
            Some((cells, logits)) => {
                let scaled = Cells::of(&document.p_detect.edges, cells.parts)?;
                Some((scaled, logits.clone()))
            }
        };
        // Between corners the logarithms are linear. The logarithm of a sum is convex, so it is at most the
        // interpolation between the corners.
        let scaled = |[translation, yaw]: &[[f64; 8]; 2]| {
            let moved = |n: usize| {
                let turned = (1.0 - k).abs() * (libm::exp(yaw[n]) * lever + rise);
                libm::log(k * libm::exp(translation[n]) + turned)
            };
            [core::array::from_fn(moved), *yaw]
        };
        let bounds = self.bounds.iter().map(|of| of.as_ref().map(scaled));
        Some(Self {
            bounds: bounds.collect(),
            cells,
            views,
            is_scaled: true,
            document,
        })
    }
}
