use super::*;
use crate::set::Estimate;
use core::f64::consts::LN_2;

/// A generator of normal numbers (SplitMix64, Box and Muller).
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((word ^ word >> 31) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }

    /// Returns an innovation whose errors are `scale` times what it claims: a random covariance by its lower root.
    fn innovation(&mut self, scale: f64) -> Innovation {
        let size = [0.05, 0.02, 0.01].map(|size| size * (0.5 + self.uniform()));
        let [a, b, c] = [(); 3].map(|()| self.uniform() - 0.5);
        let root = [
            [size[0], 0.0, 0.0],
            [a * size[1], size[1], 0.0],
            [b * size[2], c * size[2], size[2]],
        ];
        let drawn = [(); 3].map(|()| self.next() * scale);
        let product =
            |row: [f64; 3], other: [f64; 3]| (0..3).map(|k| row[k] * other[k]).sum::<f64>();
        Innovation {
            difference: root.map(|row| product(row, drawn)),
            covariance: root.map(|row| root.map(|other| product(row, other))),
        }
    }
}

/// Returns how many fixes a monitor takes until it contradicts, at most `most`.
fn fixes_until_alarm(
    between: u32,
    most: u32,
    mut next: impl FnMut(u32) -> Innovation,
) -> Option<u32> {
    let mut monitor = Monitor::new(between).unwrap();
    (1..=most).find(|at| monitor.fix(&next(*at)).unwrap() == ModelStanding::Contradicted)
}

/// The mean of a bet under the claim is 1, by integration over the chi-square distribution with 3 degrees of freedom; and a bet grows with the
/// innovation, so smaller errors than claimed lose.
#[test]
fn a_bet_is_fair() {
    for scale in BETS {
        assert_eq!(scale.1, scale.0.log2());
        let step = 1e-3;
        let mean: f64 = (0..400_000)
            .map(|k| (f64::from(k) + 0.5) * step)
            .map(|root| {
                // Of the root of d^2, whose density has no pole: 2 root times that of d^2.
                let squared = root * root;
                let density = (2.0 / core::f64::consts::PI).sqrt() * squared;
                density * (bet(squared, scale) * LN_2 - squared / 2.0).exp() * step
            })
            .sum();
        assert!((mean - 1.0).abs() < 1e-6, "{scale:?}: {mean}");
        assert!(bet(1.0, scale) < bet(1.1, scale));
    }
}

/// If errors are as claimed, or smaller, alarms are as rare as stated; if errors are larger, alarms come soon.
#[test]
fn alarms_are_rare_if_the_claims_hold_and_soon_if_not() {
    const BETWEEN: u32 = 500;
    const RUNS: u32 = 300;
    let mut normal = Normal(1);
    for scale in [1.0, 0.7] {
        let most = 20 * BETWEEN;
        let fixes: u32 = (0..RUNS)
            .map(|_| fixes_until_alarm(BETWEEN, most, |_| normal.innovation(scale)).unwrap_or(most))
            .sum();
        // The mean of 300 waiting times errs by 6 % at most; runs beyond the end are counted too low.
        assert!(fixes > BETWEEN * RUNS, "{scale}: {fixes}");
    }
    for (scale, within) in [(1.5, 60), (2.0, 20), (4.0, 5)] {
        let late = (0..RUNS)
            .filter(|_| {
                fixes_until_alarm(1_000_000, within, |_| normal.innovation(scale)).is_none()
            })
            .count();
        assert!(late < 30, "{scale}: {late}");
    }
    // Errors that are 1.5 times as large as claimed break the rate: the check can fail.
    let fixes: u32 = (0..RUNS)
        .map(|_| fixes_until_alarm(BETWEEN, 10 * BETWEEN, |_| normal.innovation(1.5)).unwrap())
        .sum();
    assert!(fixes < BETWEEN * RUNS / 10, "{fixes}");
}

/// After a thousand good fixes a knocked camera is detected as soon as without them.
#[test]
fn a_camera_that_is_knocked_later_is_found_as_soon() {
    let mut normal = Normal(2);
    let mut late = 0;
    for _ in 0..100 {
        let found = fixes_until_alarm(1_000_000, 1_040, |at| {
            let mut innovation = normal.innovation(1.0);
            if at > 1_000 {
                // An offset of two claimed deviations in x.
                innovation.difference[0] += 2.0 * innovation.covariance[0][0].sqrt();
            }
            innovation
        });
        late += u32::from(found.is_none());
        assert!(found.is_none_or(|at| at > 1_000));
    }
    assert!(late < 10, "{late}");
}

fn at(x_m: f64, yaw_rad: f64, sigma: f64) -> PoseEstimate {
    let estimate = Estimate {
        x_m,
        y_m: 0.0,
        yaw_rad,
    };
    let v = sigma * sigma;
    PoseEstimate::new(
        estimate,
        Uncertainty::Gaussian([[v, 0.0, 0.0], [0.0, v, 0.0], [0.0, 0.0, v]]),
    )
}

#[test]
fn an_innovation_is_the_fix_minus_the_prediction() {
    let [fix, prediction] = [at(1.03, 3.10, 0.03), at(1.0, -3.13, 0.04)];
    let slip = Growth::of(0.01, 0.02).unwrap();
    let found = Innovation::of_independent(&fix, &prediction, slip).unwrap();
    let turn = -(TAU - 3.10 - 3.13) + 0.02;
    for (value, expected) in found.difference.into_iter().zip([0.02, 0.0, turn]) {
        assert!((value - expected).abs() < 1e-5, "{found:?}");
    }
    let expected = (0.02_f64.powi(2) + turn * turn) / 0.05_f64.powi(2);
    assert!((found.normalised_squared().unwrap() / expected - 1.0).abs() < 1e-3);
    let dependent = Innovation::of_dependent(&fix, &prediction, slip).unwrap();
    let ratio = found.normalised_squared().unwrap() / dependent.normalised_squared().unwrap();
    assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
    // A difference within the slip counts as zero.
    let all = Growth::of(0.04, 0.1).unwrap();
    let explained = Innovation::of_independent(&fix, &prediction, all).unwrap();
    assert_eq!(explained.normalised_squared(), Ok(0.0));
}

#[test]
fn what_is_no_innovation_counts_for_nothing() {
    let good = at(0.0, 0.0, 0.1);
    let bounded = PoseEstimate {
        spread: Some(Uncertainty::Bounded {
            translation_m: 0.1,
            yaw_rad: 0.1,
        }),
        ..good
    };
    let unknown = PoseEstimate {
        spread: None,
        ..good
    };
    for other in [bounded, unknown] {
        for (fix, prediction) in [(&good, &other), (&other, &good)] {
            let refused = Innovation::of_independent(fix, prediction, Growth::NONE);
            assert_eq!(refused, Err(InputError::CovarianceUnknown));
        }
    }
    let mut monitor = Monitor::new(100).unwrap();
    let flat = Innovation {
        difference: [9.0; 3],
        covariance: [[0.0; 3]; 3],
    };
    let refused = Err(InputError::CovarianceNotPositiveDefinite);
    assert_eq!(monitor.fix(&flat), refused);
    let odd = Innovation {
        difference: [f64::NAN; 3],
        covariance: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    assert_eq!(monitor.fix(&odd), Err(InputError::EstimateNotFinite));
    assert_eq!(monitor.standing(), ModelStanding::Holds);
    // Beyond the range of numbers.
    let huge = Innovation {
        difference: [1e300; 3],
        ..odd
    };
    assert_eq!(monitor.fix(&huge), Ok(ModelStanding::Contradicted));
    assert_eq!(size_of::<Monitor>(), 32);
    assert!(Monitor::new(99).is_none());
    for between in [100, 127, 128, 129, 1_000_000, u32::MAX] {
        let most = Monitor::new(between).unwrap().most;
        assert_eq!(most, 1.0 + f64::from(between).log2().ceil(), "{between}");
    }
}

/// Doubt comes before contradiction, good fixes remove it, and a contradiction stays until the reset.
#[test]
fn doubt_passes_and_a_contradiction_stays() {
    let fix = |squared: f64| Innovation {
        difference: [squared.sqrt(), 0.0, 0.0],
        covariance: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    };
    let mut monitor = Monitor::new(1_000_000).unwrap();
    assert_eq!(monitor.fix(&fix(16.0)), Ok(ModelStanding::Holds));
    assert_eq!(monitor.fix(&fix(16.0)), Ok(ModelStanding::InDoubt));
    for _ in 0..3 {
        let _ = monitor.fix(&fix(0.5));
    }
    assert_eq!(monitor.standing(), ModelStanding::Holds);
    for _ in 0..5 {
        let _ = monitor.fix(&fix(16.0));
    }
    assert_eq!(monitor.standing(), ModelStanding::Contradicted);
    for _ in 0..100 {
        assert_eq!(monitor.fix(&fix(0.0)), Ok(ModelStanding::Contradicted));
    }
    monitor.reset();
    assert_eq!(monitor.standing(), ModelStanding::Holds);
}
