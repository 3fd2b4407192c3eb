//! Layouts of one facet with a set, and the exact set's largest `a . P`.

use crate::contain::compact::QuantizedPoseSet;
use crate::contain::facets::{clearance_q14, covers};
use crate::contain::frame::Ready;
use crate::pose::Pose;
use crate::set::{Extent, Growth, PoseSet, SqrtFactor};
use crate::table::{Axes, Facet, Table, checksum};
use core::f64::consts::{FRAC_PI_2, TAU};

/// Upper bound of the `f64` error of the exact side, micrometres.
pub(in crate::contain) const NUMERIC_UM: f64 = 1e-4;
pub(in crate::contain) const NORMAL: f64 = 16_384.0;

/// A layout of one facet, and a set.
#[derive(Clone, Copy, Debug)]
pub(in crate::contain) struct Case {
    pub(in crate::contain) unit: u8,
    pub(in crate::contain) reach: u16,
    pub(in crate::contain) arm: u16,
    pub(in crate::contain) farthest: u16,
    pub(in crate::contain) axes: Axes,
    pub(in crate::contain) point: [i16; 2],
    pub(in crate::contain) facet: Facet,
    pub(in crate::contain) goal: Pose,
    pub(in crate::contain) mean: Pose,
    pub(in crate::contain) extent: Extent,
}

impl Case {
    /// Returns the bytes of a table with this layout.
    pub(in crate::contain) fn bytes(&self) -> Vec<u8> {
        let mut bytes = std::vec![0u8; 176];
        let mut put = |at: usize, field: &[u8]| bytes[at..at + field.len()].copy_from_slice(field);
        put(0, b"POSEGATE\x01\x00\xb0\x00");
        put(16, &self.goal.x_um.to_le_bytes());
        put(20, &self.goal.y_um.to_le_bytes());
        put(24, &self.goal.yaw.0.to_le_bytes());
        // Facets are decided in world axes: the goal's cosine and sine are not used.
        put(28, &(1i32 << 30).to_le_bytes());
        put(44, &1u32.to_le_bytes());
        put(48, &[1, 0, 1, 0]);
        put(60, &[1, 0]);
        put(64, &(1u32 << 16).to_le_bytes());
        put(128, b"exact");
        put(160, b"1");
        put(76, &[176, 0, 0, 0, 36, 0, 0, 0]);
        bytes.extend([self.unit, 1, 1, 0, 1, 0]);
        for limit in [self.reach, self.arm, self.farthest] {
            bytes.extend(limit.to_le_bytes());
        }
        // The whole circle; one frame, one facet.
        bytes.extend([0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 1, 0, 1, 0]);
        bytes.extend([u8::from(matches!(self.axes, Axes::Robot)), 1]);
        let Facet { x, y, b } = self.facet;
        for number in [self.point[0], self.point[1], x, y, b] {
            bytes.extend(number.to_le_bytes());
        }
        let length = bytes.len() as u32 + 4;
        bytes[12..16].copy_from_slice(&length.to_le_bytes());
        let crc = checksum(&bytes);
        bytes.extend(crc.to_le_bytes());
        bytes
    }

    pub(in crate::contain) fn set(&self) -> PoseSet {
        PoseSet::of(self.mean, self.extent)
    }

    /// Returns the decision.
    pub(in crate::contain) fn holds(&self) -> bool {
        let bytes = self.bytes();
        let table = Table::parse(&bytes).unwrap_or_else(|error| panic!("{error:?} {self:?}"));
        covers(table.facets().unwrap(), &self.set(), table.goal().pose)
    }

    pub(in crate::contain) fn with_b(self, b: i32) -> Self {
        let b = b as i16;
        let facet = Facet { b, ..self.facet };
        Self { facet, ..self }
    }

    /// Returns the case with its extent in the plane and its extent in yaw scaled.
    pub(in crate::contain) fn scaled(self, plane: f64, yaw: f64) -> Self {
        let length = |v: i32| (f64::from(v) * plane) as i32;
        let turn = |v: i32| (f64::from(v) * yaw) as i32;
        let scaled = |factor: SqrtFactor| SqrtFactor {
            yaw: turn(factor.yaw),
            x: factor.x.map(length),
            y: factor.y.map(length),
        };
        let extent = match self.extent {
            Extent::Bounded {
                translation_um,
                yaw_q24,
            } => Extent::Bounded {
                translation_um: length(translation_um),
                yaw_q24: turn(yaw_q24),
            },
            Extent::Gaussian(factor) => Extent::Gaussian(scaled(factor)),
            Extent::Grown { factor, by } => Extent::Grown {
                factor: scaled(factor),
                by: Growth::new(
                    length(by.translation_um()) as u32,
                    turn(by.yaw_q24()) as u32,
                ),
            },
        };
        Self { extent, ..self }
    }

    pub(in crate::contain) fn scale_um(&self) -> f64 {
        f64::from(1u32 << self.unit)
    }

    pub(in crate::contain) fn heading(&self) -> f64 {
        f64::from(self.mean.yaw.0) / 4_294_967_296.0 * TAU
    }

    fn normal(&self) -> [f64; 2] {
        [self.facet.x, self.facet.y].map(|v| f64::from(v) / NORMAL)
    }

    /// Returns the estimate relative to the goal, micrometres.
    fn offset(&self) -> [f64; 2] {
        [
            f64::from(self.mean.x_um) - f64::from(self.goal.x_um),
            f64::from(self.mean.y_um) - f64::from(self.goal.y_um),
        ]
    }

    pub(in crate::contain) fn is_disc(&self) -> bool {
        matches!(self.extent, Extent::Bounded { .. })
    }

    /// Returns the largest yaw offset, radians.
    pub(in crate::contain) fn turn(&self) -> f64 {
        let yaw = match self.extent {
            Extent::Bounded { yaw_q24, .. } => yaw_q24,
            Extent::Gaussian(factor) | Extent::Grown { factor, .. } => factor.yaw,
        };
        f64::from(yaw) / 16_777_216.0 * TAU
    }

    /// Returns the case grown by a movement.
    pub(in crate::contain) fn whole_turn(&self) -> f64 {
        match self.extent {
            Extent::Grown { by, .. } => self.turn() + f64::from(by.yaw_q24()) / 16_777_216.0 * TAU,
            _ => self.turn(),
        }
    }

    /// Returns the largest `a . P` at the share `u1` of the largest yaw offset, micrometres.
    ///
    /// Estimate and goal are each within 0.5 um of their integers: together 1 um on each world axis.
    /// The clearance covers this too.
    fn support_at(&self, u1: f64, turn: f64) -> f64 {
        let Extent::Grown { by, .. } = self.extent else {
            return self.support_turned(u1, turn, 0.0);
        };
        let swing = f64::from(by.yaw_q24()) / 16_777_216.0 * TAU;
        let shares = (-4..=4).map(|k| f64::from(k) / 4.0 * swing);
        let supports = shares.map(|swing| self.support_turned(u1, turn, swing));
        supports.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The same where the robot has turned by `swing` since, radians.
    fn support_turned(&self, u1: f64, turn: f64, swing: f64) -> f64 {
        let (sin, cos) = (self.heading() + u1 * turn + swing).sin_cos();
        let ([ax, ay], [mx, my]) = (self.normal(), self.offset());
        let [vx, vy] = self.point.map(|v| f64::from(v) * self.scale_um());
        let (normal, place) = match self.axes {
            Axes::World => {
                let carried = [cos * vx - sin * vy, sin * vx + cos * vy];
                ([ax, ay], [mx + carried[0], my + carried[1]])
            }
            Axes::Robot => {
                let normal = [cos * ax - sin * ay, sin * ax + cos * ay];
                (normal, [mx - vx, my - vy])
            }
        };
        let [nx, ny] = normal;
        let spread = match self.extent {
            Extent::Bounded { translation_um, .. } => f64::from(translation_um) * nx.hypot(ny),
            Extent::Gaussian(factor) | Extent::Grown { factor, .. } => {
                let column = |i: usize| nx * f64::from(factor.x[i]) + ny * f64::from(factor.y[i]);
                column(0) * u1 + (1.0 - u1 * u1).max(0.0).sqrt() * column(1).hypot(column(2))
            }
        };
        let moved = match self.extent {
            Extent::Grown { by, .. } => f64::from(by.translation_um()) * nx.hypot(ny),
            _ => 0.0,
        };
        let spread = spread + moved;
        nx * place[0] + ny * place[1] + spread + nx.abs() + ny.abs()
    }

    /// Returns the largest `a . P` over the set, micrometres, as a lower bound.
    fn support(&self) -> f64 {
        // The share is a sine, so that the root is smooth at both ends.
        let turn = self.turn();
        let at = |phi: f64| self.support_at(phi.sin(), turn);
        const STEPS: i32 = 40;
        let step = 2.0 * FRAC_PI_2 / f64::from(STEPS);
        let place = |i: i32| -FRAC_PI_2 + f64::from(i) * step;
        let seen: Vec<f64> = (0..=STEPS).map(|i| at(place(i))).collect();
        let mut best = f64::NEG_INFINITY;
        for i in 0..=STEPS {
            let here = seen[i as usize];
            best = best.max(here);
            let next = |j: i32| seen.get(j as usize).copied().unwrap_or(f64::NEG_INFINITY);
            if here < next(i - 1) || here < next(i + 1) {
                continue;
            }
            let (mut low, mut high) = (place(i) - step, place(i) + step);
            for _ in 0..24 {
                let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
                let (va, vb) = (at(a), at(b));
                best = best.max(va).max(vb);
                if va < vb {
                    low = a;
                } else {
                    high = b;
                }
            }
        }
        best
    }

    /// Returns the slack of a facet that accepts the set, micrometres: below zero the decision is a
    /// wrong "inside".
    pub(in crate::contain) fn slack_um(&self) -> f64 {
        (f64::from(self.facet.b) + self.clearance() / NORMAL) * self.scale_um() - self.support()
    }

    /// Returns the lever as the layout computes it.
    pub(in crate::contain) fn lever(&self) -> u32 {
        let [x, y] = self.point.map(|v| u32::from(v.unsigned_abs()));
        match self.axes {
            Axes::World => u32::from(self.arm),
            Axes::Robot => u32::from(self.arm).max(x + y + 2 * u32::from(self.reach)),
        }
    }

    /// Returns how much the rounding of the estimate favours acceptance over the yaw extent, length
    /// units; and the extent's unit.
    pub(in crate::contain) fn favour(&self) -> Option<(f64, f64)> {
        let bytes = self.bytes();
        let table = Table::parse(&bytes).unwrap();
        let layout = table.facets().unwrap();
        let set = self.set();
        let ready = Ready::of(QuantizedPoseSet::of(layout, &set, self.goal)?, layout)?;
        let frame = layout.pieces().next()?.frames().next()?;
        let seen = ready.seen(&frame);
        let (sin, cos) = self.heading().sin_cos();
        let [mx, my] = self.offset().map(|v| v / self.scale_um());
        let [vx, vy] = self.point.map(f64::from);
        let [ax, ay] = self.normal();
        let (sx, sy) = (f64::from(seen.x), f64::from(seen.y));
        // The part of the error that is the same at every yaw offset, and the part that rotates with
        // it.
        let (still, [ex, ey]) = match self.axes {
            Axes::World => {
                let [x, y] = [ready.set.x, ready.set.y].map(f64::from);
                let carried = [cos * vx - sin * vy, sin * vx + cos * vy];
                let wrong = [carried[0] - (sx - x), carried[1] - (sy - y)];
                (ax * (mx - x) + ay * (my - y), wrong)
            }
            Axes::Robot => {
                let (x, y) = (mx - vx, my - vy);
                (0.0, [cos * x + sin * y - sx, cos * y - sin * x - sy])
            }
        };
        let (along, across) = (ax * ex + ay * ey, ay * ex - ax * ey);
        let (sin, cos) = self.turn().sin_cos();
        // The maximum of `cos t along + sin t across`.
        let turned = if across.abs() * cos > along * sin {
            cos * along + sin * across.abs()
        } else {
            along.hypot(across)
        };
        Some((still + turned, f64::from(1u32 << ready.set.unit)))
    }

    /// Returns the clearance for roundings of the estimate, length units, without those to
    /// micrometres.
    pub(in crate::contain) fn granted(&self) -> f64 {
        (self.clearance()
            - (f64::from(self.facet.x).abs() + f64::from(self.facet.y).abs()) / self.scale_um())
            / NORMAL
    }

    fn clearance(&self) -> f64 {
        let turns = self.point != [0, 0];
        let lever = self.lever() as u16;
        clearance_q14(self.facet, self.axes, turns, self.unit, lever) as f64
    }
}
