//! What seeing a tag costs from where the robot may be: E\[c\] of Eqs. 10 to 12.

use super::gaussian::Gaussian;
use super::headings;
use super::quadrature::{Approximate, Quadrature};
use crate::shape::{Along, SuccessSet};

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
    /// `outside_mass / mass`: how probable a miss is.
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
/// its own share, however rare a miss is.
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
    expected_cost_of(set, belief, cost.c_high, &of_view, quadrature)
}

/// The same for any cost of a view `[d, phi, psi]` (m, rad), not below zero and finite wherever the tag is seen.
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
    if !(c_high >= 0.0 && c_high.is_finite()) {
        let (name, value) = ("c_high", c_high);
        return Err(CostError::Number { name, value });
    }
    if !(quadrature.accuracy >= 1e-12 && quadrature.accuracy <= 1.0) {
        return Err(CostError::Accuracy(quadrature.accuracy));
    }
    let along = Along::of(set);
    if along.views() == 0 {
        return Err(CostError::NoView(set.shape.name()));
    }
    let white = belief.at(set.goal);
    let aim = headings::Aim {
        accuracy: quadrature.accuracy,
        c_high,
    };
    let (sum, headings) = headings::integrate(&along, &white, of_view, aim, quadrature.headings);
    let [seen, outside_mass] = sum.both();
    let mass = belief.mass();
    let integral = Approximate {
        value: seen.value + c_high * outside_mass.value,
        error: seen.error + c_high * outside_mass.error,
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
        p_miss: share(outside_mass),
        headings,
    })
}
