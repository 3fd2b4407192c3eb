use super::*;
use crate::random::mixed;

/// Returns the largest value of a bet over 10,000 looks at misses of a given probability.
fn most(seed: u64, probability: f64, allowed: f64) -> f64 {
    let mut bet = Bet::default();
    for step in 0..10_000 {
        let even = (mixed(mixed(seed) ^ step) >> 11) as f64 / (1u64 << 53) as f64;
        let missed = f64::from(u8::from(even < probability));
        bet.step(missed, allowed, step + 1);
    }
    bet.most
}

/// Returns the probability above `allowed` at which the best bet grows by `nats` over 10,000 looks (Kullback-Leibler).
fn found_with(allowed: f64, nats: f64) -> f64 {
    let (mut low, mut high) = (allowed, 1.0);
    for _ in 0..60 {
        let p = 0.5 * (low + high);
        let growth =
            p * libm::log(p / allowed) + (1.0 - p) * libm::log((1.0 - p) / (1.0 - allowed));
        if 10_000.0 * growth < nats {
            low = p
        } else {
            high = p
        }
    }
    high
}

/// At most 5 % of the bets ever reach 20 if the misses are exactly as frequent as allowed; 17 of 200 would be 2.3
/// sigma more. ln 20 is 3.0. A bet without the new share and the time of the change needs 4 more, and chance
/// changes this by 5: with 15 nats nearly all bets win.
#[test]
fn fair_bets_rarely_win() {
    for allowed in [0.01, 0.1, 0.5] {
        let wins = (0..200).filter(|seed| most(*seed, allowed, allowed) >= 20.0);
        let wins = wins.count();
        assert!(wins <= 16, "{allowed}: {wins}");
        let more = found_with(allowed, 15.0);
        let wins = (0..20).filter(|seed| most(*seed, more, allowed) >= 20.0);
        let wins = wins.count();
        assert!(wins >= 19, "{more} where {allowed} is allowed: {wins}");
    }
}

/// The share of an urn equals that of a rank among exchangeable numbers.
#[test]
fn urn_share_equals_that_of_a_rank() {
    // The 9th smallest of 9 is exceeded by a tenth number with probability 1/10, then by an eleventh with 2/11.
    let mut urn = Urn {
        missed: 9.0 + 1.0 - 9.0,
        all: 9.0 + 1.0,
        effect: 1.0,
    };
    assert!((urn.share() - 0.1).abs() < 1e-12);
    urn.add(1.0, 1.0);
    assert!((urn.share() - 2.0 / 11.0).abs() < 1e-12);
}

#[test]
fn kind_of_change_is_the_one_that_varies_least() {
    let noise = |k: u32| 0.8 + 0.05 * f64::from(k % 9);
    let rows = |of: &dyn Fn(f64, f64) -> f64| -> Vec<(f64, f64, f64)> {
        (0..90)
            .map(|k| {
                let d = 1.0 + 0.05 * f64::from(k);
                let bound = 0.01 * d * d;
                (d, noise(k) * of(d, bound), bound)
            })
            .collect()
    };
    for which in [0, 1] {
        let scaled = rows(&|_, bound| 2.0 * bound);
        assert_eq!(change(&scaled, which), Some(Change::Scale));
    }
    let constant = rows(&|_, _| 0.1);
    assert_eq!(change(&constant, 0), Some(Change::Offset));
    assert_eq!(change(&constant, 1), Some(Change::Calibration));
    assert_eq!(
        change(&rows(&|d, _| 0.02 * d), 0),
        Some(Change::Calibration)
    );
    assert_eq!(change(&[], 0), None);
}
