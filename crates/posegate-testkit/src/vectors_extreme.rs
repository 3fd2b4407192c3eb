//! Requests with extreme numbers.

use super::{Form, Maker, TINY};
use core::f64::consts::TAU;
use posegate::wire::{Request, Uncertainty};

/// Numbers that are never valid, in a covariance or anywhere else.
const NEVER: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

impl Maker<'_> {
    /// Returns a valid covariance.
    fn possible(&mut self) -> [[f64; 3]; 3] {
        let half = self.place().half.map(|half| 0.02 * half);
        let Uncertainty::Gaussian(covariance) =
            Form::Gaussian(half, self.correlations()).times(1.0)
        else {
            unreachable!("the form is Gaussian");
        };
        covariance
    }

    /// Makes sets and coordinates smaller than every unit.
    pub(super) fn tiny(&mut self, choice: u32) -> Request {
        let offset = self.inside();
        let half = self.place().half;
        let powers = [1e-3, 1e-6, 1e-9, 1e-20, 1e-100, 1e-153, 1e-160];
        let mut share = || powers[self.below(7) as usize];
        let small = half.map(|half| half * share());
        let correlations = self.correlations();
        let mut request = self.at(offset, Form::Gaussian(small, correlations), 1.0);
        match choice % 8 {
            0 => request.spread = Form::Bounded(small[0], small[2]).times(1.0),
            1 => request.spread = Form::Bounded(TINY, 1e-300).times(1.0),
            // Variances without correlation, some of them subnormal.
            2 => {
                let mut variances = [[0.0; 3]; 3];
                for (axis, row) in variances.iter_mut().enumerate() {
                    row[axis] = if self.below(2) == 0 {
                        TINY
                    } else {
                        small[axis]
                    };
                }
                request.spread = Uncertainty::Gaussian(variances);
            }
            // At the origin, which is near two of the goals.
            3 => {
                request.estimate.x_m = self.sign() * TINY;
                request.estimate.y_m = self.sign() * 0.0;
                request.estimate.yaw_rad = self.sign() * f64::MIN_POSITIVE;
            }
            // Rounding by the sender in the lower half.
            4 => {
                let mut covariance = self.possible();
                let (row, column) = [(1, 0), (2, 0), (2, 1)][self.below(3) as usize];
                covariance[row][column] *= 1.0 + self.sign() * 1e-12;
                request.spread = Uncertainty::Gaussian(covariance);
            }
            _ => {}
        }
        request
    }

    /// Makes correlations up to 1 - 1e-12, at the border of acceptance if there is one.
    pub(super) fn correlated(&mut self, choice: u32) -> Request {
        let offset = self.inside();
        let half = self.place().half;
        let share = self.uniform(0.05, 0.5);
        let deviations = half.map(|half| half * share * self.uniform(0.1, 1.0));
        let rest = [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12];
        let mut correlations = [0.0; 3];
        correlations[(choice % 3) as usize] = self.sign() * (1.0 - rest[(choice / 3 % 9) as usize]);
        self.sized_to_the_border(offset, Form::Gaussian(deviations, correlations))
    }

    /// Makes invalid estimates, covariances and bounds.
    pub(super) fn impossible(&mut self, choice: u32) -> Request {
        let (offset, form) = (self.inside(), self.form());
        let mut request = self.at(offset, form, 0.1);
        let mut covariance = self.possible();
        let (row, column) = (self.below(3) as usize, self.below(3) as usize);
        let axis = self.below(3) as usize;
        let never = NEVER[self.below(3) as usize];
        let estimate = &mut request.estimate;
        let coordinate = [&mut estimate.x_m, &mut estimate.y_m, &mut estimate.yaw_rad];
        let [x, y, yaw] = coordinate;
        match choice % 8 {
            0 => *[x, y, yaw][axis] = never,
            1 => {
                let beyond = [2_000.000_000_6, -2001.0, 1e300, -1e300];
                match axis {
                    0 => *x = beyond[self.below(4) as usize],
                    1 => *y = beyond[self.below(4) as usize],
                    _ => *yaw = [16_384.0, -16_384.0, 1e9, -1e300][self.below(4) as usize],
                }
            }
            2 => {
                covariance[row][column] = never;
                request.spread = Uncertainty::Gaussian(covariance);
            }
            3 => request.spread = Uncertainty::Gaussian([[self.sign() * 0.0; 3]; 3]),
            4 => {
                let (row, column) = [(0, 1), (2, 0), (1, 2)][axis];
                covariance[row][column] += self.sign() * covariance[row][row].max(1e-5);
                request.spread = Uncertainty::Gaussian(covariance);
            }
            5 => {
                covariance[axis][axis] *= [0.0, -1.0, 1e-9, -1e300][self.below(4) as usize];
                request.spread = Uncertainty::Gaussian(covariance);
            }
            6 => {
                let huge = [100.0, 1e5, 1e20, 1e150];
                let sizes = [(); 3].map(|()| huge[self.below(4) as usize]);
                request.spread = Form::Gaussian(sizes, [0.0; 3]).times(1.0);
            }
            _ => {
                let bad = [
                    0.0,
                    -0.0,
                    -TINY,
                    -1.0,
                    268.5,
                    1e300,
                    f64::NAN,
                    f64::INFINITY,
                ];
                let bad = bad[self.below(8) as usize];
                request.spread = if axis == 0 && !(bad > 0.0) {
                    Form::Bounded(0.01, bad).times(1.0)
                } else {
                    Form::Bounded(bad, 0.01).times(1.0)
                };
            }
        }
        request
    }

    /// Makes the oldest fresh age, one more, an age in the future, and half the clock's range.
    pub(super) fn at_any_age(&mut self, choice: u32) -> Request {
        let (offset, form) = (self.inside(), self.form());
        let mut request = self.at(offset, form, 0.02);
        let half_the_clock = 1 << 31;
        let ages = [
            200,
            201,
            u32::MAX,
            half_the_clock,
            half_the_clock - 1,
            60_000,
        ];
        let nows = [0, 100, u32::MAX, half_the_clock];
        request.now_ms = nows[self.below(4) as usize];
        let age = ages[choice as usize % ages.len()];
        request.stamp_ms = request.now_ms.wrapping_sub(age);
        request
    }

    /// Makes places from just off the cells to the limits of coordinates.
    pub(super) fn far(&mut self) -> Request {
        let form = self.form();
        let (x, y) = (self.sign() * 2000.0, self.uniform(-2000.0, 2000.0));
        let reach = [0.01, 1.0, 100.0, 267.0, 269.0][self.below(5) as usize];
        let corner = [x, y, self.uniform(-TAU, TAU)];
        let half = self.place().half;
        let side = self.sign() * half[1];
        let near = self.place().pose([half[0] + reach, side, 0.0]);
        let pose = if self.below(4) == 0 { corner } else { near };
        let pose = pose.map(|value| value.clamp(-2000.0, 2000.0));
        self.about(pose, form.times(0.05))
    }

    /// Makes sets up to many times the cells' extent.
    pub(super) fn wide(&mut self, choice: u32) -> Request {
        let (offset, form) = (self.inside(), self.form());
        let size = [1.0, 2.0, 4.0, 10.0, 30.0][choice as usize % 5];
        self.at(offset, form, size)
    }
}
