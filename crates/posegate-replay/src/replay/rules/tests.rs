use super::*;
use posegate::gate::{Reason, State, Verdict};

fn row(pose: [f64; 3], covariance: [[f64; 3]; 3]) -> Row {
    Row {
        index: 0,
        source: 0,
        t_s: 0.0,
        logged_s: None,
        pose,
        spread: None,
        recorded: Some(Uncertainty::Gaussian(covariance)),
        age: None,
        in_world: true,
        possible: true,
        verdict: Verdict::deny(Reason::Stale),
        is_ambiguous: false,
        examined: true,
        permitted: false,
        state: State::Inhibited(Reason::Silent),
        step: Err(Reason::Silent),
        truth: None,
        since_fix_ms: None,
        against: None,
        rules: [None; 3],
    }
}

fn diagonal([xx, yy, tt]: [f64; 3]) -> [[f64; 3]; 3] {
    [[xx, 0.0, 0.0], [0.0, yy, 0.0], [0.0, 0.0, tt]]
}

#[test]
fn each_rule_checks_only_its_own_limits() {
    let goal = PoseDeg {
        x: 1.0,
        y: 2.0,
        yaw_deg: 0.0,
    };
    let rules = Rules::new(goal);
    let small = diagonal([1e-4; 3]);
    assert_eq!(
        rules.of(&row([1.03, 2.03, 3.0], small)),
        [true; 3].map(Some)
    );
    assert_eq!(
        rules.of(&row([1.04, 2.04, 0.0], small)),
        [false, true, true].map(Some)
    );
    // 0.04 m and 0.09 m: beyond one limit, and 0.27 m to the side.
    let wide = diagonal([16e-4, 81e-4, 1e-4]);
    assert_eq!(
        rules.of(&row([1.0, 2.0, 0.0], wide)),
        [true, false, true].map(Some)
    );
    // To the side 3 * 0.11 m.
    let side = diagonal([16e-4, 121e-4, 1e-4]);
    assert_eq!(
        rules.of(&row([1.0, 2.0, 0.0], side)),
        [true, false, false].map(Some)
    );
    // The same ellipse ahead of the robot.
    let quarter = core::f64::consts::FRAC_PI_2;
    assert_eq!(
        rules.of(&row([1.0, 2.0, quarter], side)),
        [true, false, true].map(Some)
    );
    // Long: 3 * sqrt(0.25) m along the diagonal, in the direction of the robot's heading.
    let long = [[0.13, 0.125, 0.0], [0.125, 0.13, 0.0], [0.0, 0.0, 1e-4]];
    let eighth = core::f64::consts::FRAC_PI_4;
    assert_eq!(
        rules.of(&row([1.0, 2.0, eighth], long)),
        [true, false, false].map(Some)
    );
    let yaw = diagonal([1e-4, 1e-4, 26e-4]);
    assert_eq!(
        rules.of(&row([1.0, 2.0, 0.0], yaw)),
        [true, false, true].map(Some)
    );
}

#[test]
fn zero_covariance_passes_and_nan_does_not() {
    let goal = PoseDeg {
        x: 0.0,
        y: 0.0,
        yaw_deg: 0.0,
    };
    let rules = Rules::new(goal);
    assert_eq!(
        rules.of(&row([0.0; 3], diagonal([0.0; 3]))),
        [Some(true); 3]
    );
    let nan = diagonal([f64::NAN; 3]);
    assert_eq!(rules.of(&row([f64::NAN; 3], nan)), [Some(false); 3]);
    // The ellipse of a negative variance still has a long radius.
    assert_eq!(
        rules.of(&row([0.0; 3], diagonal([-1.0, 1e-4, 1e-4]))),
        [true, false, true].map(Some)
    );
    let mut bare = row([0.0; 3], nan);
    bare.recorded = None;
    assert_eq!(rules.of(&bare), [Some(true), None, None]);
}
