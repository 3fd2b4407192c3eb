//! Success sets by their definitions, with tag, camera and dock displaced within their tolerances.

use crate::random::{Random, Tree, View, World};
use posegate::shape::{Tolerance, Wall};

/// A pose that is outside by less than this may be outside only by rounding, metres.
const ROUNDING: f64 = 1e-6;

type Point = [f64; 3];

/// The true places: each differs from the surveyed place by no more than its tolerance.
pub struct Nature {
    dock: Off,
    tag: Off,
    mount: Off,
    /// Points on the tag's face, in units of its half width, whose lines of sight past walls are checked.
    face: Vec<[f64; 2]>,
}

/// A displacement by a translation and a rotation, as shares of the tolerance.
struct Off {
    translation: Point,
    turn: f64,
    axis: Point,
}

impl Nature {
    pub fn random(random: &mut Random, _: &World) -> Self {
        let direction = |random: &mut Random| loop {
            let v: Point = core::array::from_fn(|_| random.within(-1.0, 1.0));
            let length = dot(v, v).sqrt();
            if length > 0.1 && length < 1.0 {
                // Mostly at the limit.
                let by = if random.chance(0.7) {
                    1.0
                } else {
                    random.within(0.0, 1.0)
                };
                break v.map(|c| c / length * by * (1.0 - 1e-9));
            }
        };
        let off = |random: &mut Random| Off {
            translation: direction(random),
            turn: [-1.0, 1.0, random.within(-1.0, 1.0)][random.below(3) as usize] * (1.0 - 1e-9),
            axis: {
                let v = direction(random);
                let length = dot(v, v).sqrt().max(1e-9);
                v.map(|c| c / length)
            },
        };
        let (dock, tag, mount) = (off(random), off(random), off(random));
        let mut face = vec![[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        face.extend((0..4).map(|_| [random.within(-1.0, 1.0), random.within(-1.0, 1.0)]));
        Self {
            dock,
            tag,
            mount,
            face,
        }
    }

    /// Returns the surveyed places, with many points on each tag's face.
    pub fn as_surveyed(random: &mut Random) -> Self {
        let off = || Off {
            translation: [0.0; 3],
            turn: 0.0,
            axis: UP,
        };
        let mut face = Vec::new();
        for y in 0..9 {
            for z in 0..9 {
                face.push([f64::from(y) / 4.0 - 1.0, f64::from(z) / 4.0 - 1.0]);
            }
        }
        face.extend((0..20).map(|_| [random.within(-1.0, 1.0), random.within(-1.0, 1.0)]));
        let (dock, tag, mount) = (off(), off(), off());
        Self {
            dock,
            tag,
            mount,
            face,
        }
    }

    /// Returns the reason why a pose of the goal frame is not in the set; `None` if it is in the set.
    pub fn fault(&self, world: &World, pose: [f64; 3]) -> Option<String> {
        self.tree(&world.tree, world, pose).err()
    }

    fn tree(&self, tree: &Tree, world: &World, pose: [f64; 3]) -> Result<(), String> {
        match tree {
            Tree::Any(trees) => {
                // The displacement is the same for all parts.
                let faults: Vec<_> = trees.iter().map(|t| self.tree(t, world, pose)).collect();
                if faults.iter().any(Result::is_ok) {
                    Ok(())
                } else {
                    Err(format!("any of {faults:?}"))
                }
            }
            Tree::All(trees) => trees.iter().try_for_each(|t| self.tree(t, world, pose)),
            Tree::View(view) => self.view(view, world, pose),
            Tree::Box(set) => {
                let [x, y, yaw] = self.as_the_dock_sees(world, pose);
                let in_range = |v: f64, [lo, hi]: [f64; 2], by: f64| v >= lo - by && v <= hi + by;
                let turned = (-3..=3)
                    .any(|k| in_range(yaw.to_degrees() + 360.0 * f64::from(k), set.yaw_deg, 1e-5));
                (in_range(x, set.x, ROUNDING) && in_range(y, set.y, ROUNDING) && turned)
                    .then_some(())
                    .ok_or(format!("box {x} {y} {yaw}"))
            }
            Tree::Footprint(robot, regions) => {
                let robot = placed(robot, self.as_the_dock_sees(world, pose));
                // Points all over the footprint must each be in one of the regions.
                let held = |p: [f64; 2]| regions.iter().any(|r| depth(r, p) > -ROUNDING);
                points_of(&robot)
                    .into_iter()
                    .all(held)
                    .then_some(())
                    .ok_or("region".into())
            }
            Tree::Clear(robot, obstacle) => {
                let robot = placed(robot, self.as_the_dock_sees(world, pose));
                let overlap = match robot.as_slice() {
                    [point] => depth(obstacle, *point),
                    _ => width(&common(&robot, obstacle)),
                };
                (overlap < ROUNDING)
                    .then_some(())
                    .ok_or(format!("obstacle {overlap}"))
            }
        }
    }

    /// Converts a pose of the surveyed goal frame to the frame of the true dock.
    fn as_the_dock_sees(&self, world: &World, [x, y, yaw]: [f64; 3]) -> [f64; 3] {
        let Tolerance {
            translation,
            turn_deg,
        } = world.dock;
        // The dock is displaced on the floor.
        let level = self.dock.translation[0]
            .hypot(self.dock.translation[1])
            .max(1.0);
        let [tx, ty] = [0, 1].map(|i| self.dock.translation[i] / level * translation);
        let turn = self.dock.turn * turn_deg.to_radians();
        let (sin, cos) = turn.sin_cos();
        let (dx, dy) = (x - tx, y - ty);
        [cos * dx + sin * dy, cos * dy - sin * dx, yaw - turn]
    }

    fn view(&self, view: &View, world: &World, [x, y, yaw]: [f64; 3]) -> Result<(), String> {
        let set = &view.set;
        let goal = world.success.goal;
        let (gs, gc) = goal.yaw_deg.to_radians().sin_cos();
        let robot = [goal.x + gc * x - gs * y, goal.y + gs * x + gc * y, 0.0];
        let heading = yaw + goal.yaw_deg.to_radians();
        let to_world = |p: Point| add(robot, turn_about(UP, heading, p));
        // The camera.
        let mount = set.mount;
        let by = set.mount_tolerance;
        let turned = |p: Point| {
            let p = fixed_axes(mount.roll_deg, mount.pitch_deg, mount.yaw_deg, p);
            turn_about(
                self.mount.axis,
                self.mount.turn * by.turn_deg.to_radians(),
                p,
            )
        };
        let place = add(
            [mount.x, mount.y, mount.z],
            scaled(self.mount.translation, by.translation),
        );
        let camera = to_world(place);
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|axis| turn_about(UP, heading, turned(axis)));
        // The tag.
        let tag = set.tag.pose;
        let by = set.tag_tolerance;
        let turned_with_tag = |p: Point| {
            let p = fixed_axes(tag.roll_deg, tag.pitch_deg, tag.yaw_deg, p);
            turn_about(UP, self.tag.turn * by.turn_deg.to_radians(), p)
        };
        let centre = add(
            [tag.x, tag.y, tag.z],
            scaled(self.tag.translation, by.translation),
        );
        let normal = turned_with_tag([1.0, 0.0, 0.0]);
        let half = 0.5 * set.tag.size;
        let on_face = |[y, z]: [f64; 2]| add(centre, turned_with_tag([0.0, y * half, z * half]));
        for corner in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            let ray = minus(on_face(corner), camera);
            let [depth, left, up] = axes.map(|axis| dot(axis, ray));
            let c = &set.camera;
            let (u, v) = (c.cx - c.fx * left / depth, c.cy - c.fy * up / depth);
            let in_image =
                u >= -1e-3 && v >= -1e-3 && u <= c.width_px + 1e-3 && v <= c.height_px + 1e-3;
            if !(depth >= set.z_near - ROUNDING && in_image) {
                return Err(format!("corner at {u} {v}, depth {depth}"));
            }
        }
        let ray = minus(centre, camera);
        let d = dot(ray, ray).sqrt();
        let angle = |a: Point, b: Point| {
            let cross = [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ];
            dot(cross, cross).sqrt().atan2(dot(a, b))
        };
        let (phi, psi) = (angle(axes[0], ray), angle(normal, scaled(ray, -1.0)));
        let most = |name: &str, value: f64, limit: f64| {
            if value <= limit + ROUNDING {
                Ok(())
            } else {
                Err(format!("{name} {value} > {limit}"))
            }
        };
        most("d", d, set.d_max)?;
        most("phi", phi, set.phi_max_deg.to_radians())?;
        most("psi", psi, set.psi_max_deg.to_radians())?;
        if let Some(d_min) = view.d_min {
            most("d_min", d_min, d)?;
        }
        if let Some(psi_min) = view.psi_min_deg {
            most("psi_min", psi_min.to_radians(), psi)?;
        }
        if let Some(sharp) = set.sharpness {
            // The smaller extent of a bit at the tag's centre in the image, by its projection.
            let bit = set.tag.size / f64::from(sharp.bits);
            let image = |p: Point| {
                let ray = minus(p, camera);
                let [depth, left, up] = axes.map(|axis| dot(axis, ray));
                [set.camera.fx * left / depth, set.camera.fy * up / depth]
            };
            let step = 1e-4 * bit;
            for way in [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
                let [a, b] =
                    [0.5, -0.5].map(|s| image(add(centre, turned_with_tag(scaled(way, s * step)))));
                let width = (a[0] - b[0]).hypot(a[1] - b[1]) / step * bit;
                most("px_per_bit", sharp.px_per_bit, width * (1.0 + 1e-6))?;
            }
        }
        if let Some(limit) = view.limit {
            let bound = |c: [f64; 4]| c[0] + c[1] * d * d + c[2] * phi * phi + c[3] * psi * psi;
            // The robot computes its pose from the surveyed places of tag and camera.
            let (tag_turn, mount_turn) = (
                self.tag.turn * set.tag_tolerance.turn_deg.to_radians(),
                self.mount.turn * set.mount_tolerance.turn_deg.to_radians(),
            );
            let leaned = |p: Point| turn_about(self.mount.axis, mount_turn, p);
            let base = to_world(minus(place, leaned([mount.x, mount.y, mount.z])));
            let back = turn_about(UP, -tag_turn, minus(base, centre));
            let off = minus(add([tag.x, tag.y, tag.z], back), robot);
            let ahead = leaned([1.0, 0.0, 0.0]);
            let turned = (ahead[1].atan2(ahead[0]) - tag_turn).to_degrees().abs();
            let moved = off[0].hypot(off[1]);
            most(
                "error",
                bound(limit.model.translation) + moved,
                limit.translation,
            )?;
            most(
                "yaw error",
                bound(limit.model.yaw_deg) + turned,
                limit.yaw_deg,
            )?;
        }
        for wall in &view.walls {
            for point in &self.face {
                let inside = within(wall, camera, on_face(*point));
                if inside > 1e-5 {
                    return Err(format!("wall: {inside} m of the sight line"));
                }
            }
        }
        Ok(())
    }
}

const UP: Point = [0.0, 0.0, 1.0];

/// Returns the length of a line of sight inside a wall, metres. For a thin wall: the depth within its rectangle at
/// which the line crosses.
fn within(wall: &Wall, from: Point, to: Point) -> f64 {
    let way = minus(to, from);
    let length = dot(way, way).sqrt();
    let at = |t: f64| add(from, scaled(way, t));
    if let [a, b] = wall.corners.as_slice() {
        let along = [b[0] - a[0], b[1] - a[1]];
        let size = along[0].hypot(along[1]);
        let side = |p: Point| (along[0] * (p[1] - a[1]) - along[1] * (p[0] - a[0])) / size;
        let (s, e) = (side(from), side(to));
        if s * e >= 0.0 {
            return 0.0;
        }
        let p = at(s / (s - e));
        let t = ((p[0] - a[0]) * along[0] + (p[1] - a[1]) * along[1]) / size;
        // The distance within the wall's rectangle.
        return [
            t,
            size - t,
            p[2] - wall.z[0],
            wall.z[1] - p[2],
            s.abs(),
            e.abs(),
        ]
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    }
    let (mut enter, mut leave) = (0.0f64, 1.0f64);
    let mut clip = |start: f64, end: f64| {
        // The line is inside where the value between start and end is above zero.
        if start < 0.0 && end < 0.0 {
            leave = -1.0;
        } else if start < 0.0 {
            enter = enter.max(start / (start - end));
        } else if end < 0.0 {
            leave = leave.min(start / (start - end));
        }
    };
    let ends = wall.corners.iter().cycle().skip(1);
    for (a, b) in wall.corners.iter().zip(ends) {
        let side = |p: Point| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        clip(side(from), side(to));
    }
    clip(from[2] - wall.z[0], to[2] - wall.z[0]);
    clip(wall.z[1] - from[2], wall.z[1] - to[2]);
    (leave - enter) * length
}

/// Returns a polygon of the robot at a pose.
fn placed(polygon: &[[f64; 2]], [x, y, yaw]: [f64; 3]) -> Vec<[f64; 2]> {
    let (sin, cos) = yaw.sin_cos();
    polygon
        .iter()
        .map(|[px, py]| [x + cos * px - sin * py, y + sin * px + cos * py])
        .collect()
}

/// Returns the distance of a point in a convex polygon to the nearest edge, negative outside.
fn depth(polygon: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let ends = polygon.iter().cycle().skip(1);
    polygon
        .iter()
        .zip(ends)
        .map(|(a, b)| {
            let along = [b[0] - a[0], b[1] - a[1]];
            (along[0] * (p[1] - a[1]) - along[1] * (p[0] - a[0])) / along[0].hypot(along[1])
        })
        .fold(f64::INFINITY, f64::min)
}

/// Returns the intersection of two convex polygons: one cut along the edges of the other.
fn common(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut rest = a.to_vec();
    let ends = b.iter().cycle().skip(1);
    for (from, to) in b.iter().zip(ends) {
        let height = |p: [f64; 2]| {
            (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0])
        };
        let mut kept = Vec::new();
        for (i, p) in rest.iter().enumerate() {
            let q = rest[(i + 1) % rest.len()];
            let (hp, hq) = (height(*p), height(q));
            if hp >= 0.0 {
                kept.push(*p);
            }
            if hp * hq < 0.0 {
                let t = hp / (hp - hq);
                kept.push([0, 1].map(|i| p[i] + t * (q[i] - p[i])));
            }
        }
        rest = kept;
    }
    rest
}

/// Returns twice the area of a polygon over its longest side: about its width.
fn width(polygon: &[[f64; 2]]) -> f64 {
    let ends = polygon.iter().cycle().skip(1);
    let (mut area, mut longest) = (0.0, 1e-9f64);
    for (a, b) in polygon.iter().zip(ends) {
        area += a[0] * b[1] - a[1] * b[0];
        longest = longest.max((b[0] - a[0]).hypot(b[1] - a[1]));
    }
    area.abs() / longest
}

/// Returns points all over a convex polygon: its corners, and points between them and its middle.
fn points_of(polygon: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let count = polygon.len() as f64;
    let middle = [0, 1].map(|i| polygon.iter().map(|p| p[i]).sum::<f64>() / count);
    let ends = polygon.iter().cycle().skip(1);
    let mut points = vec![middle];
    for (a, b) in polygon.iter().zip(ends) {
        for k in 0..12 {
            let t = f64::from(k) / 12.0;
            let edge = [0, 1].map(|i| a[i] + t * (b[i] - a[i]));
            for share in [1.0, 0.95, 0.6, 0.3] {
                points.push([0, 1].map(|i| middle[i] + share * (edge[i] - middle[i])));
            }
        }
    }
    points
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn scaled(a: Point, by: f64) -> Point {
    a.map(|c| c * by)
}

/// Returns `Rz(yaw) Ry(pitch) Rx(roll) p`, one rotation after the other.
fn fixed_axes(roll_deg: f64, pitch_deg: f64, yaw_deg: f64, p: Point) -> Point {
    let p = turn_about([1.0, 0.0, 0.0], roll_deg.to_radians(), p);
    let p = turn_about([0.0, 1.0, 0.0], pitch_deg.to_radians(), p);
    turn_about(UP, yaw_deg.to_radians(), p)
}

/// Rotates a point about a unit axis (Rodrigues).
fn turn_about(k: Point, angle: f64, p: Point) -> Point {
    let (sin, cos) = angle.sin_cos();
    let cross = [
        k[1] * p[2] - k[2] * p[1],
        k[2] * p[0] - k[0] * p[2],
        k[0] * p[1] - k[1] * p[0],
    ];
    let along = dot(k, p) * (1.0 - cos);
    [0, 1, 2].map(|i| p[i] * cos + cross[i] * sin + k[i] * along)
}
