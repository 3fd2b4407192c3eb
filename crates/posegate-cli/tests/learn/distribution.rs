//! Synthetic views with a known distribution of errors.

use posegate_learn::{Detection, Detections, RunSource, Runs};

/// Pseudo-random numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number uniform between 0 and 1.
    pub fn even(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a standard normal number.
    pub fn normal(&mut self) -> f64 {
        let (a, b) = (self.even().max(1e-300), self.even());
        (-2.0 * a.ln()).sqrt() * (core::f64::consts::TAU * b).cos()
    }
}

/// The distribution of errors and detections.
#[derive(Clone, Copy)]
pub struct Distribution {
    /// The standard deviation of the position error, metres, by d, phi and psi (degrees); the yaw's is a fifth of
    /// it, in radians.
    pub sigma: fn([f64; 3]) -> f64,
    /// The probability of a flip, whose errors are a metre and a radian more.
    pub flips: fn([f64; 3]) -> f64,
}

/// Head-on views have large errors, and flips whose probability grows with the distance.
pub const HEAD_ON: Distribution = Distribution {
    sigma: |[d, phi, psi]| 0.002 + 0.003 * d * d / (0.25 + psi / 30.0) * (1.0 + phi / 60.0),
    flips: |[d, _, psi]| {
        if psi < 25.0 {
            0.004 * d * (1.0 - psi / 25.0)
        } else {
            0.0
        }
    },
};

/// The paper's form: errors grow with the squares.
pub const SQUARES: Distribution = Distribution {
    sigma: |[d, phi, psi]| {
        let [phi, psi] = [phi.to_radians(), psi.to_radians()];
        0.002 + 0.0015 * d * d + 0.02 * phi * phi + 0.03 * psi * psi
    },
    flips: |_| 0.0,
};

impl Distribution {
    /// Returns the probability that a view is detected.
    pub fn detected([d, _, psi]: [f64; 3]) -> f64 {
        1.0 / (1.0 + (-(8.0 - 0.08 * psi - 0.5 * d)).exp())
    }

    pub fn place(random: &mut Random) -> [f64; 3] {
        [
            0.5 + 6.0 * random.even(),
            25.0 * random.even(),
            70.0 * random.even(),
        ]
    }

    pub fn errors(&self, at: [f64; 3], random: &mut Random) -> [f64; 2] {
        let sigma = (self.sigma)(at);
        let more = f64::from(u8::from(random.even() < (self.flips)(at)));
        [
            sigma * random.normal().abs() + more,
            0.2 * sigma * random.normal().abs() + more,
        ]
    }

    /// Returns views at random places that `takes` accepts.
    pub fn views(&self, count: usize, seed: u64, takes: impl Fn([f64; 3]) -> bool) -> Detections {
        let mut random = Random(seed);
        let mut rows = Vec::new();
        while rows.len() < count {
            let at = Self::place(&mut random);
            let errors = self.errors(at, &mut random);
            let seen = random.even() < Self::detected(at);
            if takes(at) {
                rows.push(Detection {
                    at,
                    errors: seen.then_some(errors),
                });
            }
        }
        Detections {
            rows,
            ..Detections::default()
        }
    }

    /// Returns approaches of 100 frames each, from far to near. Successive errors of an approach are correlated: `lasting`
    /// is the correlation of the normal numbers behind them. The errors of an approach have a common scale, whose
    /// logarithm has the standard deviation `scale`.
    pub fn approaches(&self, count: u32, lasting: f64, scale: f64, seed: u64) -> Detections {
        const FRAMES: u32 = 100;
        let mut random = Random(seed);
        let (mut rows, mut of_row) = (Vec::new(), Vec::new());
        for run in 0..count {
            let [from, to] = [Self::place(&mut random), Self::place(&mut random)];
            let (first, last) = (5.0 + 2.0 * random.even(), 0.5 + random.even());
            let common = (scale * random.normal()).exp();
            let mut normal = [random.normal(), random.normal()];
            for frame in 0..FRAMES {
                let share = f64::from(frame) / f64::from(FRAMES - 1);
                let between = |from: f64, to: f64| from + share * (to - from);
                // phi swings while the robot corrects its heading.
                let swing = (from[1] + 3.0 * share * to[1] / 10.0).sin();
                let at = [
                    between(first, last),
                    12.5 + 12.4 * swing,
                    between(from[2], to[2]),
                ];
                let sigma = common * (self.sigma)(at);
                let errors = [sigma * normal[0].abs(), 0.2 * sigma * normal[1].abs()];
                rows.push(Detection {
                    at,
                    errors: Some(errors),
                });
                of_row.push(run);
                for normal in &mut normal {
                    let innovation = (1.0 - lasting * lasting).sqrt();
                    *normal = lasting * *normal + innovation * random.normal();
                }
            }
        }
        let source = RunSource::Column;
        Detections {
            rows,
            runs: Runs { of_row, source },
            ..Detections::default()
        }
    }

    /// Returns the share of translation errors at a place that are at most `bound`.
    pub fn share_within(&self, at: [f64; 3], bound: f64) -> f64 {
        self.shares_within(at, [bound, 0.0])[0]
    }

    /// Returns the shares of translation and of yaw errors at a place that are at most their bounds.
    pub fn shares_within(&self, at: [f64; 3], bounds: [f64; 2]) -> [f64; 2] {
        let (sigma, flips) = ((self.sigma)(at), (self.flips)(at));
        let half_normal = |x: f64| libm::erf(x / core::f64::consts::SQRT_2);
        let share = |bound: f64, sigma: f64| {
            let flipped = half_normal((bound - 1.0).max(0.0) / sigma);
            (1.0 - flips) * half_normal(bound / sigma) + flips * flipped
        };
        [share(bounds[0], sigma), share(bounds[1], 0.2 * sigma)]
    }

    /// Returns the q-quantile of the translation error at a place.
    pub fn quantile(&self, at: [f64; 3], q: f64) -> f64 {
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.share_within(at, middle) < q {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }
}
