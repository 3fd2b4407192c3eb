//! The covered cells of a grid table, decoded only by this file, and the poses of a
//! pose-set that would leave them first.

use crate::oracle::{Pose, PoseSet};
use std::f64::consts::TAU;

/// A grid table's cells, decoded from the description of format version 1.
pub struct Voxels {
    x_lo: f64,
    y_lo: f64,
    step: f64,
    columns: usize,
    rows: usize,
    yaw_lo: f64,
    edges: Vec<f64>,
    whole: bool,
    covered: Vec<bool>,
}

impl Voxels {
    pub fn read(bytes: &[u8]) -> Self {
        let u16_at = |at: usize| usize::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let metres = |at: usize| f64::from(u32_at(at) as i32) * 1e-6;
        let (columns, rows, slabs) = (u16_at(48), u16_at(50), u16_at(60));
        let unit = TAU / 4_294_967_296.0;
        let span = match u32_at(56) {
            0 => 1u64 << 32,
            span => u64::from(span),
        };
        let edges = (0..=slabs as u64)
            .map(|k| (span * k / slabs as u64) as f64 * unit)
            .collect();
        let mut covered = vec![false; columns * rows * slabs];
        let grid = u32_at(68) as usize;
        let wide = bytes[grid] == 2;
        for slab in 0..slabs {
            let entry = grid + 4 + 8 * slab;
            let at = grid + u32_at(entry) as usize;
            let (first_row, count) = (u16_at(entry + 4), u16_at(entry + 6));
            let several = count & 0x8000 != 0;
            let count = count & 0x7fff;
            let runs_at = if several { at + 2 * (count + 1) } else { at };
            for row in 0..count {
                let runs = if several {
                    u16_at(at + 2 * row)..u16_at(at + 2 * (row + 1))
                } else {
                    row..row + 1
                };
                for run in runs {
                    let (from, to) = if wide {
                        (u16_at(runs_at + 4 * run), u16_at(runs_at + 4 * run + 2))
                    } else {
                        let at = runs_at + 2 * run;
                        (usize::from(bytes[at]), usize::from(bytes[at + 1]))
                    };
                    for column in from..to.saturating_add(1).max(from) {
                        covered[(slab * rows + first_row + row) * columns + column] = true;
                    }
                }
            }
        }
        Self {
            x_lo: metres(36),
            y_lo: metres(40),
            step: metres(44),
            columns,
            rows,
            yaw_lo: f64::from(u32_at(52)) * unit,
            edges,
            whole: span == 1 << 32,
            covered,
        }
    }

    /// Returns `true` if a pose of the goal frame lies in a covered cell or within `tolerance` of one.
    pub fn covers(&self, [x, y, yaw]: Pose, tolerance: f64) -> bool {
        let above = (yaw - self.yaw_lo).rem_euclid(TAU);
        let near = |value: f64| [value - tolerance, value + tolerance];
        near(x).into_iter().any(|x| {
            near(y).into_iter().any(|y| {
                near(above)
                    .into_iter()
                    .any(|yaw| self.is_covered(x, y, yaw))
            })
        })
    }

    fn is_covered(&self, x: f64, y: f64, above: f64) -> bool {
        let index = |value: f64, lo: f64, count: usize| {
            let index = ((value - lo) / self.step).floor();
            (index >= 0.0 && index < count as f64).then_some(index as usize)
        };
        let above = above.rem_euclid(TAU);
        let slab = self.edges.partition_point(|edge| *edge <= above);
        let slabs = self.edges.len() - 1;
        match (
            index(x, self.x_lo, self.columns),
            index(y, self.y_lo, self.rows),
        ) {
            (Some(column), Some(row)) if slab >= 1 && slab <= slabs => {
                self.covered[((slab - 1) * self.rows + row) * self.columns + column]
            }
            _ => false,
        }
    }

    /// Returns a pose of the set (goal frame, `mean` the estimate there, `turn` the goal's yaw) that no cell
    /// covers, if there is one among those that leave first: the poses of largest and smallest x on both sides of
    /// every row edge and slab edge that the set meets.
    pub fn escapes(&self, set: &PoseSet, mean: Pose, turn: f64) -> Option<Pose> {
        let spread = Spread::of(set, turn);
        let reach_yaw = spread.reach(2).min(TAU / 2.0);
        let mut yaws = vec![-reach_yaw, 0.0, reach_yaw];
        let turns = if self.whole { -1..=1 } else { 0..=0 };
        let above = (mean[2] - self.yaw_lo).rem_euclid(TAU);
        for edge in turns.flat_map(|t| self.edges.iter().map(move |e| e + f64::from(t) * TAU)) {
            yaws.extend(
                both_sides(edge - above)
                    .into_iter()
                    .filter(|e| e.abs() <= reach_yaw),
            );
        }
        let reach_y = spread.reach(1);
        let mut ys = vec![-reach_y, 0.0, reach_y];
        let first = ((mean[1] - reach_y - self.y_lo) / self.step)
            .floor()
            .max(0.0);
        let last = ((mean[1] + reach_y - self.y_lo) / self.step)
            .ceil()
            .min(self.rows as f64);
        let mut row = first;
        while row <= last {
            ys.extend(both_sides(self.y_lo + row * self.step - mean[1]));
            row += 1.0;
        }
        let mut offsets = Vec::new();
        for yaw in &yaws {
            offsets.extend(spread.ends(None, Some(*yaw)));
            for y in &ys {
                offsets.extend(spread.ends(Some(*y), Some(*yaw)));
            }
        }
        for y in &ys {
            offsets.extend(spread.ends(Some(*y), None));
        }
        offsets.extend(spread.ends(None, None));
        offsets
            .into_iter()
            .filter(|offset| offset[2].abs() <= TAU / 2.0)
            .map(|offset| {
                [
                    mean[0] + offset[0],
                    mean[1] + offset[1],
                    mean[2] + offset[2],
                ]
            })
            .find(|pose| !self.covers(*pose, 2e-9))
    }
}

fn both_sides(edge: f64) -> [f64; 2] {
    [edge - 1e-8, edge + 1e-8]
}

/// A pose-set around its estimate in the goal frame.
enum Spread {
    /// `{ e' (r2 P)^-1 e <= 1 }`: the matrix r2 P.
    Ellipsoid([[f64; 3]; 3]),
    Cylinder {
        radius: f64,
        yaw: f64,
    },
}

impl Spread {
    fn of(set: &PoseSet, turn: f64) -> Self {
        match set {
            PoseSet::Bounded { translation, yaw } => Self::Cylinder {
                radius: *translation,
                yaw: *yaw,
            },
            PoseSet::Gaussian { cov, r2 } => {
                let (s, c) = turn.sin_cos();
                let r = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]];
                let mut m = [[0.0; 3]; 3];
                for (i, row) in m.iter_mut().enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        for k in 0..3 {
                            for l in 0..3 {
                                *entry += r2 * r[i][k] * cov[k][l] * r[j][l];
                            }
                        }
                    }
                }
                Self::Ellipsoid(m)
            }
        }
    }

    /// Returns the largest offset on an axis.
    fn reach(&self, axis: usize) -> f64 {
        match self {
            Self::Ellipsoid(m) => m[axis][axis].sqrt(),
            Self::Cylinder { radius, yaw } => [*radius, *radius, *yaw][axis],
        }
    }

    /// Returns the offsets of smallest and largest x, with y and yaw fixed or free.
    fn ends(&self, y: Option<f64>, yaw: Option<f64>) -> Vec<Pose> {
        match self {
            Self::Cylinder { radius, yaw: most } => {
                let (y, yaw) = (y.unwrap_or(0.0), yaw.unwrap_or(0.0));
                let left = radius * radius - y * y;
                if left < 0.0 || yaw.abs() > *most {
                    return Vec::new();
                }
                vec![[-left.sqrt(), y, yaw], [left.sqrt(), y, yaw]]
            }
            Self::Ellipsoid(m) => {
                // Fixed by elimination: the rest is an ellipsoid around a shifted centre.
                let mut m = *m;
                let mut centre = [0.0; 3];
                let mut left = 1.0;
                for (axis, held) in [(1, y), (2, yaw)] {
                    let Some(value) = held else { continue };
                    if m[axis][axis] <= 0.0 {
                        return Vec::new();
                    }
                    let gain = [0, 1, 2].map(|i| m[i][axis] / m[axis][axis]);
                    let off = value - centre[axis];
                    left -= off * off / m[axis][axis];
                    for (c, g) in centre.iter_mut().zip(gain) {
                        *c += g * off;
                    }
                    let column = [0, 1, 2].map(|i| m[i][axis]);
                    for i in 0..3 {
                        for j in 0..3 {
                            m[i][j] -= gain[i] * column[j];
                        }
                    }
                }
                if left < 0.0 || m[0][0] <= 0.0 {
                    return Vec::new();
                }
                let size = (left / m[0][0]).sqrt();
                [-1.0, 1.0]
                    .map(|side| [0, 1, 2].map(|i| centre[i] + side * size * m[i][0]))
                    .to_vec()
            }
        }
    }
}
