//! Accuracy of integrals, and the quadrature rule.

/// The accuracy and the limits of an integral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quadrature {
    /// The relative error to reach.
    pub accuracy: f64,
    /// Largest number of headings evaluated. If they are not enough, the reported error is larger than the one to
    /// reach.
    pub headings: u32,
    /// The number of evaluated views after which no more headings or rays are added; those that were started are
    /// finished. If the views are not enough, the reported error is larger than the requested one.
    pub views: u64,
}

impl Quadrature {
    /// For a search: about one percent of the default's work.
    pub const ROUGH: Self = Self {
        accuracy: 1e-3,
        headings: 600,
        views: 100_000_000,
    };
}

impl Default for Quadrature {
    fn default() -> Self {
        Self {
            accuracy: 1e-7,
            headings: 6_000,
            views: 100_000_000,
        }
    }
}

/// An integrated number with an estimate of its numerical error. The estimate is the difference between two
/// rules: usually more than the error, but not a bound.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Approximate {
    /// The integral.
    pub value: f64,
    /// The estimated error of `value`, in its unit.
    pub error: f64,
}

/// The integrals: the cost of the part of the disc or ball inside the set, and the mass of the part outside.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sum {
    pub seen: Approximate,
    pub outside: Approximate,
}

impl Sum {
    pub(super) fn both(&self) -> [Approximate; 2] {
        [self.seen, self.outside]
    }

    pub(super) fn of([seen, outside]: [Approximate; 2]) -> Self {
        Self { seen, outside }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        let (a, b) = (self.both(), other.both());
        Self::of([0, 1].map(|k| Approximate {
            value: a[k].value + b[k].value,
            error: a[k].error + b[k].error,
        }))
    }

    pub(super) fn scaled(&self, by: f64) -> Self {
        Self::of(self.both().map(|part| Approximate {
            value: part.value * by,
            error: part.error * by,
        }))
    }
}

/// Gauss-Kronrod rule with 7 and 15 nodes (Kronrod 1965; the numbers are those of QUADPACK): the nodes from the
/// outermost to the middle, the weights of the 15, and those of the 7 (every second node).
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
const GAUSS: [f64; 4] = [
    0.129_484_966_168_869_7,
    0.279_705_391_489_276_7,
    0.381_830_050_505_118_9,
    0.417_959_183_673_469_4,
];

/// Yields the 15 nodes on [-1, 1] with both weights; the middle first.
pub(super) fn nodes() -> impl Iterator<Item = (f64, f64, f64)> {
    (0..8).rev().flat_map(|k| {
        let gauss = if k % 2 == 1 { GAUSS[k / 2] } else { 0.0 };
        let node = move |sign: f64| (sign * NODES[k], KRONROD[k], gauss);
        let mirrored = (k < 7).then(|| node(1.0));
        core::iter::once(node(-1.0)).chain(mirrored)
    })
}

/// Returns the integral of `value` by 15 nodes, and its difference from that by 7.
pub(super) fn line(from: f64, to: f64, value: impl Fn(f64) -> f64) -> Approximate {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let (mut kronrod, mut gauss) = (0.0, 0.0);
    for (node, by_15, by_7) in nodes() {
        let value = value(middle + half * node);
        kronrod += by_15 * value;
        gauss += by_7 * value;
    }
    Approximate {
        value: half * kronrod,
        error: half * (kronrod - gauss).abs(),
    }
}

/// Returns the integral by the 7 nodes only.
pub(super) fn line_by_7(from: f64, to: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let few = nodes().filter(|(_, _, gauss)| *gauss > 0.0);
    let values = few.map(|(node, _, gauss)| gauss * value(middle + half * node));
    half * values.sum::<f64>()
}

/// Returns the integral by 15 nodes. Halves intervals until their estimated error is at most their share of
/// `error`, or 12 times.
pub(super) fn line_within(
    from: f64,
    to: f64,
    error: f64,
    value: &dyn Fn(f64) -> f64,
) -> Approximate {
    let mut open = std::vec![(from, to, 0)];
    let mut all = Approximate::default();
    while let Some((from, to, depth)) = open.pop() {
        let part = line(from, to, value);
        let error_of_part = estimated_error(part.value, part.error, Smooth::Surely);
        if error_of_part <= error * libm::ldexp(1.0, -depth) || depth == 12 {
            all.value += part.value;
            all.error += error_of_part;
        } else {
            let middle = 0.5 * (from + to);
            open.extend([(middle, to, depth + 1), (from, middle, depth + 1)]);
        }
    }
    all
}

/// Says if a function may have a kink within a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Smooth {
    /// The function has no kink.
    Surely,
    /// The function may have a kink.
    Perhaps,
}

/// Returns the error estimate from the difference of two rules. For a smooth function the better rule is far better
/// (QUADPACK uses (200 share)^1.5); at a kink it may not be better.
fn estimated_error(value: f64, difference: f64, smooth: Smooth) -> f64 {
    let share = difference / value.abs().max(f64::MIN_POSITIVE);
    match smooth {
        Smooth::Surely => difference * (2828.0 * libm::sqrt(share)).min(1.0),
        // Doubled, because both rules may have similar errors at a kink.
        Smooth::Perhaps => 2.0 * difference,
    }
}

/// A panel of an integral with its sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct Panel {
    pub from: f64,
    pub to: f64,
    pub sum: Sum,
    /// The mass that may or may not be outside.
    pub unseen: f64,
}

/// Integrates over a panel. `value` is called at each node and returns the integrand without the node's weight.
/// The errors of the values are added to the rule's own.
pub(super) fn panel(
    from: f64,
    to: f64,
    smooth: Smooth,
    mut value: impl FnMut(f64) -> Sum,
) -> Panel {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let (mut kronrod, mut gauss) = (Sum::default(), [0.0; 2]);
    for (node, by_15, by_7) in nodes() {
        let value = value(middle + half * node);
        kronrod = kronrod.plus(&value.scaled(by_15));
        for (gauss, value) in gauss.iter_mut().zip(value.both()) {
            *gauss += by_7 * value.value;
        }
    }
    let both = kronrod.both();
    let sum = [0, 1].map(|k| Approximate {
        value: half * both[k].value,
        error: half
            * (both[k].error
                + estimated_error(both[k].value, (both[k].value - gauss[k]).abs(), smooth)),
    });
    Panel {
        from,
        to,
        sum: Sum::of(sum),
        unseen: 0.0,
    }
}

/// Halves the worst panels until the errors are allowed, or until `most` panels were added. Returns the sum.
/// `allowed` returns the allowed errors for the sum so far.
pub(super) fn refine(
    panels: &mut Vec<Panel>,
    most: u32,
    smooth: Smooth,
    allowed: impl Fn(&Sum) -> [f64; 2],
    mut again: impl FnMut(f64, f64) -> Panel,
) -> Sum {
    let total = |panels: &[Panel]| {
        let sums = panels.iter().map(|panel| panel.sum);
        sums.fold(Sum::default(), |all, sum| all.plus(&sum))
    };
    let mut sum = total(panels);
    for _ in 0..most {
        let limits = allowed(&sum);
        let excess = |sum: &Sum| {
            let parts = sum.both();
            // A limit of zero is for an integrand that is zero everywhere.
            let part = |k: usize| parts[k].error / limits[k].max(f64::MIN_POSITIVE);
            part(0).max(part(1))
        };
        if !(excess(&sum) > 1.0) {
            break;
        }
        let ratios = panels.iter().map(|panel| excess(&panel.sum)).enumerate();
        let Some((worst, _)) = ratios.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        let Panel {
            from,
            to,
            sum: whole,
            ..
        } = panels[worst];
        let middle = 0.5 * (from + to);
        if !(from < middle && middle < to) {
            break;
        }
        let (mut left, mut right) = (again(from, middle), again(middle, to));
        if smooth == Smooth::Perhaps {
            doubt(&whole, &mut left.sum, &mut right.sum);
        }
        panels[worst] = left;
        panels.push(right);
        sum = total(panels);
    }
    sum
}

/// Corrects the error estimate near a kink, at which two rules may agree by chance. The change from halving was the
/// error of the complete panel; a fifth of it remains at a kink. The half that probably has the kink gets at least
/// that error.
fn doubt(whole: &Sum, left: &mut Sum, right: &mut Sum) {
    let (before, mut a, mut b) = (whole.both(), left.both(), right.both());
    for k in 0..2 {
        let changed = (a[k].value + b[k].value - before[k].value).abs();
        let doubted = if a[k].error >= b[k].error {
            &mut a[k]
        } else {
            &mut b[k]
        };
        doubted.error = doubted.error.max(0.2 * changed);
    }
    (*left, *right) = (Sum::of(a), Sum::of(b));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rule_is_exact_for_polynomials() {
        let weights = nodes().fold([0.0; 3], |[a, b, n], (_, k, g)| [a + k, b + g, n + 1.0]);
        assert!((weights[0] - 2.0).abs() < 1e-15 && (weights[1] - 2.0).abs() < 1e-15);
        assert_eq!(weights[2], 15.0);
        for power in 0..23 {
            let exact = (1.0 - 0.25f64.powi(power + 1)) / f64::from(power + 1);
            let got = line(0.25, 1.0, |x| x.powi(power));
            assert!((got.value - exact).abs() < 1e-15, "{power}: {got:?}");
            if power < 14 {
                let got = line_by_7(0.25, 1.0, |x| x.powi(power));
                assert!((got - exact).abs() < 1e-15, "{power}: {got:?}");
            }
        }
    }

    #[test]
    fn kink_is_halved_until_its_error_is_small() {
        let value = |x: f64| {
            let value = (x - 0.3).abs();
            let exact = |value| Approximate { value, error: 0.0 };
            Sum::of([exact(value), exact(if x > 0.7 { 1.0 } else { 0.0 })])
        };
        let again = |from, to| panel(from, to, Smooth::Perhaps, value);
        let mut panels = std::vec![again(0.0, 1.0)];
        let sum = refine(&mut panels, 200, Smooth::Perhaps, |_| [1e-9, 1e-7], again);
        let [seen, outside] = sum.both();
        assert!((seen.value - 0.29).abs() <= seen.error && seen.error < 1e-9);
        assert!((outside.value - 0.3).abs() <= outside.error && outside.error < 1e-7);
        // It stops when the limit is reached.
        let mut panels = std::vec![again(0.0, 1.0)];
        refine(&mut panels, 3, Smooth::Perhaps, |_| [0.0; 2], again);
        assert_eq!(panels.len(), 4);
    }
}
