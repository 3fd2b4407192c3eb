//! Random success sets about random goals.

use posegate::bake::Extent;
use posegate::shape::{
    BoxSet, Camera, Clear, ErrorLimit, ErrorModel, Exclusion, Footprint, Pose3Deg, PoseDeg, Shape,
    Sharpness, SuccessSet, Tag, Tolerance, Visibility, Wall,
};

/// A generator of numbers (splitmix64, Steele, Lea and Flood 2014).
pub struct Random(u64);

/// A success set, and its structure for the definition.
#[derive(Debug)]
pub struct World {
    pub success: SuccessSet,
    pub tree: Tree,
    /// The tolerance of boxes, regions and obstacles.
    pub dock: Tolerance,
}

/// The structure of a success set.
#[derive(Debug)]
pub enum Tree {
    Box(BoxSet),
    /// A footprint in the union of regions.
    Footprint(Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>),
    Clear(Vec<[f64; 2]>, Vec<[f64; 2]>),
    View(Box<View>),
    Any(Vec<Self>),
    All(Vec<Self>),
}

#[derive(Debug)]
pub struct View {
    pub set: Visibility,
    pub d_min: Option<f64>,
    pub psi_min_deg: Option<f64>,
    pub walls: Vec<Wall>,
    pub limit: Option<ErrorLimit>,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed ^ 0x5eed_5e75);
        random.next();
        random
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    pub fn within(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn chance(&mut self, share: f64) -> bool {
        self.within(0.0, 1.0) < share
    }

    pub fn pose_in(&mut self, extent: &Extent) -> [f64; 3] {
        let yaw = extent.yaw_deg.map(f64::to_radians);
        [
            self.within(extent.x[0], extent.x[1]),
            self.within(extent.y[0], extent.y[1]),
            self.within(yaw[0], yaw[1]),
        ]
    }

    pub fn world(&mut self) -> World {
        self.world_with(true)
    }

    pub fn world_without_tolerances(&mut self) -> World {
        self.world_with(false)
    }

    fn world_with(&mut self, tolerances: bool) -> World {
        // Whole micrometres, which tables represent exactly.
        let um = |v: f64| (v * 1e6).round() * 1e-6;
        let goal = PoseDeg {
            x: um(self.within(-20.0, 20.0)),
            y: um(self.within(-20.0, 20.0)),
            yaw_deg: (self.within(-180.0, 180.0) * 10.0).round() / 10.0,
        };
        let dock = if tolerances && self.chance(0.4) {
            self.tolerance(0.03, 2.0)
        } else {
            Tolerance::NONE
        };
        let mut tree = self.tree(goal, 3);
        if !tolerances {
            tree.forget_tolerances();
        }
        let shape = tree.shape().within(dock);
        World {
            success: SuccessSet { goal, shape },
            tree,
            dock,
        }
    }

    fn tolerance(&mut self, translation: f64, turn_deg: f64) -> Tolerance {
        Tolerance {
            translation: self.within(0.0, translation),
            turn_deg: self.within(0.0, turn_deg),
        }
    }

    fn tree(&mut self, goal: PoseDeg, depth: u32) -> Tree {
        let several = |random: &mut Self| {
            let count = 2 + random.below(2);
            (0..count).map(|_| random.tree(goal, depth - 1)).collect()
        };
        match self.below(if depth > 0 { 9 } else { 5 }) {
            0 => Tree::Box(self.boxed()),
            1 => {
                let regions = 1 + self.below(3);
                let regions = (0..regions).map(|_| self.polygon(0.8, 2.5, 0.7)).collect();
                Tree::Footprint(self.robot(), regions)
            }
            2 => Tree::Clear(self.robot(), self.polygon(0.2, 1.0, 1.5)),
            3 | 4 => Tree::View(Box::new(self.view(goal))),
            5 | 6 => Tree::Any(several(self)),
            _ => Tree::All(several(self)),
        }
    }

    fn boxed(&mut self) -> BoxSet {
        let mut range = |middle: f64, half: f64| {
            let (m, h) = (self.within(-middle, middle), self.within(0.3, 1.0) * half);
            [m - h, m + h]
        };
        BoxSet {
            x: range(0.6, 1.8),
            y: range(0.6, 1.8),
            yaw_deg: range(15.0, 60.0),
        }
    }

    fn robot(&mut self) -> Vec<[f64; 2]> {
        if self.chance(0.2) {
            return vec![[self.within(-0.2, 0.2), self.within(-0.2, 0.2)]];
        }
        self.polygon(0.1, 0.5, 0.1)
    }

    /// Returns a convex polygon: corners on a circle, stretched, around a random middle.
    fn polygon(&mut self, least: f64, most: f64, away: f64) -> Vec<[f64; 2]> {
        let (rx, ry) = (self.within(least, most), self.within(least, most));
        let middle = [self.within(-away, away), self.within(-away, away)];
        let count = 3 + self.below(4);
        let mut angles: Vec<f64> = (0..count)
            .map(|k| (k as f64 + self.within(0.1, 0.9)) / count as f64 * std::f64::consts::TAU)
            .collect();
        angles.sort_by(f64::total_cmp);
        angles
            .iter()
            .map(|a| [middle[0] + rx * a.cos(), middle[1] + ry * a.sin()])
            .collect()
    }

    fn view(&mut self, goal: PoseDeg) -> View {
        let tolerant = self.chance(0.5);
        let mount = Pose3Deg {
            x: self.within(-0.3, 0.3),
            y: self.within(-0.3, 0.3),
            z: self.within(0.2, 0.8),
            roll_deg: self.within(-5.0, 5.0),
            pitch_deg: self.within(-10.0, 10.0),
            yaw_deg: self.within(-30.0, 30.0),
        };
        // The direction in which the camera looks from the goal.
        let heading = (goal.yaw_deg + mount.yaw_deg + self.within(-8.0, 8.0)).to_radians();
        let d = self.within(1.5, 4.0);
        let (sin, cos) = heading.sin_cos();
        let at = [goal.x + d * cos, goal.y + d * sin];
        let camera = Camera::pinhole([640.0, 480.0], [500.0, 510.0], [322.0, 238.0]);
        let tag = Tag {
            id: 7,
            size: self.within(0.1, 0.4),
            pose: Pose3Deg {
                x: at[0],
                y: at[1],
                z: self.within(0.2, 1.2),
                roll_deg: self.within(-5.0, 5.0),
                pitch_deg: self.within(-15.0, 15.0),
                yaw_deg: heading.to_degrees() + 180.0 + self.within(-35.0, 35.0),
            },
        };
        let sharpness = self.chance(0.3).then(|| Sharpness {
            px_per_bit: self.within(1.0, 3.0),
            bits: 8,
        });
        let set = Visibility {
            camera,
            mount,
            tag,
            d_max: self.within(3.0, 6.0),
            phi_max_deg: self.within(20.0, 60.0),
            psi_max_deg: self.within(40.0, 80.0),
            z_near: self.within(0.05, 0.3),
            tag_tolerance: if tolerant {
                self.tolerance(0.05, 3.0)
            } else {
                Tolerance::NONE
            },
            mount_tolerance: if tolerant {
                self.tolerance(0.02, 1.5)
            } else {
                Tolerance::NONE
            },
            sharpness,
            error_room: None,
        };
        let walls = (0..self.below(3)).map(|_| self.wall(goal, at)).collect();
        View {
            set,
            d_min: self.chance(0.3).then(|| self.within(0.5, 2.0)),
            psi_min_deg: self.chance(0.3).then(|| self.within(3.0, 20.0)),
            walls,
            limit: self.chance(0.2).then(|| {
                let translation = self.within(0.03, 0.1);
                ErrorLimit {
                    model: if translation < 0.065 {
                        ErrorModel {
                            translation: [0.005, 0.004, 0.01, 0.02],
                            yaw_deg: [0.1, 0.05, 0.2, 0.6],
                        }
                    } else {
                        // For a tag that is seen head-on the yaw has the largest error, and sometimes the position
                        // too.
                        let falls = if translation < 0.08 { 0.02 } else { -0.03 };
                        ErrorModel {
                            translation: [0.07, 0.002, 0.01, falls],
                            yaw_deg: [2.0, 0.02, 0.1, -1.0],
                        }
                    },
                    translation,
                    yaw_deg: self.within(0.5, 2.0),
                }
            }),
        }
    }

    /// Returns a wall or a block somewhere between goal and tag.
    fn wall(&mut self, goal: PoseDeg, tag: [f64; 2]) -> Wall {
        let part = self.within(0.3, 0.9);
        let middle = [
            goal.x + part * (tag[0] - goal.x) + self.within(-0.8, 0.8),
            goal.y + part * (tag[1] - goal.y) + self.within(-0.8, 0.8),
        ];
        let corners = if self.chance(0.5) {
            let (sin, cos) = self.within(0.0, 6.3).sin_cos();
            let half = self.within(0.1, 0.6);
            vec![
                [middle[0] - half * cos, middle[1] - half * sin],
                [middle[0] + half * cos, middle[1] + half * sin],
            ]
        } else {
            let polygon = self.polygon(0.1, 0.4, 0.0);
            polygon
                .iter()
                .map(|[x, y]| [middle[0] + x, middle[1] + y])
                .collect()
        };
        let low = if self.chance(0.7) {
            0.0
        } else {
            self.within(0.3, 0.8)
        };
        Wall {
            name: "wall".into(),
            corners,
            z: [low, low + self.within(0.2, 1.5)],
            keep_outs: Vec::new(),
        }
    }
}

impl Tree {
    fn forget_tolerances(&mut self) {
        match self {
            Self::View(view) => {
                view.set.tag_tolerance = Tolerance::NONE;
                view.set.mount_tolerance = Tolerance::NONE;
                // The crate's limit uses a lower bound of a bit's width.
                view.set.sharpness = None;
            }
            Self::Any(trees) | Self::All(trees) => {
                trees.iter_mut().for_each(Self::forget_tolerances);
            }
            _ => {}
        }
    }

    /// Returns the same set in the crate's types.
    pub fn shape(&self) -> Shape {
        let all = |trees: &[Self]| trees.iter().map(Self::shape).collect();
        match self {
            Self::Box(set) => Shape::Box(*set),
            Self::Footprint(robot, regions) => match regions.as_slice() {
                [only] => {
                    Shape::Footprint(Footprint::new(robot.clone(), only.clone()).expect("polygons"))
                }
                _ => Shape::footprint_in_union(robot, regions).expect("polygons"),
            },
            Self::Clear(robot, obstacle) => Shape::Apart(Exclusion::Obstacle(
                Clear::new(robot.clone(), obstacle.clone()).expect("polygons"),
            )),
            Self::View(view) => view.shape(),
            Self::Any(trees) => Shape::Any(all(trees)),
            Self::All(trees) => Shape::All(all(trees)),
        }
    }
}

impl View {
    fn shape(&self) -> Shape {
        let view = self.set;
        let mut all = vec![match self.limit {
            Some(limit) => Shape::Bounded { view, limit },
            None => Shape::Visibility(view),
        }];
        let apart = |set| Shape::Apart(set);
        all.extend(
            self.d_min
                .map(|d_min| apart(Exclusion::Near { view, d_min })),
        );
        all.extend(
            self.psi_min_deg
                .map(|psi_min_deg| apart(Exclusion::Square { view, psi_min_deg })),
        );
        all.extend(self.walls.iter().map(|wall| {
            apart(Exclusion::Hidden {
                view,
                wall: wall.clone(),
            })
        }));
        Shape::All(all)
    }
}
