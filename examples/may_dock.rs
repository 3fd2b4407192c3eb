//! The lines of the README, compiled and run: `cargo run --features std --example may_dock`.

// readme: begin
use posegate::gate::{Judge, Reason};
use posegate::set::{Estimate, PoseSet};

/// Made by `posegate table build`, kept in flash.
static TABLE: &[u8] = include_bytes!("tables/dock.posegate");

/// Once, at start: the table is checked here. Estimates may be 200 ms old.
fn gate() -> Judge<'static> {
    Judge::new(TABLE, 200).expect("200 ms is a maximum age")
}

/// In every control cycle: x, y, yaw in the map frame; covariance in m^2, m rad, rad^2.
fn may_dock(
    gate: &Judge<'_>,
    estimate: Estimate,
    covariance: [[f64; 3]; 3],
    (now_ms, stamp_ms): (u32, u32),
) -> Result<(), Reason> {
    let set = PoseSet::gaussian(estimate, covariance, gate.radius_squared());
    gate.permits(now_ms, stamp_ms, set)
}
// readme: end

fn main() {
    let gate = gate();
    let at = |x_m| Estimate {
        x_m,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let sure = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];
    let asked = |x_m, covariance, times| may_dock(&gate, at(x_m), covariance, times);
    assert_eq!(asked(0.01, sure, (10, 0)), Ok(()));
    assert_eq!(asked(0.01, sure, (500, 0)), Err(Reason::Stale));
    assert_eq!(asked(0.07, sure, (10, 0)), Err(Reason::NotContained));
    assert_eq!(
        asked(0.01, [[0.0; 3]; 3], (10, 0)),
        Err(Reason::CovarianceZero)
    );
    println!("permitted once, denied three times, as it should be");
}
