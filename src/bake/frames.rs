//! A success set as frames: the points of the robot or of the world that its constraints refer to,
//! and the convex region in which each of them may be ([`crate::table::Facets`]).

use super::border::{Curve, HalfPlane};
use crate::shape::{Binds, ConvexPart, Footprint, Line, Ready, Resolved, Visibility, edges};
use crate::table::{Axes, Cells};

/// A frame with its constraints, metres, in the goal's axes (or the robot's).
pub(super) struct Draft {
    pub axes: Axes,
    /// v in the robot's axes, or q in the goal frame.
    pub point: [f64; 2],
    pub planes: Vec<HalfPlane>,
    pub curves: Vec<Curve>,
    /// Where P can be for poses of the table's extent.
    pub window: Vec<HalfPlane>,
}

/// Returns the frames of a part within the table's extent; `None` if a constraint holds nowhere.
pub(super) fn of_part(part: &ConvexPart, cells: &Cells) -> Option<Vec<Draft>> {
    let m = |um: i32| f64::from(um) * 1e-6;
    let extent = [
        [m(cells.x_lo_um), m(cells.x_hi_um())],
        [m(cells.y_lo_um), m(cells.y_hi_um())],
    ];
    let mut inner = extent;
    for shape in part.boxes() {
        let sides = [shape.x, shape.y];
        inner = [0, 1].map(|i| [inner[i][0].max(sides[i][0]), inner[i][1].min(sides[i][1])]);
    }
    let mut frames = Vec::new();
    for set in part.ready() {
        match set {
            Ready::Box(_) | Ready::Side(_) => {}
            Ready::Nothing => return None,
            Ready::Footprint(shape) => frames.extend(of_footprint(shape, extent)),
            Ready::Visibility(tag) => {
                frames.extend(of_image_edges(tag, extent)?);
                frames.push(of_optical_axis(tag, extent));
                frames.push(of_tag_cone(tag, extent));
            }
        }
    }
    for set in part.ready() {
        if let Ready::Side(line) = set {
            add_line(&mut frames, line, extent)?;
        }
    }
    frames.push(Draft {
        axes: Axes::World,
        point: [0.0; 2],
        planes: rectangle(inner),
        curves: Vec::new(),
        window: rectangle(extent.map(|[lo, hi]| [lo - 1e-3, hi + 1e-3])),
    });
    Some(frames)
}

/// Adds a half-plane to the frames of the points that it constrains.
fn add_line(frames: &mut Vec<Draft>, line: &Line<f64>, extent: [[f64; 2]; 2]) -> Option<()> {
    let [nx, ny] = line.normal;
    let length = libm::hypot(nx, ny);
    if length < 1e-9 {
        // Holds everywhere or nowhere.
        return (line.offset >= 0.0).then_some(());
    }
    // P is the robot's point, or the vector from the point of the goal frame to the robot.
    let (axes, way) = match line.binds {
        Binds::Robot => (Axes::World, 1.0),
        Binds::Goal => (Axes::Robot, -1.0),
    };
    let plane = HalfPlane {
        normal: [way * nx / length, way * ny / length],
        offset: line.offset / length,
    };
    for point in &line.points {
        let same = |draft: &&mut Draft| draft.axes == axes && draft.point == *point;
        if let Some(draft) = frames.iter_mut().find(same) {
            draft.planes.push(plane);
            continue;
        }
        frames.push(Draft {
            axes,
            point: *point,
            planes: std::vec![plane],
            curves: Vec::new(),
            window: match line.binds {
                Binds::Robot => grown(extent, libm::hypot(point[0], point[1])),
                Binds::Goal => around(farthest(*point, extent)),
            },
        });
    }
    Some(())
}

/// Returns the distance of a point from the farthest pose of an extent, metres.
fn farthest(point: [f64; 2], extent: [[f64; 2]; 2]) -> f64 {
    let axis = |i: usize| {
        (point[i] - extent[i][0])
            .abs()
            .max((point[i] - extent[i][1]).abs())
    };
    libm::hypot(axis(0), axis(1))
}

fn rectangle([[x0, x1], [y0, y1]]: [[f64; 2]; 2]) -> Vec<HalfPlane> {
    let side = |normal: [f64; 2], offset| HalfPlane { normal, offset };
    std::vec![
        side([1.0, 0.0], x1),
        side([-1.0, 0.0], -x0),
        side([0.0, 1.0], y1),
        side([0.0, -1.0], -y0),
    ]
}

fn grown(extent: [[f64; 2]; 2], by: f64) -> Vec<HalfPlane> {
    rectangle(extent.map(|[lo, hi]| [lo - by - 1e-3, hi + by + 1e-3]))
}

/// Returns one frame per vertex, in which every edge of the region is a facet.
fn of_footprint(shape: &Footprint, extent: [[f64; 2]; 2]) -> Vec<Draft> {
    let planes: Vec<HalfPlane> = edges(shape.region())
        .map(|[[ax, ay], [bx, by]]| {
            let length = libm::hypot(bx - ax, by - ay);
            // Outward normal of a counter-clockwise edge.
            let normal = [(by - ay) / length, (ax - bx) / length];
            HalfPlane {
                normal,
                offset: normal[0] * ax + normal[1] * ay - shape.inset(),
            }
        })
        .collect();
    let vertices = shape.footprint().iter();
    vertices
        .map(|vertex| Draft {
            axes: Axes::World,
            point: *vertex,
            planes: planes.clone(),
            curves: Vec::new(),
            window: grown(extent, libm::hypot(vertex[0], vertex[1])),
        })
        .collect()
}

/// Returns the camera's axes in those of the robot: forward, left, up.
fn camera_axes(tag: &Resolved<f64>) -> [[f64; 3]; 3] {
    let [rx, ry, rz] = tag.axes;
    [0, 1, 2].map(|i| [rx[i], ry[i], rz[i]])
}

/// Returns a frame for each place of corners: the edges of the image, and the least depth. `None` if no position sees a corner.
fn of_image_edges(tag: &Resolved<f64>, extent: [[f64; 2]; 2]) -> Option<Vec<Draft>> {
    let [forward, left, up] = camera_axes(tag);
    let [mx, my, mz] = tag.mount;
    // Corners above each other have the same position on the floor.
    let mut places: Vec<([f64; 2], Vec<f64>)> = Vec::new();
    for [x, y, z] in tag.corners {
        let near = |p: &[f64; 2]| libm::hypot(p[0] - x, p[1] - y) < 1e-9;
        match places.iter_mut().find(|(place, _)| near(place)) {
            Some((_, heights)) => heights.push(z),
            None => places.push(([x, y], std::vec![z])),
        }
    }
    let mut frames = Vec::new();
    for (place, heights) in places {
        let mut planes = Vec::new();
        for z in heights {
            // The corner from the camera is (-P - m, z - m_z) in the robot's axes, and
            // direction . that >= least.
            let mut side = |[fs, ls, us]: [f64; 3], least: f64| {
                let n = [0, 1, 2].map(|i| {
                    let mut n = fs * forward[i];
                    if ls != 0.0 {
                        n += ls * left[i];
                    }
                    if us != 0.0 {
                        n += us * up[i];
                    }
                    n
                });
                let size = libm::sqrt(fs * fs + ls * ls + us * us);
                let offset =
                    n[2] * (z - mz) - n[0] * mx - n[1] * my - least - tag.less.corner * size;
                let length = libm::hypot(n[0], n[1]);
                if length > 1e-9 * size {
                    planes.push(HalfPlane {
                        normal: [n[0] / length, n[1] / length],
                        offset: offset / length,
                    });
                    true
                } else {
                    offset > 1e-9 * size
                }
            };
            let window = tag.set.camera.view();
            let holds = side([1.0, 0.0, 0.0], tag.set.z_near)
                && window
                    .planes()
                    .iter()
                    .all(|[a, b, c]| side([*c, -a, -b], 0.0));
            if !holds {
                return None;
            }
        }
        frames.push(Draft {
            axes: Axes::Robot,
            point: place,
            planes,
            curves: Vec::new(),
            window: around(farthest(place, extent)),
        });
    }
    Some(frames)
}

/// Returns the frame of the angle between the optical axis and the ray to the tag's centre.
fn of_optical_axis(tag: &Resolved<f64>, extent: [[f64; 2]; 2]) -> Draft {
    let [forward, ..] = camera_axes(tag);
    let [mx, my, mz] = tag.mount;
    let [cx, cy, cz] = tag.centre;
    let height = cz - mz;
    let (cos_phi, less) = (tag.cos_phi, tag.less);
    let mut window = around(farthest([cx, cy], extent));
    // The camera is in front of the tag, so the cone's other half and its tip are excluded.
    let flat = libm::hypot(forward[0], forward[1]);
    if flat > 1e-3 {
        let near = (-(forward[2] * height) + 0.2 * tag.set.z_near.min(tag_depth(&tag.set))) / flat;
        let normal = [forward[0] / flat, forward[1] / flat];
        window.push(HalfPlane {
            normal,
            offset: -near - normal[0] * mx - normal[1] * my,
        });
    }
    Draft {
        axes: Axes::Robot,
        point: [cx, cy],
        planes: Vec::new(),
        curves: std::vec![Box::new(move |[x, y]: [f64; 2]| {
            let plain = [-x - mx, -y - my, height];
            let ray = [0, 1, 2].map(|i| plain[i] - less.phi * forward[i]);
            forward[0] * ray[0] + forward[1] * ray[1] + forward[2] * ray[2] - cos_phi * length(ray)
        })],
        window,
    }
}

/// Returns the frame of distance and obliqueness at the camera, and of the ball that the camera must be in.
fn of_tag_cone(tag: &Resolved<f64>, extent: [[f64; 2]; 2]) -> Draft {
    let [mx, my, mz] = tag.mount;
    let [cx, cy, cz] = tag.centre;
    let height = cz - mz;
    let (cos_psi, less) = (tag.cos_psi, tag.less);
    let normal = tag.normal;
    let d_max = tag.set.d_max - less.ray;
    // The vector to the camera from a point in front of the tag's centre.
    let back = move |[x, y]: [f64; 2], before: f64| {
        let plain = [x - cx, y - cy, -height];
        [0, 1, 2].map(|i| plain[i] - before * normal[i])
    };
    let mut curves: Vec<Curve> = std::vec![
        Box::new(move |p| d_max - length(back(p, 0.0))),
        Box::new(move |p| {
            let back = back(p, less.psi);
            let facing = normal[0] * back[0] + normal[1] * back[1] + normal[2] * back[2];
            facing - cos_psi * length(back)
        }),
    ];
    if let Some([middle, radius]) = tag.ball {
        curves.push(Box::new(move |p| radius - length(back(p, middle))));
    }
    Draft {
        axes: Axes::World,
        point: [mx, my],
        planes: Vec::new(),
        curves,
        window: grown(extent, libm::hypot(mx, my)),
    }
}

/// Returns a depth at which a tag is certain to fill more than the image.
fn tag_depth(shape: &Visibility) -> f64 {
    let camera = shape.camera;
    0.5 * shape.tag.size * (camera.fx / camera.width_px).min(camera.fy / camera.height_px)
}

fn around(reach: f64) -> Vec<HalfPlane> {
    let reach = reach + 1e-3;
    rectangle([[-reach, reach], [-reach, reach]])
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    libm::sqrt(x * x + y * y + z * z)
}
