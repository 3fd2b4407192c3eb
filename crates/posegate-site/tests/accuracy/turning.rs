//! The same ratio for sets with large yaw errors, up to half a turn, and with correlations up to 0.999: a footprint
//! in a hall, and a visible tag. Only sets whose scale is bounded count.

use crate::oracle::{PoseSet, Rng, SetDeg, scale};
use crate::{CAMERA, Case, core_set, q16, seen, world};
use posegate::contain::examine;
use posegate::table::Table;
use posegate_site::Site;
use posegate_testkit::hall;
use rayon::prelude::*;

const SITE: &str = r#"
[tag.t7]
id = 7
family = "tag36h11"
size = 0.30
pose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }

[task.see]
kind = "work"
goal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }
success = { shape = "visibility", camera = "front", tag = "t7", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }
"#;

/// Reaches in yaw at the true scale, radians, and the goals: mean and least.
const REACHES: [([f64; 2], [f64; 2]); 5] = [
    ([0.02, 0.1], [0.99, 0.95]),
    ([0.1, 0.3], [0.99, 0.95]),
    ([0.3, 0.5], [0.99, 0.95]),
    ([0.5, 1.5], [0.98, 0.90]),
    ([1.5, 3.2], [0.98, 0.90]),
];

fn footprint() -> SetDeg {
    let rectangle = |x: f64, y: f64| vec![[x, y], [-x, y], [-x, -y], [x, -y]];
    SetDeg::Footprint {
        footprint: rectangle(0.4, 0.3),
        region: rectangle(2.0, 2.0),
    }
}

/// Returns a set whose reach in yaw at its true scale is in a range.
fn case(rng: &mut Rng, set: &SetDeg, reach: [f64; 2], spread: f64) -> Case {
    let world = world(set);
    loop {
        let estimate = [
            rng.within(-spread, spread),
            rng.within(-spread, spread),
            rng.within(-spread, spread) * 0.3,
        ];
        let r2 = 743_499.0 / 65_536.0;
        let intended = rng.within(reach[0], reach[1]);
        let yaw = intended / f64::sqrt(r2);
        let sigma = [rng.log_within(0.01, 0.4), rng.log_within(0.01, 0.4), yaw];
        // Strong correlations are as frequent as weak ones.
        let share = 1.0 - rng.log_within(1e-3, 1.0);
        let direction = rng.within(0.0, std::f64::consts::TAU);
        let (xt, yt) = (share * direction.cos(), share * direction.sin());
        let xy = xt * yt;
        let rho = [[1.0, xy, xt], [xy, 1.0, yt], [xt, yt, 1.0]];
        let cov = [0, 1, 2].map(|i| [0, 1, 2].map(|j| rho[i][j] * sigma[i] * sigma[j]));
        let set = PoseSet::Gaussian { cov, r2 };
        let truth = scale(&world, estimate, &set);
        if !(truth > 0.3 && truth < 3.0) {
            continue;
        }
        if (reach[0]..reach[1]).contains(&(intended * truth)) {
            return Case {
                estimate,
                set,
                truth,
            };
        }
    }
}

/// Prints a line for each set and range. Returns `true` if one misses its goals.
pub fn turning(count: u64, seed: u64) -> bool {
    let text = CAMERA.to_owned() + SITE + &hall::task([0.0; 3]);
    let site = Site::parse(&text, "site.toml").expect("the site is valid");
    let mut short = false;
    for (name, set, spread) in [("hall", footprint(), 1.4), ("see", seen(0.0), 1.0)] {
        let bytes = hall::facets(&site, name, 8.0);
        let table = Table::parse(&bytes).expect("a table");
        for (reach, [mean_goal, least_goal]) in REACHES {
            // The tag is not seen at all headings.
            if name == "see" && reach[0] > 1.0 {
                continue;
            }
            let mut ratios: Vec<f64> = (0..count)
                .into_par_iter()
                .map(|i| {
                    let mut rng = Rng::new(seed.wrapping_mul(7_000_003).wrapping_add(i));
                    let case = case(&mut rng, &set, reach, spread);
                    q16(examine(&table, &core_set(&case, 1.0)).margin) / case.truth
                })
                .collect();
            ratios.sort_by(f64::total_cmp);
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            let (least, largest) = (ratios[0], ratios[ratios.len() - 1]);
            println!(
                "{{\"name\": \"accepted over true scale, {name}, yaw reach {} to {} rad\", \"value\": {mean:.4}, \"unit\": \"mean\", \
                 \"goal\": {mean_goal}, \"least\": {least:.4}, \"least_goal\": {least_goal}, \"largest\": {largest:.6}, \"cases\": {count}}}",
                reach[0], reach[1]
            );
            short |= !(mean >= mean_goal && least >= least_goal && largest <= 1.0 + 1e-9);
        }
    }
    short
}
