//! Maps whose origin is kilometres away: `[origin]` is subtracted from everything in the map's numbers.

use posegate_testkit::bags::{Bag, Pose};
use posegate_testkit::run::Case;
use serde_json::json;

const EAST: f64 = 448_012.5;
const NORTH: f64 = 5_412_345.25;

fn site(origin: &str) -> String {
    format!(
        "{origin}[task.dock]\nkind = \"work\"\ngoal = {{ x = {}, y = {}, yaw_deg = 0.0 }}\n\
         success = {{ shape = \"box\", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0] }}\n\
         [task.home]\nkind = \"work\"\ngoal = \"home\"\n\
         success = {{ shape = \"box\", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0] }}\n\
         [goal.home]\nx = {EAST}\ny = {NORTH}\nyaw_deg = 90.0\n\
         [wall.north]\nfrom = [{EAST}, {}]\nto = [{}, {}]\nz = [0.0, 2.0]\n\
         [tag.t1]\nid = 1\nfamily = \"tag36h11\"\nsize = 0.2\npose = {{ x = {EAST}, y = {NORTH}, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}\n",
        EAST + 12.0,
        NORTH - 7.0,
        NORTH + 3.0,
        EAST + 5.0,
        NORTH + 3.0
    )
}

const ORIGIN: &str = "[origin]\nx = 448000.0\ny = 5412345.0\n";

#[test]
fn far_map_is_refused_with_the_origin_to_write() {
    let case = Case::new(&[("site.toml", site("").as_bytes())]);
    case.run("check site.toml")
        .is_refused_with(&["[origin] x = 448025.0, y = 5412338.0"]);
}

#[test]
fn poses_of_the_map_are_relative_to_the_origin() {
    let header = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\n";
    let row = |t: f64, x: f64| {
        let (x, y) = (EAST + 12.0 + x, NORTH - 7.0);
        format!("{t},{x},{y},0,1e-6,0,0,1e-6,0,1e-6,{x},{y},0\n")
    };
    let csv = format!("{header}{}{}", row(1.0, 0.0), row(1.1, 0.2));
    let truth = format!(
        "1.0 {} {} 0 0 0 0 1\n1.1 {} {} 0 0 0 0 1\n",
        EAST + 12.0,
        NORTH - 7.0,
        EAST + 12.2,
        NORTH - 7.0
    );
    let mut bag = Bag::new(None, true);
    for (t_s, x) in [(1.0, 0.0), (1.1, 0.2)] {
        let pose = Pose {
            t_s,
            x: EAST + 12.0 + x,
            y: NORTH - 7.0,
            covariance: [1e-6; 3],
            ..Pose::AT_DOCK
        };
        bag.pose("/pose", &pose);
    }
    let bag = bag.finish();
    let case = Case::new(&[
        ("site.toml", site(ORIGIN).as_bytes()),
        ("e.csv", csv.as_bytes()),
        ("truth.txt", truth.as_bytes()),
        ("drive.mcap", &bag),
    ]);
    assert_eq!(case.run("check site.toml --json").json(0)["valid"], true);
    for log in ["e.csv", "drive.mcap --topic /pose --truth truth.txt"] {
        let found = case
            .run(&format!("replay site.toml {log} --task dock --json"))
            .json(0);
        assert_eq!(found["rules"]["gate"]["permits"], 1, "{log}");
        assert_eq!(found["truth"]["in_success_set"], 1, "{log}: {found:#}");
        assert!(
            found["truth"]["rmse_m"].as_f64().expect("a number") < 1e-6,
            "{log}"
        );
    }
    let inside = case.run("contains site.toml --task dock --poses e.csv --json");
    let lines: Vec<bool> = inside
        .out
        .lines()
        .map(|line| line.contains("\"inside\":true"))
        .collect();
    assert_eq!(lines, [true, false]);
    for task in ["dock", "home"] {
        let built = case.run(&format!(
            "table build site.toml --task {task} -o {task}.posegate"
        ));
        built.with(0);
    }
    let ended = case.run("gate dock.posegate --estimates e.csv --json --origin 448000,5412345");
    let lines: Vec<serde_json::Value> = ended
        .out
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert_eq!(
        (&lines[0]["verdict"], &lines[1]["verdict"]),
        (&json!("permit"), &json!("deny"))
    );
    let drawn = case.run("draw site.toml --task dock -o dock.svg");
    drawn.with(0);
    case.run("gate dock.posegate --estimates e.csv --origin 5")
        .is_refused_with(&["two numbers in metres"]);
}
