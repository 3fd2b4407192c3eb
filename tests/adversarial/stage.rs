//! A random success set about a random goal, baked to a table.

use crate::oracle::{
    self, RandomWorld, Rng, SetDeg, World, pose_from_deg, random_estimate, random_world,
    set_from_deg, to_goal,
};
use posegate::bake::{BakeInput, Extent, Layout, Step, TableSpec};
use posegate::shape::{
    BoxSet, Camera, Footprint, Pose3Deg, PoseDeg, Shape, SuccessSet, Tag, Tolerance, Visibility,
};
use posegate::verify::{BuildError, ExpectedTable, build, verify};

const TASK: &str = "adversarial";
const EPSILON: f64 = 0.99;

/// A world with its proven table.
pub struct Stage {
    pub world: World,
    pub success: SuccessSet,
    pub bytes: Vec<u8>,
    /// Width of the table's cells (twice the sagitta of facets), metres.
    pub cell: f64,
    /// Tables before this one that were baked but not proven, and therefore withheld.
    pub withheld: usize,
}

pub fn stage(rng: &mut Rng, layout: Layout) -> Stage {
    let mut withheld = 0;
    loop {
        let mut random = random_world(rng);
        if rng.chance(0.5) {
            off_the_raster(rng, &mut random);
        }
        if rng.chance(0.05) && !matches!(random.set_deg, SetDeg::Visibility { .. }) {
            // Far from the world's origin. (A tag would stay where it is.)
            for axis in [0, 1] {
                random.goal_deg[axis] += if rng.chance(0.5) { 1_200.0 } else { -1_200.0 };
            }
            random.world.goal = pose_from_deg(random.goal_deg);
        }
        let success = success_set(&random);
        let spec = spec(rng, &random, layout);
        let cell = spec.step.xy;
        let order = BakeInput {
            task: TASK,
            success: &success,
            spec,
            epsilon: EPSILON,
        };
        match build(&order, &|| ()) {
            Ok((bytes, _)) => {
                return Stage {
                    world: random.world,
                    success,
                    bytes,
                    cell,
                    withheld,
                };
            }
            Err(BuildError::Verify(_)) => withheld += 1,
            // A set too small for its cells has no table: another world is tried.
            Err(_) => {}
        }
    }
}

impl Stage {
    /// Returns `true` if the table's bytes can be proven.
    pub fn is_proven(&self) -> bool {
        let claim = ExpectedTable {
            task: TASK,
            success: &self.success,
            epsilon: EPSILON,
        };
        verify(&self.bytes, &claim, &|| ()).is_ok()
    }
}

/// Moves the goal off the raster of tenths of millimetres, which tables represent exactly.
fn off_the_raster(rng: &mut Rng, random: &mut RandomWorld) {
    for (axis, by) in [1e-6, 1e-6, 1e-6].into_iter().enumerate() {
        random.goal_deg[axis] += rng.within(-by, by);
    }
    let goal = pose_from_deg(random.goal_deg);
    random.world = World {
        goal,
        set: set_from_deg(&random.set_deg, goal),
    };
}

/// Returns an extent around the estimates, 30 to 200 cells across; some over the whole circle.
fn spec(rng: &mut Rng, random: &RandomWorld, layout: Layout) -> TableSpec {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for _ in 0..100 {
        let pose = to_goal(
            random.world.goal,
            pose_from_deg(random_estimate(rng, &random.world)),
        );
        let pose = [pose[0], pose[1], oracle::wrap(pose[2]).to_degrees()];
        for axis in 0..3 {
            low[axis] = low[axis].min(pose[axis]);
            high[axis] = high[axis].max(pose[axis]);
        }
    }
    let rounded = |v: f64| (v * 1e4).round() / 1e4;
    let mut extent = Extent {
        x: [rounded(low[0] - 0.05), rounded(high[0] + 0.05)],
        y: [rounded(low[1] - 0.05), rounded(high[1] + 0.05)],
        yaw_deg: [rounded(low[2] - 2.0), rounded(high[2] + 2.0)],
    };
    if let SetDeg::Box { x, y, yaw_deg } = &random.set_deg {
        // The borders of the cells then equal those of the set.
        extent = Extent {
            x: *x,
            y: *y,
            yaw_deg: *yaw_deg,
        };
    }
    if extent.yaw_deg[1] - extent.yaw_deg[0] > 300.0 || rng.chance(0.25) {
        let lo = rounded(rng.within(-180.0, 180.0));
        extent.yaw_deg = [lo, lo + 360.0];
    }
    let largest = (extent.x[1] - extent.x[0]).max(extent.y[1] - extent.y[0]);
    let xy = (largest / rng.log_within(30.0, 200.0) * 1e4).ceil() / 1e4;
    let yaw_deg = rng.log_within(0.5, 3.0);
    TableSpec {
        extent,
        step: Step { xy, yaw_deg },
        layout,
    }
}

fn success_set(random: &RandomWorld) -> SuccessSet {
    let pose3 = |[x, y, z, roll_deg, pitch_deg, yaw_deg]: [f64; 6]| Pose3Deg {
        x,
        y,
        z,
        roll_deg,
        pitch_deg,
        yaw_deg,
    };
    let shape = match &random.set_deg {
        SetDeg::Box { x, y, yaw_deg } => Shape::Box(BoxSet {
            x: *x,
            y: *y,
            yaw_deg: *yaw_deg,
        }),
        SetDeg::Footprint { footprint, region } => {
            Shape::Footprint(Footprint::new(footprint.clone(), region.clone()).unwrap())
        }
        SetDeg::Visibility {
            camera,
            mount_deg,
            tag_in_world_deg,
            tag_size,
            d_max,
            phi_max_deg,
            psi_max_deg,
            z_near,
        } => Shape::Visibility(Visibility {
            camera: Camera::pinhole(
                [camera.width, camera.height],
                [camera.fx, camera.fy],
                [camera.cx, camera.cy],
            ),
            mount: pose3(*mount_deg),
            tag: Tag {
                id: 0,
                size: *tag_size,
                pose: pose3(*tag_in_world_deg),
            },
            d_max: *d_max,
            phi_max_deg: *phi_max_deg,
            psi_max_deg: *psi_max_deg,
            z_near: *z_near,
            tag_tolerance: Tolerance::NONE,
            mount_tolerance: Tolerance::NONE,
            sharpness: None,
            error_room: None,
        }),
    };
    let [x, y, yaw_deg] = random.goal_deg;
    SuccessSet {
        goal: PoseDeg { x, y, yaw_deg },
        shape,
    }
}
