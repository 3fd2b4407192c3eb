//! Detections of tags that give no single pose: each cause has its own reason and advice.

use posegate_testkit::bags::Bag;
use posegate_testkit::run::Case;
use serde_json::{Value, json};

const SITE: &str = include_str!("../../../../examples/sites/dock.toml");

/// Replays ten looks at the tag from a pose.
fn looks(site: &str, pose: [f64; 3], arguments: &str) -> Value {
    let mut bag = Bag::new(None, true);
    for k in 0..10 {
        bag.look("/detections", 1.0 + 0.05 * f64::from(k), 7, pose);
    }
    let bag = bag.finish();
    let case = Case::new(&[("site.toml", site.as_bytes()), ("looks.mcap", &bag)]);
    let replay = "replay site.toml looks.mcap --task dock --topic /detections --json";
    case.run(&format!("{replay} {arguments}")).json(0)
}

#[test]
fn causes_have_their_own_reasons() {
    let head_on = looks(SITE, [0.0; 3], "--sigma-px 1");
    let two = looks(SITE, [0.0, -0.9, 0.2], "");
    assert_eq!(two["reasons"], head_on["reasons"], "{two:#}");
    assert_eq!(
        head_on["reasons"],
        json!({"tag_poses_ambiguous": 10}),
        "{head_on:#}"
    );
    assert_eq!(head_on["looks"]["ambiguous"], 10);
    // A tag that hangs higher than the site says.
    let raised = SITE.replace("x = 4.0, y = 0.0, z = 0.5", "x = 4.0, y = 0.0, z = 1.0");
    assert_ne!(raised, SITE);
    let raised = looks(&raised, [0.0; 3], "");
    assert_eq!(
        raised["reasons"],
        json!({"corners_do_not_fit": 10}),
        "{raised:#}"
    );
    let missing = looks(SITE, [0.0, 0.0, f64::NAN], "");
    assert_eq!(
        missing["reasons"],
        json!({"too_few_corners": 10}),
        "{missing:#}"
    );
    for summary in [head_on, raised, missing] {
        assert_eq!(summary["findings"]["pose_not_finite"], 0);
        assert_eq!(summary["gate_reasons"], summary["reasons"]);
        // The interlock is shut for that reason, too.
        let shut = summary["interlock"]["shut_s_by"]
            .as_object()
            .expect("reasons");
        let reasons = summary["reasons"].as_object().expect("reasons");
        assert!(shut.keys().eq(reasons.keys()), "{shut:?}");
    }
    let case = Case::new(&[]);
    for (reason, words) in [
        ("tag_poses_ambiguous", "second tag"),
        ("corners_do_not_fit", "the tag's size"),
        ("too_few_corners", "all four corners"),
    ] {
        let explained = case.run(&format!("explain {reason}"));
        assert!(explained.out.contains(words), "{}", explained.out);
    }
}

/// Both poses are in a set that is large enough: permitted, as the node does.
#[test]
fn two_poses_that_are_both_inside_are_permitted() {
    let dock = "x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0]";
    let wide = SITE.replace(
        dock,
        "x = [-3.0, 3.0], y = [-3.0, 3.0], yaw_deg = [-80.0, 80.0]",
    );
    let extent = "x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-5.0, 5.0]";
    let wider = wide.replace(
        extent,
        "x = [-4.0, 4.0], y = [-4.0, 4.0], yaw_deg = [-90.0, 90.0]",
    );
    assert!(wide != SITE && wider != wide);
    let found = looks(&wider, [0.0, -0.9, 0.2], "");
    assert_eq!(found["looks"]["ambiguous"], 10, "{found:#}");
    assert_eq!(found["reasons"], json!({}), "{found:#}");
    assert_eq!(found["rules"]["gate"]["permits"], 10);
}
