//! Sets, poses and pose sets as a site file writes them: metres and degrees, the tag in the world
//! frame; and the same in radians.

use super::{Camera, Pose, PoseSet, Set, chi2_quantile_3dof, to_goal};

/// Rounds to the nearest 1e-4 m.
pub fn metres(v: f64) -> f64 {
    (v * 1e4).round() / 1e4
}

/// Rounds to the nearest 1e-3 degrees.
pub fn degrees(v: f64) -> f64 {
    (v * 1e3).round() / 1e3
}

/// Rounds a heading of [-180, 180] to the nearest 1e-3 degrees, with 180 as -180.
pub fn heading(v: f64) -> f64 {
    let v = degrees(v);
    if v >= 180.0 { -180.0 } else { v }
}

/// A set with its angles in degrees, and the tag in the world frame, as a site file writes them.
#[derive(Clone, Debug, PartialEq)]
pub enum SetDeg {
    Box {
        x: [f64; 2],
        y: [f64; 2],
        yaw_deg: [f64; 2],
    },
    Footprint {
        footprint: Vec<[f64; 2]>,
        region: Vec<[f64; 2]>,
    },
    /// `mount` and `tag_in_world`: x, y, z in metres, roll, pitch, yaw in degrees.
    Visibility {
        camera: Camera,
        mount_deg: [f64; 6],
        tag_in_world_deg: [f64; 6],
        tag_size: f64,
        d_max: f64,
        phi_max_deg: f64,
        psi_max_deg: f64,
        z_near: f64,
    },
}

/// A pose set with its angles in degrees.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseSetDeg {
    /// Sigmas of x, y (m) and yaw (degrees); correlations of x y, x yaw, y yaw.
    Gaussian {
        sigma_deg: [f64; 3],
        correlation: [f64; 3],
        epsilon: f64,
    },
    Bounded {
        translation: f64,
        yaw_deg: f64,
    },
}

/// A pose given with its yaw in degrees.
pub fn pose_from_deg(p: Pose) -> Pose {
    [p[0], p[1], p[2].to_radians()]
}

fn six_from_deg(p: [f64; 6]) -> [f64; 6] {
    [
        p[0],
        p[1],
        p[2],
        p[3].to_radians(),
        p[4].to_radians(),
        p[5].to_radians(),
    ]
}

/// Returns the set in radians, in the goal frame.
pub fn set_from_deg(set: &SetDeg, goal: Pose) -> Set {
    match set.clone() {
        SetDeg::Box { x, y, yaw_deg } => Set::Box {
            x,
            y,
            yaw: yaw_deg.map(f64::to_radians),
        },
        SetDeg::Footprint { footprint, region } => Set::Footprint { footprint, region },
        SetDeg::Visibility {
            camera,
            mount_deg,
            tag_in_world_deg,
            tag_size,
            d_max,
            phi_max_deg,
            psi_max_deg,
            z_near,
        } => {
            let tag = six_from_deg(tag_in_world_deg);
            // The goal frame is turned about z only, so only the tag's x, y and yaw change.
            let [x, y, yaw] = to_goal(goal, [tag[0], tag[1], tag[5]]);
            Set::Visibility {
                camera,
                mount: six_from_deg(mount_deg),
                tag_in_goal: [x, y, tag[2], tag[3], tag[4], yaw],
                tag_size,
                d_max,
                phi_max: phi_max_deg.to_radians(),
                psi_max: psi_max_deg.to_radians(),
                z_near,
            }
        }
    }
}

/// Returns the pose set in radians.
pub fn pose_set_from_deg(p: &PoseSetDeg) -> PoseSet {
    match *p {
        PoseSetDeg::Bounded {
            translation,
            yaw_deg,
        } => PoseSet::Bounded {
            translation,
            yaw: yaw_deg.to_radians(),
        },
        PoseSetDeg::Gaussian {
            sigma_deg: [sx, sy, syaw],
            correlation: [xy, xt, yt],
            epsilon,
        } => {
            let st = syaw.to_radians();
            let (cxy, cxt, cyt) = (xy * sx * sy, xt * sx * st, yt * sy * st);
            PoseSet::Gaussian {
                cov: [
                    [sx * sx, cxy, cxt],
                    [cxy, sy * sy, cyt],
                    [cxt, cyt, st * st],
                ],
                r2: chi2_quantile_3dof(epsilon),
            }
        }
    }
}
