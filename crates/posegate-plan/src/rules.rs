//! Converts a plan to rules that a controller executes.

use super::{Plan, PlanResult, PlanStep, StepKind};
use super::{RuleOrder, write_rules};
use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::sequencer::{Kind, NO_TAG, Rule};
use posegate::set::Estimate;
use posegate::task::Cylinder;
use posegate_site::Site;

/// Number of attempts of a look before its tag counts as lost.
const ATTEMPTS: u8 = 2;

impl PlanResult {
    /// Returns the rules of a plan and of its contingencies, for [`posegate::sequencer`]. Returns `None` if there is
    /// no plan, or if a number is out of range. Also returns `None` if a task begins with an ellipsoid. A rule
    /// describes a set by its enclosing cylinder, which was not proven: write the start as `bounded`.
    #[must_use]
    pub fn rules(&self, site: &Site) -> Option<Vec<u8>> {
        let plan = self.plan.as_ref()?;
        let mut orders: Vec<RuleOrder> = Vec::new();
        // The main plan's rules come first; then those of each contingency.
        let mut first = plan.steps.len();
        let mut begins = Vec::new();
        for other in &self.contingencies {
            begins.push((other.step, first));
            first += other.plan.steps.len();
        }
        append(&mut orders, plan, site, &begins)?;
        for other in &self.contingencies {
            append(&mut orders, &other.plan, site, &[])?;
        }
        write_rules(&orders, site.digest)
    }
}

fn append(
    orders: &mut Vec<RuleOrder>,
    plan: &Plan,
    site: &Site,
    begins: &[(usize, usize)],
) -> Option<()> {
    let base = orders.len();
    for (number, step) in plan.steps.iter().enumerate() {
        let otherwise = begins.iter().find(|(step, _)| *step == number);
        let otherwise = match otherwise {
            Some((_, first)) => Some(u16::try_from(*first).ok()?),
            None => None,
        };
        let last = plan.steps.len() - 1;
        let then = u16::try_from(base + (number + 1).min(last)).ok()?;
        orders.push(order(step, site, then, otherwise)?);
    }
    Some(())
}

fn order(step: &PlanStep, site: &Site, then: u16, otherwise: Option<u16>) -> Option<RuleOrder> {
    let standing = &step.report.standing;
    // A rule is valid for every set in a cylinder. An ellipsoid that was proven, or carried along a drive, is valid
    // only for itself.
    let alone = standing.spread == Cylinder::POINT || step.report.kind == StepKind::Navigation;
    if standing.knowledge.is_ellipsoid() && alone || step.report.failure.is_some() {
        return None;
    }
    // A rule names a tag only if the look needs exactly one.
    let named = match step.tags.as_slice() {
        [name] => Some(name),
        _ => None,
    };
    let tag = named.and_then(|name| site.tags.get(name));
    let [x_m, y_m, yaw_rad] = step.report.after.pose;
    let to = posegate::set::pose_of(Estimate { x_m, y_m, yaw_rad }).ok()?;
    let kind = match step.report.kind {
        StepKind::Work => Kind::Work,
        StepKind::Localization => Kind::Look,
        StepKind::Navigation => Kind::Drive,
    };
    let place = Pose {
        yaw: BinaryAngle(standing.pose.yaw.0),
        ..standing.pose
    };
    Some(RuleOrder {
        task: step.report.task.clone(),
        rule: Rule {
            kind,
            attempts: if kind == Kind::Look { ATTEMPTS } else { 1 },
            task: 0,
            tag: tag.map_or(NO_TAG, |tag| tag.tag.id),
            then,
            otherwise,
            place,
            spread: at_least_rounding(standing.spread)?,
            set: standing.knowledge.enclosing()?,
            to,
        },
    })
}

/// Widens a spread by the rounding of an estimate (1 um and 2^-32 turn): a place that is reached exactly may differ
/// by that.
fn at_least_rounding(spread: Cylinder) -> Option<Cylinder> {
    spread.plus(Cylinder::from_um_q24(2, 1)?)
}
