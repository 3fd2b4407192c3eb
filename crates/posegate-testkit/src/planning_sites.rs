//! Random sites for planning: tags on posts in a hall, docks before some of them.

use std::fmt::Write as _;

/// A small generator of random numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / 9_007_199_254_740_992.0
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// How a site's robots drive.
#[allow(dead_code)] // The example's robots drive only by bounds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    Bounded,
    Gaussian,
}

/// Returns the site file of a hall with `tags` tags and `docks` docks, each dock with a start some metres before it.
pub fn hall(random: &mut Random, tags: usize, docks: usize, drive: Drive) -> String {
    let mut site = String::from(
        "[camera.front]\nwidth_px = 640\nheight_px = 480\nfx = 615.0\nfy = 615.0\ncx = 320.0\ncy = 240.0\n\
         mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n\
         [confidence]\nepsilon = 0.99\n\
         [planner]\nlook = { camera = \"front\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }\n",
    );
    let (translation, yaw) = (random.between(0.01, 0.05), random.between(0.3, 1.5));
    writeln!(
        site,
        "r = [[{translation:?}, {yaw:?}]]\nviews = 4\nrange = 9.0\n[navigation]"
    )
    .unwrap();
    match drive {
        Drive::Bounded => writeln!(
            site,
            "model = {{ kind = \"bounded\", k_turn = {:?}, k_drift = {:?}, k_slip = {:?} }}",
            random.between(0.0, 0.006),
            random.between(0.0, 0.006),
            random.between(0.0, 0.015)
        ),
        Drive::Gaussian => writeln!(
            site,
            "model = {{ kind = \"gaussian\", a1 = {:?}, a2 = {:?}, a3 = {:?}, a4 = {:?} }}",
            random.between(0.0, 2e-5),
            random.between(0.0, 2e-6),
            random.between(0.0, 2e-5),
            random.between(0.0, 2e-6)
        ),
    }
    .unwrap();
    writeln!(
        site,
        "controller = {{ translation = {:?}, yaw_deg = {:?} }}",
        random.between(0.0, 0.01),
        random.between(0.0, 0.4)
    )
    .unwrap();
    let across = (tags as f64).sqrt().ceil() as usize;
    let mut places = Vec::new();
    for tag in 0..tags {
        let x = (tag % across) as f64 * 6.0 + random.between(-1.0, 1.0);
        let y = (tag / across) as f64 * 6.0 + random.between(-1.0, 1.0);
        let heading = random.between(-180.0, 180.0);
        writeln!(
            site,
            "[tag.t{tag}]\nid = {tag}\nfamily = \"tag36h11\"\nsize = 0.3\n\
             pose = {{ x = {x:?}, y = {y:?}, z = {:?}, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = {heading:?} }}",
            random.between(0.3, 0.8)
        )
        .unwrap();
        places.push([x, y, heading]);
    }
    for dock in 0..docks {
        let [x, y, heading] = places[(random.unit() * tags as f64) as usize % tags];
        // Before the tag, looking at it.
        let (away, aside) = (random.between(1.0, 2.5), random.between(-0.8, 0.8));
        let (s, c) = heading.to_radians().sin_cos();
        let goal = [
            x + away * c - aside * s,
            y + away * s + aside * c,
            heading + 180.0 + random.between(-20.0, 20.0),
        ];
        writeln!(
            site,
            "[task.dock{dock}]\nkind = \"work\"\ngoal = {{ x = {:?}, y = {:?}, yaw_deg = {:?} }}\n\
             success = {{ shape = \"box\", x = [-{a:?}, {a:?}], y = [-{b:?}, {b:?}], yaw_deg = [-{w:?}, {w:?}] }}",
            goal[0],
            goal[1],
            goal[2],
            a = random.between(0.08, 0.3),
            b = random.between(0.08, 0.3),
            w = random.between(3.0, 12.0),
        )
        .unwrap();
        // The start is farther away on the same side.
        let (away, aside) = (random.between(2.0, 4.5), random.between(-0.8, 0.8));
        let known = match drive {
            Drive::Bounded => format!(
                "bounded = {{ translation = {:?}, yaw_deg = {:?} }}",
                random.between(0.05, 0.6),
                random.between(0.5, 4.0)
            ),
            Drive::Gaussian => {
                let (sx, sy, sw) = (
                    random.between(0.02, 0.15),
                    random.between(0.02, 0.15),
                    random.between(0.004, 0.02),
                );
                format!(
                    "covariance = [[{:?}, 0.0, 0.0], [0.0, {:?}, 0.0], [0.0, 0.0, {:?}]], epsilon = 0.99",
                    sx * sx,
                    sy * sy,
                    sw * sw
                )
            }
        };
        writeln!(
            site,
            "[chain.to{dock}]\nstart = {{ x = {:?}, y = {:?}, yaw_deg = {:?}, {known} }}",
            x + away * c - aside * s,
            y + away * s + aside * c,
            heading + 180.0 + random.between(-10.0, 10.0),
        )
        .unwrap();
    }
    site
}
