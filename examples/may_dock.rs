//! The lines of the README, compiled and run: `cargo run --example may_dock`.

// readme: begin
use posegate::gate::{Gate, Reason};
use posegate::set::{Estimate, PoseSet};

/// Made by `posegate table build`, kept in flash.
static TABLE: &[u8] = include_bytes!("tables/dock.posegate");

fn may_dock(
    estimate: Estimate,        // x_m, y_m, yaw_rad in the map frame
    covariance: [[f64; 3]; 3], // of x, y, yaw: m^2, m rad, rad^2
    (now_ms, stamp_ms): (u32, u32),
) -> Result<(), Reason> {
    let gate = Gate::new(TABLE, 200).map_err(|_| Reason::Stale)?; // at most 200 ms old
    let set = PoseSet::gaussian(estimate, covariance, gate.radius_squared());
    gate.permits(now_ms, stamp_ms, set)
}
// readme: end

fn main() {
    let at = |x_m| Estimate {
        x_m,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let sure = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
    assert_eq!(may_dock(at(0.01), sure, (10, 0)), Ok(()));
    assert_eq!(may_dock(at(0.01), sure, (500, 0)), Err(Reason::Stale));
    assert_eq!(may_dock(at(0.07), sure, (10, 0)), Err(Reason::NotContained));
    assert_eq!(
        may_dock(at(0.01), [[0.0; 3]; 3], (10, 0)),
        Err(Reason::CovarianceZero)
    );
    println!("permitted once, denied three times, as it should be");
}
