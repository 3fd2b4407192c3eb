//! A box inside a success set: the paper's task space region. All of its poses are proven to be in the set, by the same
//! intervals that prove tables.

use posegate::certify::{Block, Prover};
use posegate::shape::SuccessSet;

/// A box in the frame of the goal. It contains the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InscribedBox {
    /// `[lo, hi]` in the goal frame, metres: multiples of 0.1 mm.
    pub x: [f64; 2],
    /// `[lo, hi]` in the goal frame, metres: multiples of 0.1 mm.
    pub y: [f64; 2],
    /// `[lo, hi]`, degrees: multiples of 0.01 degrees.
    pub yaw_deg: [f64; 2],
}

/// The ends of a box, as distances from the goal: x and y in 0.1 mm, yaw in 0.01 degrees; lower end first.
type Reach = [[i64; 2]; 3];

/// The largest distance of an end of a box, metres and degrees: wider headings cannot be proven at once.
const FARTHEST: [i64; 3] = [1_000_000, 1_000_000, 4_400];
/// Widths of y and of yaw (0.01 degrees) for 0.1 mm of x, from which the search begins.
const RATIOS: [(f64, f64); 15] = [
    (0.25, 0.02),
    (0.25, 0.1),
    (0.25, 0.5),
    (0.5, 0.02),
    (0.5, 0.1),
    (0.5, 0.5),
    (1.0, 0.02),
    (1.0, 0.1),
    (1.0, 0.5),
    (2.0, 0.02),
    (2.0, 0.1),
    (2.0, 0.5),
    (4.0, 0.02),
    (4.0, 0.1),
    (4.0, 0.5),
];
/// The number of starts whose faces are moved.
const REFINED: usize = 4;

/// Returns a large box about the goal that is inside the set; `None` if the goal itself is not proven inside. With
/// `yaw_deg` the box has the headings from `-yaw_deg` to `yaw_deg`, and `None` also means that the goal at one of
/// these headings is not in the set.
///
/// The box cannot be enlarged at any one of its faces by more than the resolution; other boxes may be larger. Takes some
/// thousand proofs of blocks: milliseconds for a box, seconds for a view past walls.
pub fn inscribed_box(success: &SuccessSet, yaw_deg: Option<f64>) -> Option<InscribedBox> {
    let prover = Prover::new(success);
    let holds = |reach: &Reach| prover.is_inside(&block(reach));
    let yaw = yaw_deg.map(|yaw| libm::ceil(yaw * 100.0 - 1e-6) as i64);
    let goal = [[0, 0], [0, 0], [yaw.unwrap_or(0); 2]];
    if yaw.is_some_and(|yaw| yaw > FARTHEST[2]) || !holds(&goal) {
        return None;
    }
    let scaled = |(y, turn): (f64, f64)| {
        let at = |size: i64| -> Reach {
            let whole = |ratio: f64, axis: usize| {
                (libm::round(ratio * size as f64) as i64).min(FARTHEST[axis])
            };
            [
                [whole(1.0, 0); 2],
                [whole(y, 1); 2],
                [yaw.unwrap_or_else(|| whole(turn, 2)); 2],
            ]
        };
        at(largest(FARTHEST[0], |size| holds(&at(size))))
    };
    let mut starts: Vec<Reach> = RATIOS.into_iter().map(scaled).collect();
    starts.sort_by(|a, b| volume(b).total_cmp(&volume(a)));
    starts.truncate(REFINED);
    let grown = starts.into_iter().map(|start| grown(start, yaw, &holds));
    let best = grown.max_by(|a, b| volume(a).total_cmp(&volume(b)))?;
    let [x, y, turn] = best;
    let ends = |[lo, hi]: [i64; 2], unit: f64| [0.0 - lo as f64 / unit, hi as f64 / unit];
    Some(InscribedBox {
        x: ends(x, 1e4),
        y: ends(y, 1e4),
        yaw_deg: ends(turn, 100.0),
    })
}

/// Moves one face after the other outwards until no face can be moved.
fn grown(mut reach: Reach, yaw: Option<i64>, holds: &dyn Fn(&Reach) -> bool) -> Reach {
    let axes = if yaw.is_some() { 2 } else { 3 };
    for _ in 0..8 {
        let before = reach;
        for axis in 0..axes {
            for side in [0, 1] {
                let begun = reach;
                let with = |end: i64| {
                    let mut moved = begun;
                    moved[axis][side] += end;
                    moved
                };
                let most = FARTHEST[axis] - begun[axis][side];
                reach = with(largest(most, |end| holds(&with(end))));
            }
        }
        if reach == before {
            break;
        }
    }
    reach
}

/// Returns the largest number up to `most`, found by doubling and halving, for which a test is true; it is true for
/// 0.
fn largest(most: i64, holds: impl Fn(i64) -> bool) -> i64 {
    let (mut low, mut step) = (0, 1);
    while low + step <= most && holds(low + step) {
        low += step;
        step *= 2;
    }
    while step > 0 {
        if low + step <= most && holds(low + step) {
            low += step;
        }
        step /= 2;
    }
    low
}

fn volume(reach: &Reach) -> f64 {
    // A box without extent in one of its dimensions is worse than any other.
    let wide = reach.iter().map(|[lo, hi]| (lo + hi) as f64 + 1e-3);
    wide.product()
}

/// Returns the block of poses, its headings rounded outwards.
fn block([x, y, turn]: &Reach) -> Block {
    let micrometres = |[lo, hi]: &[i64; 2]| [-lo * 100, hi * 100];
    // 36,000 hundredths of a degree are 2^32 units.
    let units = |hundredths: i64| {
        let units = hundredths.saturating_mul(1 << 32);
        units.div_euclid(36_000) + i64::from(units.rem_euclid(36_000) > 0)
    };
    Block {
        x_um: micrometres(x),
        y_um: micrometres(y),
        yaw: [-units(turn[0]), units(turn[1])],
    }
}

#[cfg(test)]
mod tests;
