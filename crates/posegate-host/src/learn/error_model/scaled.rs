//! A learnt model for tags of another size, seen by the same camera.

use super::{Cells, Document, ErrorModel};

impl ErrorModel {
    /// Returns the model for tags of another size (m), seen by the camera of the data at the same mount. `lever` is the distance of
    /// the camera from the robot's reference point along the floor, and `rise` how far a lean of the detector's pose moves the camera
    /// along the floor: its height above the reference point times the sine of the largest lean, 0 for fits on the floor; both in
    /// metres, or more. `None` if the model does not state the size of its tags, or a number is impossible.
    ///
    /// A tag that is k times as large has the same image at k times the distance. So at the distance d the detector errs as it
    /// does at d / k with the tags of the data: by the same angles, and by k times the length from tag to camera. The
    /// robot's reference point is `lever` from the camera, and this length does not grow: with the bounds E (m) and Y
    /// (rad) at d / k, the position errs by at most `k E + |1 - k| (Y lever + rise)`, and the yaw by Y. The share of the observations
    /// for which both bounds hold is still [`ErrorModel::coverage`].
    ///
    /// Focal lengths are not scaled: another one changes the perspective in the image, and so the errors of the angles.
    #[must_use]
    pub fn for_tags_of(&self, size: f64, lever: f64, rise: f64) -> Option<Self> {
        let taken_with = self.document.taken_with.clone()?;
        let k = size / taken_with.tag_size?;
        let is_length = |length: f64| length >= 0.0 && length.is_finite();
        if !(k > 0.0 && k.is_finite() && is_length(lever) && is_length(rise)) {
            return None;
        }
        let mut document = Document {
            taken_with: Some(crate::learn::TakenWith {
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
        // Between corners the logarithms are linear. That of a sum is convex, so it is at most what its corners give.
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
