//! Distance limits as success sets: discs and ellipses.

use posegate_testkit::run::{Case, cases};
use serde_json::{Value, json};

const TABLE: &str = "[table]\nextent = { x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-20.0, 20.0] }\nstep = { xy = 0.01, yaw_deg = 0.5 }\n";

fn site(success: &str) -> String {
    format!(
        "[task.dock]\nkind = \"work\"\ngoal = {{ x = 1.0, y = 2.0, yaw_deg = 90.0 }}\nsuccess = {success}\n{TABLE}"
    )
}

/// Returns whether each pose (x, y in the goal frame, m; yaw, deg) is permitted with a very small pose-set, and whether it is in the set.
fn verdicts(success: &str, poses: &[[f64; 3]]) -> Vec<[bool; 2]> {
    let mut csv =
        String::from("t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw\n");
    for [x, y, yaw] in poses {
        // The goal is turned by 90 degrees.
        let yaw = (90.0 + yaw).to_radians();
        csv += &format!("0,{},{},{yaw},1e-12,0,0,1e-12,0,1e-12\n", 1.0 - y, 2.0 + x);
    }
    let case = Case::new(&[
        ("site.toml", site(success).as_bytes()),
        ("e.csv", csv.as_bytes()),
    ]);
    let built = case.run("table build site.toml --task dock -o t.posegate");
    built.with(0);
    let lines = |arguments: &str, key: &str, yes: Value| -> Vec<bool> {
        let ended = case.run(arguments);
        let lines = ended.out.lines();
        let lines = lines.map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        lines.map(|line| line[key] == yes).collect()
    };
    let permits = lines(
        "gate t.posegate --estimates e.csv --json",
        "verdict",
        json!("permit"),
    );
    let inside = lines(
        "contains site.toml --task dock --poses e.csv --json",
        "inside",
        json!(true),
    );
    assert_eq!([permits.len(), inside.len()], [poses.len(); 2]);
    permits
        .into_iter()
        .zip(inside)
        .map(|(a, b)| [a, b])
        .collect()
}

#[test]
fn corner_of_the_box_is_outside_of_the_disc() {
    let disc = "{ shape = \"disc\", radius = 0.03, yaw_deg = [-4.0, 4.0] }";
    let poses = [
        [0.0, 0.0, 0.0],
        [0.02, 0.02, 3.9],
        [0.0, -0.0297, 0.0],
        [0.025, 0.025, 0.0],
        [0.0, 0.0, 4.1],
        // In the disc, not in the polygon.
        [
            0.02998 * (5.625f64).to_radians().cos(),
            0.02998 * (5.625f64).to_radians().sin(),
            0.0,
        ],
    ];
    let expected = [
        [true; 2],
        [true; 2],
        [true; 2],
        [false; 2],
        [false; 2],
        [false, true],
    ];
    assert_eq!(verdicts(disc, &poses), expected);
}

#[test]
fn ellipse_is_turned_and_moved() {
    let ellipse = "{ shape = \"ellipse\", a = 0.05, b = 0.03, turn_deg = 30.0, x = 0.01, y = -0.02, yaw_deg = [-180.0, 180.0] }";
    let at = |along: f64, across: f64| {
        let (s, c) = 30f64.to_radians().sin_cos();
        [
            0.01 + c * along - s * across,
            -0.02 + s * along + c * across,
            10.0,
        ]
    };
    let poses = [
        at(0.049, 0.0),
        at(-0.049, 0.0),
        at(0.0, 0.029),
        at(0.0, 0.031),
        at(0.051, 0.0),
        at(0.04, 0.02),
    ];
    let expected = [
        [true; 2], [true; 2], [true; 2], [false; 2], [false; 2], [false; 2],
    ];
    assert_eq!(verdicts(ellipse, &poses), expected);
}

#[test]
fn disc_is_a_set_of_unions_drawings_and_errors() {
    let any = "{ any = [{ shape = \"disc\", radius = 0.03, yaw_deg = [-4.0, 4.0] }, { shape = \"box\", x = [0.0, 0.05], y = [-0.01, 0.01], yaw_deg = [-4.0, 4.0] }] }";
    assert_eq!(
        verdicts(
            any,
            &[[0.045, 0.0, 0.0], [-0.02, 0.01, 0.0], [-0.045, 0.0, 0.0]]
        ),
        [[true; 2], [true; 2], [false; 2]]
    );
    let disc = site("{ shape = \"disc\", radius = 0.03, yaw_deg = [-4.0, 4.0] }");
    let case = Case::new(&[("site.toml", disc.as_bytes())]);
    let drawn = case.run("draw site.toml --task dock -o dock.svg");
    drawn.with(0);
    let checked = case.run("check site.toml --json").json(0);
    assert_eq!(checked["tasks"][0]["shape"], "disc");
    for [success, words] in cases(
        "
        { shape = \"disc\", radius = 0.0, yaw_deg = [-4.0, 4.0] } => above 0
        { shape = \"disc\", radius = 0.03, a = 1.0, yaw_deg = [-4.0, 4.0] } => unknown key `a`
        { shape = \"ellipse\", a = 1e9, b = 0.03, yaw_deg = [-4.0, 4.0] } => too thin
        ",
    ) {
        let case = Case::new(&[("site.toml", site(success).as_bytes())]);
        case.run("check site.toml")
            .is_refused_with(&["site.toml:4", words]);
    }
}
