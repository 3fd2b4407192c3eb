//! What seeing a tag costs from where the robot may be: E\[c\] of Eqs. 10 to 12.

use super::gaussian::Gaussian;
use super::headings::{self, MissCost};
use super::quadrature::{Approximate, Quadrature};
use super::rays::Bodies;
use super::rough;
use core::cell::Cell;
use posegate::shape::{LineClipper, Shape, SuccessSet};

/// The cost of a pose: `c1 d^2 + c2 phi^2 + c3 psi^2` (m, rad) in S, and `c_high` outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Of a pose outside S.
    pub c_high: f64,
    /// Per square metre of the distance.
    pub c1: f64,
    /// Per square radian of phi.
    pub c2: f64,
    /// Per square radian of psi.
    pub c3: f64,
}

impl Default for Cost {
    /// Those of the paper's Fig. 4.
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
    /// Whether every number is finite and not below 0.
    ///
    /// # Errors
    /// [`CostError::Number`].
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

    /// Of a view `[d, phi, psi]`, m and rad.
    #[must_use]
    pub fn of_view(&self, [d, phi, psi]: [f64; 3]) -> f64 {
        self.c1 * d * d + self.c2 * phi * phi + self.c3 * psi * psi
    }
}

/// What a Gaussian pose-set costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedCost {
    /// Eq. 12 as it is printed: the density, not renormalised, times the cost over the pose-set.
    pub integral: Approximate,
    /// The density's integral over the pose-set.
    pub mass: Approximate,
    /// `integral / mass`.
    pub mean: Approximate,
    /// The part of the mass that is outside S.
    pub outside_mass: Approximate,
    /// The part of the mass that is in S and sees a tag in a way of which the cost says nothing (it is infinite). Each such
    /// pose costs as much as one outside.
    pub unknown_mass: Approximate,
    /// `(outside_mass + unknown_mass) / mass`: how probable a miss is.
    pub p_miss: Approximate,
    /// At how many headings the set was looked at.
    pub headings: u32,
}

/// Why there is no expected cost.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CostError {
    /// The success set has no view of a tag in it.
    #[error("its success set (`{0}`) has no view of a tag in it, so that seeing one has no cost")]
    NoView(&'static str),
    /// A number of the cost that is below zero or not finite.
    #[error("{name} is {value}; expected a finite number that is not below 0")]
    Number {
        /// Which one.
        name: &'static str,
        /// What was given.
        value: f64,
    },
    /// An accuracy that is none.
    #[error("the accuracy is {0}; expected a number between 1e-12 and 1")]
    Accuracy(f64),
}

/// The expected cost of a pose-set about the set's goal (the paper's `x = x*`).
///
/// S is the whole success set, as [`SuccessSet::membership`] has it. Where several tags are seen, the least
/// of their costs counts.
///
/// The mass outside is integrated between the exact borders of S ([`expected_cost_of`]), so that it is good to
/// its own share, however rare a miss is: of whatever S keeps away from (obstacles, hidden places, a tag too near or
/// too square), and of each box or region of a union, it is known at each heading where it is, and it is met by a ray
/// or its mass is in the error that is told. (At which headings it comes within reach is looked for from 48 or more, by
/// how far away it is; that is no proof.) A place that only the views of a union leave out between them has no such
/// guard: where it is smaller than the rays are apart, it may be missed.
///
/// # Errors
/// [`CostError`].
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

/// Of which views a cost says something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CostDomain {
    Everywhere,
    Perhaps,
}

/// The same for any cost of a view `[d, phi, psi]` (m, rad), not below zero; infinite where nothing is known of such views.
///
/// Of these the mass is integrated by itself: along each ray between its ends, which are looked for between 21 samples of
/// each stretch; across the rays and headings by quadrature alone, so that its error is as a rule larger than that of
/// `outside_mass`. A part that no sample meets is missed.
///
/// Cost: a few hundred to some ten thousand rays, each with 7 or 15 views; the same number for the same
/// arguments on every machine.
///
/// The density is that of a standard normal u in a ball. At each heading (u1) the rest is a disc, which is
/// swept by rays from its middle. Of each ray the set's stretches are known exactly; the mass between is closed
/// form (`exp(-a^2/2) - exp(-b^2/2)`), the cost a Gauss-Kronrod sum. Rays are summed by Gauss-Kronrod between the
/// angles at which another constraint ends them, and headings adaptively.
///
/// # Errors
/// [`CostError`].
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
    // First, where it is easily met: then it is known how much the rest matters.
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
    /// The cost of a pose that is known exactly (the paper's `x = x*`): the mass is 1, a miss is certain or
    /// impossible, and no number has an error.
    ///
    /// # Errors
    /// [`CostError::NoView`], [`CostError::Number`].
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
        // In the set without a view, as in a union with a box: the tags are where they are.
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

/// What counts for the mass of what is unknown, by the cost of a view: what is known is left out, whatever else is seen.
pub(super) fn unknown(cost: f64) -> f64 {
    if cost.is_finite() {
        f64::NEG_INFINITY
    } else {
        1.0
    }
}

/// The views in a set, each as a set of its own.
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
