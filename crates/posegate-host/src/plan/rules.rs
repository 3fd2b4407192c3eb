//! A plan as rules that a controller executes.

use super::{Plan, PlanResult, PlanStep, StepKind};
use super::{RuleOrder, write_rules};
use crate::site::Site;
use posegate::num::BinaryAngle;
use posegate::pose::Pose;
use posegate::sequencer::{Kind, NO_TAG, Rule};
use posegate::set::Estimate;
use posegate::task::Cylinder;

/// How often a look is tried before its tag counts as lost.
const ATTEMPTS: u8 = 2;

impl PlanResult {
    /// The rules of a plan and of what to do where its looks fail, for [`posegate::sequencer`]. `None` where there is no
    /// plan, where a task begins with a set that is an ellipsoid (rules tell sets by the cylinder about them, and that was
    /// not proven: write the start as `bounded`), or where what is known is beyond the numbers.
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
    // A rule holds for every set in a cylinder; where an ellipsoid was proven, or carried along a drive, only for itself.
    let alone = standing.spread == Cylinder::POINT || step.report.kind == StepKind::Navigation;
    if standing.knowledge.is_ellipsoid() && alone || step.report.failure.is_some() {
        return None;
    }
    // Of several tags none is named.
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
            spread: nothing_less(standing.spread)?,
            set: standing.knowledge.enclosing()?,
            to,
        },
    })
}

/// An estimate is rounded to the micrometre and 2^-32 turn: so much may a place that is met exactly seem off.
fn nothing_less(spread: Cylinder) -> Option<Cylinder> {
    spread.plus(Cylinder::from_um_q24(2, 1)?)
}
