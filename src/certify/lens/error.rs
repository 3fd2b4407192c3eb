//! Why a camera has no proven view.

/// Why a calibration cannot be used, with the numbers involved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LensError {
    /// A number that is not finite, or out of its range.
    #[error("{what} is {value}")]
    Number {
        /// Name of the number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The region of interest reaches beyond the image.
    #[error("the roi reaches to ({right} px, {bottom} px), the image to ({width} px, {height} px)")]
    Roi {
        /// Right end of the region, pixels.
        right: f64,
        /// Lower end of the region, pixels.
        bottom: f64,
        /// The image's width, pixels.
        width: f64,
        /// The image's height, pixels.
        height: f64,
    },
    /// The border is as large as the image.
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
    /// The distortion maps two rays to one pixel of the image.
    #[error(
        "the distortion folds at {fold_px:.1} px from the optical axis, the image reaches {image_px:.1} px"
    )]
    Folds {
        /// Distance of the fold from the optical axis, pixels.
        fold_px: f64,
        /// Largest distance of the image's border from the optical axis, pixels.
        image_px: f64,
    },
    /// The detector's image contains no point that the lens maps into the raw image.
    #[error(
        "the image shows nothing that is within {field:.3} of the optical axis (the tangent of the angle)"
    )]
    Nothing {
        /// Radius of the field: a tangent.
        field: f64,
    },
    /// No window was proven.
    #[error("no window of the image could be proven")]
    Unproven,
}
