//! A synthetic warehouse: aisles between racks, docks before the racks, and candidates all over their faces.

use crate::planning_sites::Random;
use std::fmt::Write as _;

/// Widths of aisle and rack, metres.
pub const AISLE: f64 = 4.0;
pub const RACK: f64 = 1.2;

/// The robot's camera.
pub const CAMERA: &str = "[camera.front]\nwidth_px = 640\nheight_px = 480\nfx = 615.0\nfy = 615.0\ncx = 320.0\ncy = 240.0\n\
     mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n\n";

/// The robot's drive model, and its start before a dock.
pub const DRIVES: &str = "[navigation]\n\
     model = { kind = \"bounded\", k_turn = 0.004, k_drift = 0.004, k_slip = 0.01 }\n\
     controller = { translation = 0.005, yaw_deg = 0.2 }\n\n\
     [chain.from-left]\n\
     start = { frame = \"goal\", x = -1.0, y = 3.5, yaw_deg = -90.0, bounded = { translation = 0.25, yaw_deg = 3.0 } }\n\n\
     [chain.from-right]\n\
     start = { frame = \"goal\", x = -1.0, y = -3.5, yaw_deg = 90.0, bounded = { translation = 0.25, yaw_deg = 3.0 } }\n\n";

/// Returns a place before a rack: `along` the aisle, `away` from the upper or lower face of an aisle.
pub fn before(aisle: usize, upper: bool, along: f64, away: f64) -> [f64; 3] {
    let floor = aisle as f64 * (AISLE + RACK);
    if upper {
        [along, floor + AISLE - away, 90.0]
    } else {
        [along, floor + away, -90.0]
    }
}

/// Adds the racks between aisles, before the first and behind the last.
pub fn racks(site: &mut String, aisles: usize, length: f64) {
    for rack in 0..=aisles {
        let (low, high) = (
            rack as f64 * (AISLE + RACK) - RACK,
            rack as f64 * (AISLE + RACK),
        );
        writeln!(
            site,
            "[wall.rack-{rack}]\ncorners = [[0.0, {low:?}], [{length:?}, {low:?}], [{length:?}, {high:?}], [0.0, {high:?}]]\n\
             z = [0.0, 2.5]\n"
        )
        .unwrap();
    }
}

/// Returns the site file of a warehouse with `aisles` aisles of `length` metres, docks and candidates, from one seed.
/// Large candidates cost more, and are seen from farther away.
pub fn warehouse(seed: u64, aisles: usize, length: f64, docks: usize, candidates: usize) -> String {
    let mut random = Random(seed);
    let mut site = String::from(CAMERA);
    site += "[planner]\n\
         look = { camera = \"front\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0, px_per_bit_min = 4.0 }\n\
         r = [[0.03, 1.0]]\nviews = 4\nrange = 12.0\n\n";
    site += DRIVES;
    racks(&mut site, aisles, length);
    for dock in 0..docks {
        let [x, y, yaw] = before(
            dock % aisles,
            random.unit() < 0.5,
            random.between(1.0, length - 1.0),
            random.between(0.9, 1.3),
        );
        let half = random.between(0.06, 0.12);
        writeln!(
            site,
            "[task.dock-{dock}]\nkind = \"work\"\nfrom = \"{}\"\ngoal = {{ x = {x:?}, y = {y:?}, yaw_deg = {yaw:?} }}\n\
             success = {{ shape = \"box\", x = [-{half:?}, {half:?}], y = [-{half:?}, {half:?}], yaw_deg = [-4.0, 4.0] }}\n",
            if random.unit() < 0.5 { "from-left" } else { "from-right" }
        )
        .unwrap();
    }
    for candidate in 0..candidates {
        let large = random.unit() < 0.4;
        let [x, y, yaw] = before(
            candidate % aisles,
            random.unit() < 0.5,
            random.between(0.3, length - 0.3),
            0.0,
        );
        writeln!(
            site,
            "[candidate.c{candidate}]\nfamily = \"tag36h11\"\nsize = {}\ncost = {}\n\
             pose = {{ x = {x:?}, y = {y:?}, z = {:?}, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = {:?} }}\n",
            if large { 0.3 } else { 0.12 },
            if large { 2.5 } else { 1.0 },
            random.between(0.3, 0.9),
            -yaw,
        )
        .unwrap();
    }
    site
}
