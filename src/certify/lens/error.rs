//! Why a camera has no proven view.

/// A calibration that cannot be used, with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LensError {
    /// A number that is not finite, or out of its range.
    #[error("{what} is {value}")]
    Number {
        /// Which.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// The region of interest reaches beyond the image.
    #[error("the roi reaches to ({right} px, {bottom} px), the image to ({width} px, {height} px)")]
    Roi {
        /// Column of its end.
        right: f64,
        /// Row of its end.
        bottom: f64,
        /// The image's width.
        width: f64,
        /// The image's height.
        height: f64,
    },
    /// The border takes the whole image.
    #[error("a border of {border_px} px leaves nothing of an image of {width} x {height} px")]
    Border {
        /// The border, pixels.
        border_px: f64,
        /// The image's width, pixels.
        width: f64,
        /// The image's height, pixels.
        height: f64,
    },
    /// The distortion is one-to-one nowhere around the optical axis.
    #[error("the distortion folds at the optical axis")]
    NoField,
    /// The distortion takes two rays to one pixel of the image.
    #[error(
        "the distortion folds at {fold_px:.1} px from the optical axis, the image reaches {image_px:.1} px"
    )]
    Folds {
        /// Where, pixels from the optical axis towards the corner that is meant.
        fold_px: f64,
        /// How far that corner is, pixels.
        image_px: f64,
    },
    /// The detector's image shows nothing that the lens puts into the raw one.
    #[error(
        "the image shows nothing that is within {field:.3} of the optical axis (the tangent of the angle)"
    )]
    Nothing {
        /// The field's radius.
        field: f64,
    },
    /// No window was proven.
    #[error("no window of the image could be proven")]
    Unproven,
}
