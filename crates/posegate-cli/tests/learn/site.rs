//! Learnt error models in site files.

use crate::command::Case;
use crate::distribution::{Distribution, Random, SQUARES};
use posegate_learn::{BoundsSettings, ErrorModel, learn_bounds};
use posegate_site::{SAMPLE, Site};

fn model() -> ErrorModel {
    let settings = BoundsSettings {
        quantile: 0.95,
        ..BoundsSettings::default()
    };
    learn_bounds(&SQUARES.views(6000, 91, |_| true), &settings).unwrap()
}

const LOOK: &str = "
[error_model.learnt]
file = \"model.toml\"

[task.look]
kind = \"localization\"
goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }
success = { shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 8.0, phi_max_deg = 25.0, psi_max_deg = 60.0, error_model = \"learnt\", r = { translation = 0.04, yaw_deg = 1.0 } }
";

fn site(folder: &Case, text: &str) -> Result<Site, String> {
    let path = folder.path().join("site.toml");
    std::fs::write(&path, text).unwrap();
    Site::read(&path).map_err(|error| error.to_string())
}

/// Every pose of the set has both bounds within r; nearly all poses with both bounds within r are in the set.
#[test]
fn learnt_model_defines_a_success_set() {
    let folder = Case::new(&[]);
    let model = model();
    let text = model.write().unwrap();
    std::fs::write(folder.path().join("model.toml"), &text).unwrap();
    let site = site(&folder, &format!("{SAMPLE}{LOOK}")).unwrap();
    assert_eq!(site.error_models["learnt"], model);
    let task = site.task("look").unwrap();
    let bound = task.error_bound.unwrap();
    assert_eq!((bound.translation, bound.yaw_deg), (0.04, 1.0));
    assert!((bound.coverage - 0.9).abs() < 1e-9);
    let tag = site.tags["t7"].tag;
    let [x, y] = [tag.pose.x, tag.pose.y];
    let out = tag.pose.yaw_deg.to_radians();
    let mount = site.cameras["front"].mount;
    let mut random = Random(92);
    let (mut inside, mut good) = (0, 0);
    for _ in 0..20_000 {
        let at = Distribution::place(&mut random);
        // The camera is at the tag's height, at distance d and angle psi to its normal.
        let (d, psi) = (at[0], at[2].to_radians());
        let camera = [x + d * (out + psi).cos(), y + d * (out + psi).sin()];
        let heading = out + psi + core::f64::consts::PI + at[1].to_radians();
        let robot = [
            camera[0] - mount.x * heading.cos(),
            camera[1] - mount.x * heading.sin(),
            heading,
        ];
        let is_good = model
            .bounds_deg(at)
            .is_some_and(|b| b.0 <= 0.04 && b.1.to_degrees() <= 1.0)
            && at[2] <= 60.0;
        if (tag.pose.z - mount.z).abs() > 1e-12 {
            panic!("the sample's camera is at the height of its tag");
        }
        let member = task.success.membership(robot).inside;
        // The sample's walls and image limit the set further, so each pose is only checked for soundness.
        assert!(is_good || !member, "{at:?}");
        inside += u32::from(member);
        good += u32::from(is_good);
    }
    assert!(
        inside > 500 && f64::from(inside) > 0.5 * f64::from(good),
        "{inside} of {good}"
    );

    // The digest of the site includes the model's file.
    let digest = site.digest;
    std::fs::write(folder.path().join("model.toml"), format!("{text}\n")).unwrap();
    let again = Site::read(folder.path().join("site.toml")).unwrap();
    assert_ne!(again.digest, digest);
}

#[test]
fn contradicting_error_bound_is_refused() {
    let folder = Case::new(&[]);
    std::fs::write(folder.path().join("model.toml"), model().write().unwrap()).unwrap();
    let with = |line: &str| site(&folder, &format!("{SAMPLE}{LOOK}{line}\n"));
    assert!(with("").is_ok());
    let looser = with("error_bound = { translation = 0.05, yaw_deg = 2.0 }").unwrap();
    let bound = looser.task("look").unwrap().error_bound.unwrap();
    assert!(bound.translation == 0.05 && (bound.coverage - 0.9).abs() < 1e-9);
    for wrong in [
        "error_bound = { translation = 0.03, yaw_deg = 2.0 }",
        "error_bound = { translation = 0.05, yaw_deg = 0.5 }",
        "error_bound = { translation = 0.05, yaw_deg = 2.0, coverage = 0.99 }",
    ] {
        let error = with(wrong).unwrap_err();
        assert!(
            error.contains("promises more than its success set"),
            "{error}"
        );
    }
    // A bound by coefficients works in the same way. Without a stated error, the error is that of the set.
    let grown = LOOK.replace(
        "file = \"model.toml\"",
        "translation = [0.001, 0.001, 0.0, 0.0]\nyaw_deg = [0.1, 0.0, 0.0, 0.0]",
    );
    let with = |line: &str| site(&folder, &format!("{SAMPLE}{grown}{line}\n"));
    assert!(with("error_bound = { translation = 0.05, yaw_deg = 2.0 }").is_ok());
    let bound = with("").unwrap().task("look").unwrap().error_bound.unwrap();
    assert!(bound.translation == 0.04 && bound.coverage == 1.0);
    let error = with("error_bound = { translation = 0.03, yaw_deg = 2.0 }").unwrap_err();
    assert!(
        error.contains("promises more than its success set"),
        "{error}"
    );
    let changed = |from: &str, to: &str| {
        let text = LOOK.replace(from, to);
        assert_ne!(text, LOOK);
        site(&folder, &format!("{SAMPLE}{text}")).unwrap_err()
    };
    let error = changed("translation = 0.04", "translation = 0.00001");
    assert!(error.contains("nowhere in the set"), "{error}");
    let error = changed(
        "file = \"model.toml\"",
        "file = \"model.toml\"\nyaw_deg = [0.1, 0.0, 0.0, 0.0]",
    );
    assert!(error.contains("both `file` and `yaw_deg`"), "{error}");
    let error = changed("file = \"model.toml\"", "file = \"other.toml\"");
    assert!(error.contains("cannot be read"), "{error}");
    std::fs::write(folder.path().join("broken.toml"), "kind = \"bounds\"\n").unwrap();
    let error = changed("file = \"model.toml\"", "file = \"broken.toml\"");
    assert!(error.contains("broken.toml:1:1"), "{error}");
}
