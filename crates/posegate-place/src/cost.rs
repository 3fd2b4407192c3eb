//! Expected cost of seeing a tag over a pose-set: E\[c\] of Eqs. 10 to 12.

use super::accuracy::MissCost;
use super::gaussian::Gaussian;
use super::headings;
use super::quadrature::{Approximate, Quadrature};
use super::rays::Bodies;
use super::rough;
use core::cell::Cell;
use posegate::shape::{LineClipper, Shape, SuccessSet};
use posegate_files::printable::fewest_digits;

/// The cost of a pose: `c1 d^2 + c2 phi^2 + c3 psi^2` (m, rad) in S, and `c_high` outside. [`posegate::shape::Sight`]
/// defines d, phi and psi.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Cost of a pose outside S.
    pub c_high: f64,
    /// Per square metre of the distance.
    pub c1: f64,
    /// Per square radian of phi.
    pub c2: f64,
    /// Per square radian of psi.
    pub c3: f64,
}

impl Default for Cost {
    /// The values of the paper's Fig. 4.
    fn default() -> Self {
        Self {
            c_high: 1e6,
            c1: 100.0,
            c2: 50.0,
            c3: 50.0,
        }
    }
}

impl Cost {
    /// Checks that every number is finite and at least 0.
    ///
    /// # Errors
    /// [`CostError::Number`] if a number is negative or not finite.
    pub fn check(&self) -> Result<(), CostError> {
        let named =
            ["c_high", "c1", "c2", "c3"]
                .into_iter()
                .zip([self.c_high, self.c1, self.c2, self.c3]);
        for (name, value) in named {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(CostError::Number { name, value });
            }
        }
        Ok(())
    }

    /// Returns the definition of the cost in words, with its unit.
    #[must_use]
    pub fn definition(&self) -> String {
        let [c1, c2, c3, c_high] = [self.c1, self.c2, self.c3, self.c_high].map(fewest_digits);
        format!("{c1} d^2 + {c2} phi^2 + {c3} psi^2 (m, rad), {c_high} outside of S; no unit")
    }

    /// Returns the cost of a view `[d, phi, psi]`, m and rad.
    #[must_use]
    pub fn of_view(&self, [d, phi, psi]: [f64; 3]) -> f64 {
        self.c1 * d * d + self.c2 * phi * phi + self.c3 * psi * psi
    }
}

/// The expected cost of a Gaussian pose-set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedCost {
    /// Eq. 12 as printed: the integral of density times cost over the pose-set. The density is not renormalised.
    pub integral: Approximate,
    /// The density's integral over the pose-set.
    pub mass: Approximate,
    /// `integral / mass`.
    pub mean: Approximate,
    /// The mass of the part outside S.
    pub outside_mass: Approximate,
    /// The mass of the part in S whose views have no known cost (it is infinite). Each such pose costs as much as a
    /// pose outside S.
    pub unknown_mass: Approximate,
    /// `(outside_mass + unknown_mass) / mass`: the probability of a miss.
    pub p_miss: Approximate,
    /// The number of headings at which the set was evaluated.
    pub headings: u32,
}

/// The reason why a pose-set has no expected cost.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CostError {
    /// The success set contains no view of a tag.
    #[error("the success set (`{0}`) contains no view of a tag, so that seeing a tag has no cost")]
    NoView(&'static str),
    /// A number of the cost is negative or not finite.
    #[error("{name} is {value}; expected a finite number that is not below 0")]
    Number {
        /// The number's name.
        name: &'static str,
        /// The given value.
        value: f64,
    },
    /// The accuracy is out of range.
    #[error("the accuracy is {0}; expected a number between 1e-12 and 1")]
    Accuracy(f64),
}

/// Returns the expected cost of a pose-set about the set's goal (the paper's `x = x*`).
///
/// S is the complete success set, as in [`SuccessSet::membership`]. If several tags are seen, the least of their
/// costs counts.
///
/// The mass outside is integrated between the exact borders of S ([`expected_cost_of`]), so its relative accuracy is
/// good even if a miss is rare. At each heading, the positions of all parts that S excludes are known (obstacles,
/// hidden places, a tag too near or seen too head-on), and those of each box or region of a union. A ray meets each
/// of these parts, or its mass is included in the reported error. (The headings at which a part comes within reach
/// are searched by distance, from 48 or more samples; that is not a proof.) A gap between the views of a union is not
/// searched in this way: a gap smaller than the distance between rays may be missed.
///
/// # Errors
/// [`CostError`] if there is no expected cost.
pub fn expected_cost(
    set: &SuccessSet,
    belief: &Gaussian,
    cost: &Cost,
    quadrature: &Quadrature,
) -> Result<ExpectedCost, CostError> {
    cost.check()?;
    let of_view = |view| cost.of_view(view);
    summed(
        set,
        belief,
        cost.c_high,
        &of_view,
        quadrature,
        CostDomain::Everywhere,
    )
}

/// The views for which a cost is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CostDomain {
    Everywhere,
    Perhaps,
}

/// Like [`expected_cost`], for any cost of a view `[d, phi, psi]` (m, rad). The cost is at least 0, and infinite if
/// it is unknown.
///
/// The mass of the unknown views is integrated separately. Along each ray their ends are searched between 21 samples of
/// each interval. Across rays and headings only quadrature is used, so the error is usually larger than that of
/// `outside_mass`. A part that no sample meets is missed.
///
/// Run time: a few hundred to some ten thousand rays, each with 7 or 15 views. The result is the same for the same
/// arguments on every machine.
///
/// The density is that of a standard normal u in a ball. At each heading (u1) the rest is a disc, which is swept by
/// rays from its centre. The intervals of each ray inside the set are exact. The mass between them has a closed form
/// (`exp(-a^2/2) - exp(-b^2/2)`); the cost is a Gauss-Kronrod sum. The sum over rays is Gauss-Kronrod between the
/// angles at which the limiting constraint changes; headings are refined adaptively.
///
/// # Errors
/// [`CostError`] if there is no expected cost.
pub fn expected_cost_of(
    set: &SuccessSet,
    belief: &Gaussian,
    c_high: f64,
    of_view: &dyn Fn([f64; 3]) -> f64,
    quadrature: &Quadrature,
) -> Result<ExpectedCost, CostError> {
    summed(
        set,
        belief,
        c_high,
        of_view,
        quadrature,
        CostDomain::Perhaps,
    )
}

fn summed(
    set: &SuccessSet,
    belief: &Gaussian,
    c_high: f64,
    of_view: &dyn Fn([f64; 3]) -> f64,
    quadrature: &Quadrature,
    known: CostDomain,
) -> Result<ExpectedCost, CostError> {
    if !(c_high >= 0.0 && c_high.is_finite()) {
        let (name, value) = ("c_high", c_high);
        return Err(CostError::Number { name, value });
    }
    if !(quadrature.accuracy >= 1e-12 && quadrature.accuracy <= 1.0) {
        return Err(CostError::Accuracy(quadrature.accuracy));
    }
    let along = LineClipper::of(set);
    if along.views() == 0 {
        return Err(CostError::NoView(set.shape.name()));
    }
    let white = belief.at(set.goal);
    let bodies = Bodies::of(set);
    let met_unknown = Cell::new(false);
    let noted = |view| {
        let cost = of_view(view);
        if !cost.is_finite() {
            met_unknown.set(true);
        }
        cost
    };
    let integrate = |of_view: &dyn Fn([f64; 3]) -> f64, miss| {
        headings::integrate(&along, &bodies, &white, of_view, miss, quadrature)
    };
    let unknown = || {
        let miss = MissCost {
            c_high: 1.0,
            sure: 0.0,
        };
        let (sum, headings) = integrate(&|view| unknown(of_view(view)), miss);
        (sum.seen, headings)
    };
    if known == CostDomain::Perhaps {
        let _ = rough::sums(&along, &white, &noted);
    }
    // Integrate the unknown part first if rays meet it: its value determines the accuracy that the rest needs.
    let first = met_unknown.get().then(unknown);
    let sure = first.map_or(0.0, |(mass, _)| c_high * mass.value);
    let (sum, headings) = integrate(&noted, MissCost { c_high, sure });
    let [seen, outside_mass] = sum.both();
    let found = first.or_else(|| met_unknown.get().then(unknown));
    let (unknown_mass, more) = found.unwrap_or_default();
    let headings = headings + more;
    let mass = belief.mass();
    let missed = Approximate {
        value: outside_mass.value + unknown_mass.value,
        error: outside_mass.error + unknown_mass.error,
    };
    let integral = Approximate {
        value: seen.value + c_high * missed.value,
        error: seen.error + c_high * missed.error,
    };
    let share = |part: Approximate| Approximate {
        value: part.value / mass,
        error: part.error / mass,
    };
    Ok(ExpectedCost {
        integral,
        mass: Approximate {
            value: mass,
            error: 1e-14,
        },
        mean: share(integral),
        outside_mass,
        unknown_mass,
        p_miss: share(missed),
        headings,
    })
}

impl ExpectedCost {
    /// Returns the cost of a pose that is known exactly (the paper's `x = x*`). The mass is 1, the probability of a
    /// miss is 0 or 1, and no number has an error.
    ///
    /// # Errors
    /// [`CostError::NoView`] or [`CostError::Number`], as for [`expected_cost`].
    pub fn at_goal(set: &SuccessSet, cost: &Cost) -> Result<Self, CostError> {
        cost.check()?;
        let mut views = Vec::new();
        views_of(&set.shape, &mut views);
        if views.is_empty() {
            return Err(CostError::NoView(set.shape.name()));
        }
        let goal = [set.goal.x, set.goal.y, set.goal.yaw_deg.to_radians()];
        let looks = views.into_iter().filter_map(|shape| {
            let alone = SuccessSet {
                goal: set.goal,
                shape,
            };
            let membership = alone.membership(goal);
            let sight = membership.sight?;
            let cost = cost.of_view([sight.d, sight.phi, sight.psi]);
            Some((membership.inside, cost))
        });
        let looks: Vec<(bool, f64)> = looks.collect();
        // If the pose is in the set without a view, as in a union with a box, use the views of all tags.
        let none_sees = looks.iter().all(|(sees, _)| !sees);
        let seen = looks.iter().filter(|(sees, _)| *sees || none_sees);
        let seen = seen.map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min);
        let inside = set.membership(goal).inside;
        let exactly = |value| Approximate { value, error: 0.0 };
        let outside = exactly(if inside { 0.0 } else { 1.0 });
        let value = exactly(if inside { seen } else { cost.c_high });
        Ok(Self {
            integral: value,
            mass: exactly(1.0),
            mean: value,
            outside_mass: outside,
            unknown_mass: exactly(0.0),
            p_miss: outside,
            headings: 1,
        })
    }
}

/// The integrand for the unknown mass, from the cost of a view. A known cost gives minus infinity, so a known view
/// excludes the pose.
pub(super) fn unknown(cost: f64) -> f64 {
    if cost.is_finite() {
        f64::NEG_INFINITY
    } else {
        1.0
    }
}

/// Collects the views in a set, each as a set of its own.
fn views_of(shape: &Shape, into: &mut Vec<Shape>) {
    match shape {
        Shape::Visibility(view) | Shape::Bounded { view, .. } => {
            into.push(Shape::Visibility(*view));
        }
        Shape::Any(shapes) | Shape::All(shapes) => {
            shapes.iter().for_each(|shape| views_of(shape, into));
        }
        Shape::Box(_) | Shape::Footprint(_) | Shape::Apart(_) => {}
    }
}
