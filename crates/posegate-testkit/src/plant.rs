//! A synthetic plant: aisles between racks, and endpoints along both faces of each aisle: docks, conveyors and chargers.
//! Each has a tag on the rack next to it and a task that looks at the tag.

use crate::planning_sites::Random;
use crate::warehouse::{AISLE, CAMERA, DRIVES, RACK, before, racks};
use std::fmt::Write as _;

/// Length of a rack's face that an endpoint needs, metres.
const PITCH: f64 = 2.0;

/// Returns the site file of a plant from a seed. Each endpoint has a work task and a look: two tables and one plan.
pub fn plant(seed: u64, endpoints: usize) -> String {
    let mut random = Random(seed);
    // About as wide as long; two faces per aisle.
    let aisles = ((endpoints as f64 * PITCH * 0.5 / (AISLE + RACK)).sqrt() as usize).max(1);
    let slots = endpoints.div_ceil(2 * aisles);
    let length = (slots as f64 + 1.0) * PITCH;
    let mut site = String::from(CAMERA);
    site += "[planner]\nviews = 2\nrange = 12.0\n\n";
    site += DRIVES;
    racks(&mut site, aisles, length);
    for endpoint in 0..endpoints {
        let (upper, aisle) = (endpoint % 2 == 0, endpoint / 2 % aisles);
        let slot = (endpoint / (2 * aisles)) as f64 + 1.0;
        let along = slot * PITCH + random.between(-0.3, 0.3);
        let [x, y, yaw] = before(aisle, upper, along, random.between(0.9, 1.3));
        let kind = random.unit();
        let from = if random.unit() < 0.5 {
            "from-left"
        } else {
            "from-right"
        };
        let (name, success) = if kind < 0.1 {
            ("charger", boxed(random.between(0.05, 0.07), 3.0))
        } else if kind < 0.3 {
            ("conveyor", between_rails(random.between(0.08, 0.12)))
        } else {
            ("dock", boxed(random.between(0.06, 0.12), 4.0))
        };
        let goal = format!("{{ x = {x:?}, y = {y:?}, yaw_deg = {yaw:?} }}");
        let [tag_x, tag_y, _] = before(aisle, upper, along + random.between(-0.2, 0.2), 0.0);
        let size = if random.unit() < 0.4 { 0.3 } else { 0.16 };
        writeln!(
            site,
            "[tag.t{endpoint}]\nid = {endpoint}\nfamily = \"tag36h11\"\nsize = {size}\n\
             pose = {{ x = {tag_x:?}, y = {tag_y:?}, z = {:?}, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = {:?} }}\n\n\
             [task.{name}-{endpoint}]\nkind = \"work\"\nfrom = \"{from}\"\ngoal = {goal}\nsuccess = {success}\n\n\
             [task.see-{endpoint}]\nkind = \"localization\"\ngoal = {goal}\n\
             success = {{ shape = \"visibility\", camera = \"front\", tag = \"t{endpoint}\", d_max = 3.5, phi_max_deg = 25.0, psi_max_deg = 50.0, walls = [] }}\n\
             error_bound = {{ translation = 0.03, yaw_deg = 1.0 }}\n",
            random.between(0.3, 0.7),
            -yaw,
        )
        .expect("a string takes what is written");
    }
    site
}

/// Returns a box of `half` metres and `degrees` to either side of the goal.
fn boxed(half: f64, degrees: f64) -> String {
    format!(
        "{{ shape = \"box\", x = [-{half:?}, {half:?}], y = [-{half:?}, {half:?}], yaw_deg = [-{degrees:?}, {degrees:?}] }}"
    )
}

/// Returns the set in which the robot's footprint is between rails, with `slack` metres of clearance on each side.
fn between_rails(slack: f64) -> String {
    let corners = |x: f64, y: f64| {
        format!("[[{x:?}, {y:?}], [-{x:?}, {y:?}], [-{x:?}, -{y:?}], [{x:?}, -{y:?}]]")
    };
    format!(
        "{{ shape = \"footprint\", footprint = {}, region = {} }}",
        corners(0.4, 0.3),
        corners(0.4 + slack, 0.3 + slack)
    )
}
