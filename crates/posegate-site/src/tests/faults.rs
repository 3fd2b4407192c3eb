//! Faulty site files: positions and texts of the errors.

use super::{fault, find, sample_with};

const NUMBERS: &str = r#"
width_px = 640 => width_px = 0 => 0\nheight => `camera.front.width_px` is 0 => width_px = 640
width_px = 640 => width_px = 640.5 => 640.5 => a number with a fraction
height_px = 480 => height_px = -480 => -480 => is -480 => height_px = 480
fx = 615.0 => fx = 0 => 0   => `camera.front.fx` is 0 => write it like `fx = 615.0`
fy = 615.0 => fy = -615 => -615 => `camera.front.fy` is -615 => fy =
cx = 320.0 => cx = nan => nan => not a finite number => cx =
cx = 320.0 => cx = 1e400 => 1e400 => not a finite number => cx =
cy = 240.0 => cy = "240" => "240" => `camera.front.cy` is a string => cy = 240.0
cy = 240.0 => cy = 9007199254740993 => 9007199254740993 => is 9007
x = 0.25 => x = inf => inf => `camera.front.mount.x` is inf => x =
id = 7 => id = 4294967296 => 4294967296 => `tag.t7.id` => id = 7
size = 0.30 => size = 0.0 => 0.0\npose => `tag.t7.size` is 0.0 => size = 0.30
family = "tag36h11" => family = "" => "" => family is empty => tag36h11
d_max = 5.5 => d_max = 0 => 0, phi => d_max` is 0 => d_max
phi_max_deg = 25.0 => phi_max_deg = 180.5 => 180.5 => is 180.5 => 25.0
psi_max_deg = 50.0 => psi_max_deg = 90.1 => 90.1 => is 90.1 => 50.0
psi_max_deg = 50.0 => psi_max_deg = 50, z_near = 0 => 0 }\nerror => z_near` is 0
translation = 0.05 => translation = 0 => 0, yaw_deg = 2.0 => is 0
xy = 0.02 => xy = -0.02 => -0.02 => `table.step.xy` is -0.02 => xy = 0.02
epsilon = 0.99 => epsilon = 1 => 1\n => `confidence.epsilon` is 1 => epsilon = 0.99
"#;

const KEYS: &str = r#"
yaw_deg = 180.0 => yaw = 180.0 => yaw = 180.0 => unknown key `yaw` in `tag.t7.pose`
    => the unit is missing: angles are written in degrees, in a key named `yaw_deg`
yaw_deg = 180.0 => yaw_rad = 3.14 => yaw_rad => unknown key `yaw_rad` => not radians
width_px = 640 => width = 640 => width => unknown key
    => pixels are written in a key named `width_px`
size = 0.30 => size_m = 0.30 => size_m => unknown key => in a key named `size`
d_max = 5.5 => dmax = 5.5 => dmax => unknown key `dmax` => did you mean `d_max`?
phi_max_deg => phi_max => phi_max => unknown key `phi_max` => `phi_max_deg`
fx = 615.0 => aperture = 2\nfx = 615.0 => aperture => unknown key => remove it
[tag.t7] => [tags.t7] => tags => unknown key `tags` in the site file => did you mean `tag`?
cy = 240.0 =>  => [camera.front] => `cy` is missing from `camera.front` => add `cy = 240.0`
roll_deg = 0.0,  =>  => { x = 0.25 => `roll_deg` is missing => add `roll_deg
shape = "box",  =>  => { x = [-0.08 => `shape` is missing => add `shape
error_bound = { translation = 0.05, yaw_deg = 2.0 } => # none => [task.see-t7]
    => `error_bound` is missing => add `error_bound
[task.dock] => [task.""] => "" => a name in `task` is empty => choose
[task.dock] => [task.dock-at-the-charger-in-the-long-hall] => dock-at => longer than 32 => choose
[task.dock]\nkind = "work" => [task.dock]\nkind = "work"\nerror_bound = {} => error_bound = {}
    => is a work task => remove it
"#;

const MEANINGS: &str = r#"
kind = "work" => kind = "navigation" => "navigation" => not a kind of task => [chain.NAME]
kind = "work" => kind = "wrok" => "wrok" => `task.dock.kind` => did you mean "work"?
shape = "box" => shape = "circle" => "circle" => shape` is "circle"
x = [-0.08, 0.08] => x = [0.08, -0.08] => [0.08, -0.08] => is [0.08, -0.08] => x = [-0.08
yaw_deg = [-4.0, 4.0] => yaw_deg = [-4, 356.5] => [-4, 356.5] => yaw_deg` is
y = [-0.06, 0.06] => y = [1, 2, 3] => [1, 2, 3] => is an array of 3 => y = [-0.06
y = [-0.06, 0.06] => y = 0.06 => 0.06, => is a number => y = [
y = [-0.06, 0.06] => y = [-0.06, true] => true => y[1]` is `true`
x = [-2.0, 2.0] => x = [2, 2] => [2, 2] => `table.extent.x` is [2, 2] => x = [-2.0
y = [-1.0, 1.0] => y = [1, -1] => [1, -1] => `task.park.table.extent.y`
[confidence] => [controller]\ncore = "cortex-m4f"\ncycles_per_decision = 9\nlevel = "z"\n[confidence] => "z" => `controller.level` is "z"
[confidence] => [controller]\ncore = "cortex-m4f"\ncycles_per_decision = 9\ntracker = "yes"\n[confidence] => "yes" => `controller.tracker` is "yes" => tracker = true
layout = "auto" => layout = "gird" => "gird" => `table.layout` => did you mean "grid"?
camera = "front" => camera = "fornt" => "fornt" => no camera `fornt` => did you mean `front`?
tag = "t7" => tag = "wall" => "wall" => no tag `wall` => add a table [tag.wall]
[[2.5, 1.5], [-2.5, 1.5], [-2.5, -1.5], [2.5, -1.5]]
    => [[2.5, -1.5], [-2.5, -1.5], [-2.5, 1.5], [2.5, 1.5]] => [[2.5, -1.5]
    => region`: the corners run clockwise => reverse
[2.25, 0.75] => [-2.0, 0.0] => [[-2.0, 0.0] => footprint`: the polygon is not convex
    => each corner
[2.25, 0.75] => [2.25] => [2.25] => footprint[0]` is an array of 1
[[2.25, 0.75], [-2.25, 0.75], [-2.25, -0.75], [2.25, -0.75]] => [[0, 0], [1, 0]] => [[0, 0]
    => one point or has at least 3
goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 } => goal = [0, 0, 0] => [0, 0, 0]
    => `task.dock.goal` is an array of 3 => goal = {
[camera.front] => [[camera.front]] => [[camera.front]] => is an array of 1 => camera
"#;

const SETS: &str = r#"
size = 0.30 => size = 0.30\ntolerance = { translation = -0.1, yaw_deg = 1 } => -0.1 => is -0.1 => write it like
d_max = 5.5 => d_max = 5.5, d_min = 6 => 6, phi => is not below `d_max`
psi_max_deg = 50.0 => psi_max_deg = 50.0, psi_min_deg = 50 => 50 }\nerror => leave nothing below `psi_max_deg`
phi_max_deg = 25.0 => phi_max_deg = 25.0, border_px = 240 => 240, psi => leaves nothing => narrower
phi_max_deg = 25.0 => phi_max_deg = 25.0, walls = ["w"] => "w" => there is no wall `w` => [wall.w]
phi_max_deg = 25.0 => phi_max_deg = 25.0, error_model = "m" => "m" => there is no error_model `m`
    => [error_model.m]
phi_max_deg = 25.0 => r = { translation = 1, yaw_deg = 1 }, phi_max_deg = 25.0 => r = {
    => has an `r` and no `error_model` => error_model
phi_max_deg = 25.0 => blur = { yaw_rate_deg_s = 90, exposure_s = 0.1, px_max = 1 }, phi_max_deg = 25.0
    => { yaw_rate => even on the optical axis => more slowly
tag = "t7" => tags = ["t7"] => { shape = "visibility" => `see` is missing => add `see
tag = "t7" => tags = [], see = "any" => [], see => has no tag
success = { shape = "box", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0] } => success = { any = [] }
    => [] }\n => has no success set => write it like
shape = "box" => shape = "clear" => x = [-0.08 => unknown key `x` => remove it
success = { shape = "box", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0] }
    => success = { shape = "clear", footprint = [[0, 0]], obstacle = [[1, 1], [-1, 1], [-1, -1], [1, -1]] }
    => { shape = "clear" => an obstacle covers the goal, which is 1.000 m inside of it => move the obstacle
[task.dock] => [task.dock]\ntolerance = { translation = 0.1, yaw_deg = 0 } => { translation = 0.1
    => leaves nothing of a box => survey
[tag.t7] => [wall.w]\nfrom = [0, 0]\nto = [0, 0]\nz = [0, 1]\n[tag.t7] => [0, 0]\nz => ends where it starts
[tag.t7] => [wall.w]\nfrom = [0, 0]\nz = [0, 1]\n[tag.t7] => [wall.w] => `to` is missing => add `to
[tag.t7] => [error_model.m]\ntranslation = [0, 1, 2]\nyaw_deg = [0, 0, 0, 0]\n[tag.t7] => [0, 1, 2] => is not four numbers
[tag.t7] => [error_model.m]\ntranslation = [0, -1, 0, 0]\nyaw_deg = [0, 0, 0, 0]\n[tag.t7] => -1, 0 => is -1 => write it like
"#;

#[test]
fn bound_below_zero_is_an_error() {
    let model = "[error_model.m]\ntranslation = [0.01, 0.0, 0.0, -0.02]\nyaw_deg = [1.0, 0.0, 0.0, 0.0]\n[tag.t7]";
    let site = |psi_max_deg: &str| {
        let set = format!(
            "psi_max_deg = {psi_max_deg}, error_model = \"m\", r = {{ translation = 0.05, yaw_deg = 2.0 }}"
        );
        sample_with("[tag.t7]", model).replace("psi_max_deg = 50.0", &set)
    };
    // 0.01 - 0.02 psi^2 is 0 at 40.5 deg.
    let message = fault(&site("41.0")).to_string();
    assert!(
        message.contains("has a bound below 0 at a psi of 41 deg"),
        "{message}"
    );
    assert!(crate::Site::parse(&site("40.0"), "site.toml").is_ok());
}

const CAMERAS: &str = r#"
fx = 615.0 => distortion = {}\nfx = 615.0 => {}\n => `model` is missing from `camera.front.distortion`
    => add `model =
fx = 615.0 => distortion = { model = "fov", coefficients = [1] }\nfx = 615.0 => "fov"
    => model` is "fov" => write it like
fx = 615.0 => distortion = { model = "plumb_bop", coefficients = [1] }\nfx = 615.0 => "plumb_bop"
    => model` is "plumb_bop" => did you mean "plumb_bob"?
fx = 615.0 => distortion = { model = "plumb_bob", coefficients = [1, 2, 3] }\nfx = 615.0
    => [1, 2, 3] => has 3 coefficients, plumb_bob has 5 => write it like
fx = 615.0 => distortion = { model = "equidistant", coefficients = [1, nan, 3, 4] }\nfx = 615.0
    => nan => which is not a finite number => write it like
fx = 615.0 => distortion = { model = "equidistant", coefficients = [0, 0, 0, 0] }\nfx = 615.0
    => [camera.front] => `image` is missing from `camera.front`, whose raw image differs => image_raw
fx = 615.0 => image = "raw"\ndistortion = { model = "plumb_bob", coefficients = [1, 2, 0, 0, 0, 9, 0, 0] }\nfx = 615.0
    => [1, 2, 0, 0, 0, 9, 0, 0] => has k4, k5, k6 of rational_polynomial, which plumb_bob does not have
fx = 615.0 => image = "rext"\nfx = 615.0 => "rext" => image` is "rext" => did you mean "rect"?
fx = 615.0 => border_px = -1\nfx = 615.0 => -1\n => border_px` is -1 => write it like
fx = 615.0 => border_px = 240\nfx = 615.0 => border_px => leaves nothing of an image of 640 x 480 px => smaller
fx = 615.0 => binning = [2]\nfx = 615.0 => [2]\n => binning` is an array of 1 => [2, 2]
fx = 615.0 => roi = { x_offset = 1, y_offset = 0, width = 640, height = 480 }\nfx = 615.0 => roi =
    => the roi reaches to (641 px, 480 px), the image to (640 px, 480 px) => whole image
fx = 615.0 => roi = { x_offset = 1, y_offset = 0, width = 0, height = 480 }\nfx = 615.0 => 0, height
    => width` is 0 => write it like
fx = 615.0 => calibration = "front.yaml"\nfx = 615.0 => fx = 615.0 => has both `calibration` and `fx`
    => remove `fx`
"#;

/// Rows of: text of the sample to replace => replacement => text at which the error points => part of
/// its message => part of its help (optional). `\n` is a new line; a line that starts with `=>`
/// continues its row.
fn check(table: &str, rows: usize) {
    let table = table.replace("\n    =>", " =>");
    let table: Vec<&str> = table.lines().filter(|row| !row.is_empty()).collect();
    assert_eq!(table.len(), rows);
    for row in table {
        let cells: Vec<String> = row
            .split(" => ")
            .map(|cell| cell.replace("\\n", "\n"))
            .collect();
        let (from, to, at, message) = (&cells[0], &cells[1], &cells[2], &cells[3]);
        let text = sample_with(from, to);
        let error = fault(&text);
        let place = error.at.expect("a place");
        assert_eq!(
            (place.line, place.column),
            find(&text, at),
            "{row}: {error}"
        );
        assert!(
            text[place.offset..].starts_with(at.as_str()),
            "{row}: {error}"
        );
        assert!(error.message.contains(message), "{row}: {error}");
        assert!(error.expected.is_some(), "{row}: {error}");
        let help = error.help.as_deref().expect("help");
        assert!(
            help.contains(cells.get(4).map_or("", String::as_str)),
            "{row}: {error}"
        );
    }
}

#[test]
fn number_errors_point_at_the_value() {
    check(NUMBERS, 20);
}

#[test]
fn key_errors_point_at_the_key() {
    check(KEYS, 15);
}

#[test]
fn semantic_errors_point_at_the_value() {
    check(MEANINGS, 21);
}

#[test]
fn camera_errors_point_at_the_faulty_key() {
    check(CAMERAS, 14);
}

#[test]
fn success_set_errors_point_at_the_faulty_value() {
    check(SETS, 18);
}
