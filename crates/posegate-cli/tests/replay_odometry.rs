//! `posegate replay --odom FILE`: fixes that come twice a second are carried along an odometry, and a faulty file is refused with its line.

use posegate_testkit::run::{Case, Ended, cases};
use serde_json::Value;

const SITE: &str = include_str!("../../../examples/sites/dock.toml");
const ESTIMATES: &str = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n";
const ODOMETRY: &str = "t_s,x_m,y_m,yaw_rad\n";
const MOVING: &str = "--odom odom.csv --max-speed 0.1 --max-yaw-rate 5";

/// Replays fixes with a standard deviation of 1 mm and 0.001 rad, one `t_s x_m` each, and an odometry.
fn replay(fixes: &[(f64, f64)], odometry: &[u8], arguments: &str) -> Ended {
    let rows = fixes
        .iter()
        .map(|(t, x)| format!("{t},{x},0,0,1e-6,0,0,1e-6,0,1e-6\n"));
    let text = ESTIMATES.to_string() + &rows.collect::<String>();
    let case = Case::new(&[
        ("site.toml", SITE.as_bytes()),
        ("log.csv", text.as_bytes()),
        ("odom.csv", odometry),
    ]);
    case.run(&format!(
        "replay site.toml log.csv --task dock --json {arguments}"
    ))
}

/// The place of a robot that drives at 0.05 m/s through the middle of the dock.
fn place(t_s: f64) -> f64 {
    0.05 * (t_s - 3.0)
}

fn fixes() -> Vec<(f64, f64)> {
    (0..12)
        .map(|k| 0.5 * f64::from(k))
        .map(|t| (t, place(t)))
        .collect()
}

/// The odometry of that robot at 50 Hz, in a turned and displaced frame.
fn driven() -> Vec<(f64, [f64; 3])> {
    let (sin, cos) = 2.0f64.sin_cos();
    let pose = |t: f64| [7.0 + cos * place(t), -3.0 + sin * place(t), 2.0];
    (0..300)
        .map(|k| 0.02 * f64::from(k))
        .map(|t| (t, pose(t)))
        .collect()
}

fn csv(poses: &[(f64, [f64; 3])]) -> String {
    let rows = poses
        .iter()
        .map(|(t, [x, y, yaw])| format!("{t},{x},{y},{yaw}\n"));
    ODOMETRY.to_string() + &rows.collect::<String>()
}

fn tum(poses: &[(f64, [f64; 3])]) -> String {
    let rows = poses.iter().map(|(t, [x, y, yaw])| {
        let (z, w) = (0.5 * yaw).sin_cos();
        format!("{t} {x} {y} 0 0 0 {z} {w}\n")
    });
    rows.collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn odometry_file_keeps_the_interlock_open_between_fixes() {
    let without = replay(&fixes(), b"", "--max-speed 0.1 --max-yaw-rate 5").json(0);
    assert_eq!(without["interlock"]["openings"], 0, "{without}");
    let with = replay(&fixes(), csv(&driven()).as_bytes(), MOVING).json(0);
    let interlock = &with["interlock"];
    assert_eq!(interlock["openings"], 1, "{interlock}");
    // The dock is 16 cm long: 3.2 s, less the sets, the slip and the allowed drive until a permission ends.
    assert!(number(&interlock["open_s"]) > 1.5, "{interlock}");
    assert!(number(&interlock["open_s"]) < 3.1, "{interlock}");
    let of_tum = replay(&fixes(), tum(&driven()).as_bytes(), MOVING).json(0);
    let differ = number(&of_tum["interlock"]["open_s"]) - number(&interlock["open_s"]);
    assert!(differ.abs() < 0.05, "{differ}");
}

/// No fix comes after half a second, and by the odometry the robot leaves the dock.
#[test]
fn interlock_closes_when_the_odometry_leaves_the_dock() {
    let fixes = [(2.5, place(2.5)), (3.0, place(3.0)), (12.0, 0.5)];
    let stays: Vec<_> = driven().into_iter().filter(|(t, _)| *t >= 2.0).collect();
    let leaves: Vec<_> = stays
        .iter()
        .map(|(t, [x, y, yaw])| {
            let away = 0.04 * (t - 3.0).max(0.0);
            (*t, [x + yaw.cos() * away, y + yaw.sin() * away, *yaw])
        })
        .collect();
    let open = |poses: &[(f64, [f64; 3])]| {
        let summary = replay(&fixes, csv(poses).as_bytes(), MOVING).json(0);
        let interlock = &summary["interlock"];
        assert!(
            interlock["shut_s_by"]["not_contained"].is_f64(),
            "{interlock}"
        );
        number(&interlock["open_s"])
    };
    // From the middle it has 8 cm, less the sets, the slip and the allowed drive.
    let (stays, leaves) = (open(&stays), open(&leaves));
    assert!(stays > leaves + 0.4 && leaves > 0.4, "{stays} {leaves}");
}

/// Each fault is reported with the file, its line, and what was expected.
#[test]
fn faulty_odometry_is_refused_with_its_line() {
    let good = "0.00,0,0,0\n0.02,0,0,0\n0.04,0,0,0\n";
    let file = |header: &str, rows: &str| format!("{header}{rows}").into_bytes();
    let with_row = |row: &str| file(ODOMETRY, &format!("{good}{row}\n"));
    for (odometry, words) in [
        (
            file("t_s,x_m,y_m\n", "0,0,0\n"),
            &[
                "odom.csv:1:1",
                "no column `yaw_rad`",
                "expected a header with",
            ][..],
        ),
        (
            file("x_m,y_m,yaw_rad\n", "0,0,0\n"),
            &["odom.csv:1:1", "no column `t_s`", "expected a header with"],
        ),
        (
            file("t_s,t_s,x_m,y_m,yaw_rad\n", "0,0,0,0,0\n"),
            &["odom.csv:1:1", "`t_s` appears twice", "keep one"],
        ),
        (
            with_row("0.06,far,0,0"),
            &[
                "odom.csv:5:2",
                "`far` in `x_m`",
                "expected a decimal number",
            ],
        ),
        (
            with_row("0.06,0,0"),
            &["odom.csv:5:4: 3 fields; the header has 4"],
        ),
        (
            with_row("0.06,0,nan,0"),
            &["odom.csv:5", "`y_m` is NaN", "expected a finite number"],
        ),
        (
            with_row("inf,0,0,0"),
            &["odom.csv:5", "`t_s` is inf", "expected a finite number"],
        ),
        (
            with_row("0.03,0,0,0"),
            &["odom.csv:5", "`t_s` is 0.03, and 0.04", "sort the rows"],
        ),
        (
            with_row("0.04,0,0,0"),
            &[
                "odom.csv:5",
                "`t_s` is 0.04, and 0.04",
                "keep one of equal times",
            ],
        ),
        (
            file(ODOMETRY, ""),
            &["odom.csv", "no poses", "a file with poses and times"],
        ),
        (
            b"0.0 0 0 0 0 0 0 1\n0.02 0 0 0 0 0 1\n".to_vec(),
            &["odom.csv:2", "expected"],
        ),
        (
            b"\x89MCAP0\r\n".to_vec(),
            &[
                "odom.csv",
                "not TUM, EuRoC or CSV",
                "a file with poses and times",
            ],
        ),
    ] {
        replay(&fixes(), &odometry, MOVING).is_refused_with(words);
    }
}

#[test]
fn odometry_needs_an_existing_file_and_a_speed() {
    for [arguments, words] in cases(
        "
        --odom other.csv --max-speed 0.1 => other.csv: there is no such file
        --odom odom.csv => --max-speed
        --odom odom.csv --max-speed 0.1 --odom-noise 0.1,0.1 => --odom-noise 0.1,0.1 is not three numbers
        --odom odom.csv --max-speed 0.1 --odom-slip -1 => --odom-slip
        ",
    ) {
        replay(&fixes(), csv(&driven()).as_bytes(), arguments).is_refused_with(&[words]);
    }
}
