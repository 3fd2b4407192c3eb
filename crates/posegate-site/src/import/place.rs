//! Rigid transforms: from quaternions, composed, and back to angles.

use posegate::shape::{Pose3Deg, PoseDeg, Scalar, rotation};

/// A matrix by rows.
pub(super) type Matrix = [[f64; 3]; 3];

/// The largest difference of a quaternion's length from 1: files round to three digits or more.
pub(super) const LENGTH_SLACK: f64 = 1e-3;

/// A frame in another frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    turn: Matrix,
    at: [f64; 3],
}

impl Frame {
    /// Returns a frame with a position (metres) and a quaternion w, x, y, z; `Err` with the quaternion's
    /// length if that is not 1.
    pub(super) fn of_quaternion(at: [f64; 3], wxyz: [f64; 4]) -> Result<Self, f64> {
        let length = libm::sqrt(wxyz.iter().map(|part| part * part).sum());
        if !((length - 1.0).abs() <= LENGTH_SLACK) {
            return Err(length);
        }
        let [w, x, y, z] = wxyz.map(|part| part / length);
        let turn = [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ];
        Ok(Self { turn, at })
    }

    /// Returns a frame with a position (metres) and a rotation by rows; `None` if the rows are not those of a rotation.
    pub(super) fn of_rotation(at: [f64; 3], turn: Matrix) -> Option<Self> {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let [p, q, r] = turn;
        let units = [p, q, r].map(|row| dot(row, row) - 1.0);
        let angles = [dot(p, q), dot(q, r), dot(r, p)];
        let is_small = |off: &f64| off.abs() <= 2.0 * LENGTH_SLACK;
        let across = [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ];
        let is_rotation = units.iter().chain(&angles).all(is_small) && dot(across, r) > 0.0;
        is_rotation.then_some(Self { turn, at })
    }

    pub(super) fn of_pose(pose: Pose3Deg) -> Self {
        Self {
            turn: rotation(pose.roll_deg, pose.pitch_deg, pose.yaw_deg),
            at: [pose.x, pose.y, pose.z],
        }
    }

    /// Converts the frame `inner` from this frame to the frame in which this frame is given.
    pub(super) fn then(&self, inner: &Self) -> Self {
        let [x, y, z] = times(self.turn, inner.at);
        Self {
            turn: product(self.turn, inner.turn),
            at: [self.at[0] + x, self.at[1] + y, self.at[2] + z],
        }
    }

    /// Returns the frame with other axes: the columns are the new axes in the old ones.
    pub(super) fn with_axes(&self, axes: Matrix) -> Self {
        Self {
            turn: product(self.turn, axes),
            at: self.at,
        }
    }

    /// Returns the pose as a site file writes it, rounded to a nanometre and 1e-9 degrees, so that a wall
    /// tag's roll and pitch are exactly 0 and not a rounding error. Faces that look straight up or down
    /// (pitch +-90) get yaw 0.
    pub(super) fn pose(&self) -> Pose3Deg {
        let [[r00, r01, r02], [r10, r11, r12], [r20, _, _]] = self.turn;
        let across = libm::hypot(r00, r10);
        let yaw = if across > 1e-12 {
            libm::atan2(r10, r00)
        } else {
            0.0
        };
        // Pitch and roll of the rotation that remains without the yaw: correct at every pitch.
        let (cy, sy) = (libm::cos(yaw), libm::sin(yaw));
        let pitch = libm::atan2(-r20, cy * r00 + sy * r10);
        let roll = libm::atan2(sy * r02 - cy * r12, cy * r11 - sy * r01);
        let [x, y, z] = self.at.map(tidy);
        Pose3Deg {
            x,
            y,
            z,
            roll_deg: tidy_angle(roll.to_degrees()),
            pitch_deg: tidy_angle(pitch.to_degrees()),
            yaw_deg: tidy_angle(yaw.to_degrees()),
        }
    }
}

/// Returns the transposed matrix: the inverse rotation.
pub(super) fn transposed(rows: Matrix) -> Matrix {
    [0, 1, 2].map(|column| rows.map(|row| row[column]))
}

fn times(rows: Matrix, v: [f64; 3]) -> [f64; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    transposed(transposed(b).map(|column| times(a, column)))
}

/// Converts a planar pose from a frame on the floor to the world.
pub(super) fn on_the_floor(frame: Pose3Deg, inner: PoseDeg) -> PoseDeg {
    let [c, s] = f64::cos_sin_deg(frame.yaw_deg);
    PoseDeg {
        x: tidy(frame.x + c * inner.x - s * inner.y),
        y: tidy(frame.y + s * inner.x + c * inner.y),
        yaw_deg: tidy_angle(frame.yaw_deg + inner.yaw_deg),
    }
}

/// Rounds to the nearest multiple of 1e-9; turns -0 into 0.
pub(super) fn tidy(number: f64) -> f64 {
    libm::round(number * 1e9) / 1e9 + 0.0
}

/// Returns the angle in (-180, 180].
pub(super) fn tidy_angle(degrees: f64) -> f64 {
    let turned = tidy(degrees - 360.0 * libm::round(degrees / 360.0));
    if turned <= -180.0 {
        turned + 360.0
    } else {
        turned
    }
}
