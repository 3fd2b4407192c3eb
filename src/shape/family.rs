//! Families of tags.

/// Printed properties of a family of AprilTags.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Family {
    /// Name that detectors use.
    pub name: &'static str,
    /// Number of tags: valid tag numbers are below it.
    pub tags: u32,
    /// Width of the printed tag with its white border, in widths of the border that detectors measure (the `size` of
    /// site files).
    pub whole: f64,
}

/// The families of the AprilTag library (`ncodes`, `total_width`, `width_at_border` of its sources).
const FAMILIES: [Family; 9] = [
    of("tag16h5", 30, 8.0 / 6.0),
    of("tag25h9", 35, 9.0 / 7.0),
    of("tag36h10", 2_320, 10.0 / 8.0),
    of("tag36h11", 587, 10.0 / 8.0),
    of("tagCircle21h7", 38, 9.0 / 5.0),
    of("tagCircle49h12", 65_535, 11.0 / 5.0),
    of("tagCustom48h12", 42_211, 10.0 / 6.0),
    of("tagStandard41h12", 2_115, 9.0 / 5.0),
    of("tagStandard52h13", 48_714, 10.0 / 6.0),
];

const fn of(name: &'static str, tags: u32, whole: f64) -> Family {
    Family { name, tags, whole }
}

impl Family {
    /// The largest [`Family::whole`], for unknown families.
    pub const WIDEST: f64 = 11.0 / 5.0;

    /// Returns a family of the AprilTag library by its name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        FAMILIES.into_iter().find(|family| family.name == name)
    }

    /// Returns the width of a printed tag of a named family with its white border, in units of its size. For an unknown
    /// family returns the largest width.
    #[must_use]
    pub fn whole_of(name: &str) -> f64 {
        Self::named(name).map_or(Self::WIDEST, |family| family.whole)
    }
}
