//! Counts the cost of evaluating a chain of eight steps, in QEMU as `count_instructions.rs` does for decisions.
//!
//! ```text
//! cargo run -p posegate --profile firmware --target thumbv7em-none-eabihf --features firmware --example count_chain
//! ```
//!
//! Prints one JSON line per figure; ends with exit code 1 if a figure is above its goal or cannot be trusted.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// Firmware has no meaning on a host; this lets `cargo test --all-features` build there.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board;

#[cfg(target_os = "none")]
#[path = "board/emulated.rs"]
mod emulated;

#[cfg(target_os = "none")]
mod firmware {
    use crate::board::counter::{Counter, Failure, goal};
    use crate::board::stack::used_by;
    use crate::emulated::run;
    use core::hint::black_box;
    use cortex_m_rt::entry;
    use cortex_m_semihosting::hprintln;
    use posegate::chain::{BeliefState, Evaluation, StartAssumption, Step, evaluate};
    use posegate::contain::decide_with_margin;
    use posegate::num::BinaryAngle;
    use posegate::pose::Pose;
    use posegate::sequencer::{Instruction, Rules, Sequencer};
    use posegate::set::{Estimate, PoseSet, RadiusSquared};
    use posegate::table::Table;
    use posegate::task::{
        BoundedDriveModel, Cylinder, Leg, MotionUpdate, Odometry, PathTolerance, PoseErrorSet, Risk,
    };

    static LEFT: &[u8] = include_bytes!("tables/see-left.posegate");
    static DOCK: &[u8] = include_bytes!("tables/contingent-dock.posegate");
    static RULES: &[u8] = include_bytes!("tables/contingent.rules");

    const STEPS: usize = 8;

    #[inline(never)]
    fn chain(start: BeliefState, steps: &[Step<'_>; STEPS]) -> Option<Evaluation<STEPS>> {
        let steps = steps.iter().copied();
        evaluate(start, steps, StartAssumption::General, decide_with_margin)
    }

    fn cylinder(translation_m: f64, yaw_rad: f64) -> Result<Cylinder, Failure> {
        Cylinder::new(translation_m, yaw_rad).ok_or("no cylinder")
    }

    fn at(x_m: f64, y_m: f64, yaw_rad: f64) -> Estimate {
        Estimate { x_m, y_m, yaw_rad }
    }

    fn measure() -> Result<(), Failure> {
        let mut counter = Counter::new()?;
        let table = |bytes| Table::parse(bytes).map_err(|_| "the table does not parse");
        let (left, dock) = (table(LEFT)?, table(DOCK)?);
        let drift = BoundedDriveModel {
            k_turn: 0.004,
            k_drift: 0.004,
            k_slip: 0.01,
        };
        let looked = cylinder(0.04, 0.026)?;
        let begin = at(0.0, 0.0, 0.0);
        let near = at(1.5, 0.2, 0.119_428_926);
        let end = at(1.5, 0.2, 0.0);
        let drive = |from: &Estimate, to: Estimate, away: Cylinder| {
            let within = PathTolerance {
                start: away,
                end: cylinder(0.01, 0.005)?,
            };
            MotionUpdate::bounded(from, &[Leg::Straight(to)], &drift, within)
                .map_err(|_| "no growth")
        };
        // Every drive may begin at any estimate that an observation allows.
        let first = drive(&begin, near, cylinder(0.45, 0.07)?)?;
        let again = drive(&near, near, cylinder(0.3, 0.12)?)?;
        let last = drive(&near, end, cylinder(0.25, 0.2)?)?;
        let look = |table, bound| Step::Localization {
            table,
            bound,
            risk: Risk::NONE,
        };
        let steps = [
            look(&left, looked),
            Step::Navigation(&first),
            look(&left, looked),
            Step::Navigation(&again),
            look(&left, looked),
            Step::Navigation(&again),
            Step::Navigation(&last),
            Step::Work(&dock),
        ];
        let start = BeliefState {
            pose: Pose {
                x_um: 0,
                y_um: 0,
                yaw: BinaryAngle(0),
            },
            spread: Cylinder::POINT,
            knowledge: PoseErrorSet::bounded(cylinder(0.4, 0.035)?),
        };
        let (cost, evaluation) = counter.count(|| chain(black_box(start), black_box(&steps)))?;
        let evaluation = evaluation.ok_or("the chain has too many steps")?;
        if let Some((step, why)) = evaluation.first_failure() {
            hprintln!("step {}: {:?}", step, why);
            return Err("the chain fails");
        }
        counter.line(
            "",
            "chain of eight steps",
            cost,
            "instructions",
            goal(20_000, 0),
        );
        let (stack, _) = used_by(|| chain(black_box(start), black_box(&steps)));
        counter.line(
            "stack of",
            "chain of eight steps",
            u64::from(stack),
            "B",
            goal(1024, 0),
        );

        // A drive with Gaussian odometry, after a Gaussian estimate.
        let radius = RadiusSquared::from_q16(743_499).ok_or("no radius")?;
        let risk = Risk::from_confidence(0.99).ok_or("no risk")?;
        let odometry = Odometry {
            a1: 0.002,
            a2: 0.001,
            a3: 0.003,
            a4: 0.002,
        };
        let make = || {
            let legs = [Leg::Straight(black_box(near))];
            MotionUpdate::gaussian(
                black_box(&begin),
                &legs,
                &odometry,
                PathTolerance::default(),
                radius,
                risk,
            )
        };
        let growth = counter
            .print("growth of a path made of floats, odometry", make)?
            .map_err(|_| "no growth")?;
        let covariance = [
            [0.0025, 0.0006, -0.0005],
            [0.0006, 0.0036, 0.0004],
            [-0.0005, 0.0004, 0.0012],
        ];
        let known =
            PoseErrorSet::gaussian(covariance, radius, risk).map_err(|_| "no covariance")?;
        let _ = counter
            .print("growth of a covariance along a path", || {
                black_box(&growth).after(black_box(&known))
            })?
            .ok_or("beyond the numbers")?;
        let known = PoseErrorSet::bounded(looked);
        let _ = counter
            .print("growth of a cylinder along a path", || {
                black_box(&last).after(black_box(&known))
            })?
            .ok_or("beyond the numbers")?;

        let rules = counter
            .print("rules of a plan parsed", || Rules::parse(black_box(RULES)))?
            .map_err(|_| "no rules")?;
        let mut plan = Sequencer::new(rules);
        let set = PoseSet::bounded(begin, 0.39, 0.034).map_err(|_| "no set")?;
        let instruction = counter.print("next step of a plan", || plan.next(black_box(&set)))?;
        if !matches!(instruction, Instruction::Drive { .. }) {
            return Err("the plan does not begin with a drive");
        }
        if counter.short {
            return Err("a figure is above its goal");
        }
        Ok(())
    }

    #[entry]
    fn main() -> ! {
        run(measure)
    }
}
