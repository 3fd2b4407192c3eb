//! The sight record of a visibility set: the site's numbers to the nearest unit.

use crate::shape::{Lens, Resolved, SuccessSet, WORLD};
use crate::table::{EDGE_BITS, PIXEL_BITS, SightRecord};

/// Returns the record of a set that is one camera's visibility of one tag. `None` for other sets, and if
/// a number is out of a record's range (for example a tag seen from more than 100 m): then the table has
/// no record.
#[must_use]
pub fn sight_record(success: &SuccessSet) -> Option<SightRecord> {
    let set = success.shape.visibility()?;
    // The controller supports only pinholes.
    if set.camera.lens() != Lens::Pinhole {
        return None;
    }
    let Resolved {
        centre,
        corners,
        normal,
        mount,
        axes,
        cos_phi,
        cos_psi,
        ..
    } = set.resolve::<f64>(WORLD);
    let scaled = |value: f64, unit: f64| {
        let nearest = libm::round(value * unit);
        let fits = nearest >= f64::from(i32::MIN) && nearest <= f64::from(i32::MAX);
        fits.then_some(nearest as i32)
    };
    let all = |[x, y, z]: [f64; 3], unit: f64| {
        Some([scaled(x, unit)?, scaled(y, unit)?, scaled(z, unit)?])
    };
    let pixels = |value: f64| scaled(value, f64::from(1 << PIXEL_BITS));
    let um = |value: f64| scaled(value, 1e6);
    let q30 = f64::from(1 << 30);
    let camera = set.camera;
    // Half of the vector from one corner to its neighbour.
    let half = |from: [f64; 3], to: [f64; 3]| {
        let half = [0, 1, 2].map(|axis| 0.5 * (to[axis] - from[axis]));
        all(half, 1e6 * f64::from(1 << EDGE_BITS))
    };
    // The axes of the camera's frame m, forward, left, up, are the columns of `axes`.
    let [forward, left, up] = [0, 1, 2].map(|column| axes.map(|row| row[column]));
    let record = SightRecord {
        tag: set.tag.id,
        focal: [pixels(camera.fx)?, pixels(camera.fy)?],
        centre: [pixels(camera.cx)?, pixels(camera.cy)?],
        image: [pixels(camera.width_px)?, pixels(camera.height_px)?],
        z_near: um(set.z_near)?,
        d_max: um(set.d_max)?,
        cos_phi: scaled(cos_phi, q30)?,
        cos_psi: scaled(cos_psi, q30)?,
        camera: all(mount, 1e6)?,
        axes: [
            all(left.map(|v| -v), q30)?,
            all(up.map(|v| -v), q30)?,
            all(forward, q30)?,
        ],
        middle: all(centre, 1e6)?,
        half_right: half(corners[0], corners[1])?,
        half_up: half(corners[1], corners[2])?,
        normal: all(normal, q30)?,
    };
    record.is_valid().then_some(record)
}
