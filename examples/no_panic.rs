//! Links only if no function that a controller calls can panic: the panic handler calls a function that
//! does not exist, so any panic that the optimiser cannot rule out is an undefined symbol.
//!
//! Built with overflow checks on (profile `firmware`), so that an unintended arithmetic overflow is
//! such a panic as well. Run by `ci.sh no_panic` on Cortex-M0+ and Cortex-M4F; with
//! `--cfg seeded_panic` it must fail to link.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod controller {
    use core::hint::black_box;
    use core::panic::PanicInfo;
    use cortex_m_rt::entry;
    use posegate::chain::{BeliefState, StartAssumption, Step, evaluate};
    use posegate::contain::second::{opinion, opinion_after};
    use posegate::contain::{decide, decide_with_margin, examine};
    use posegate::gate::{
        Evidence, Gate, Interlock, NoPin, Reason, Restart, Scrub, Seal, Settings, Source, Verdict,
    };
    use posegate::motion::MotionBounds;
    use posegate::num::BinaryAngle;
    use posegate::pose::Pose;
    use posegate::recordings::Evaluator;
    use posegate::report::{FrameId, Heading, PoseEstimate, Report};
    use posegate::sequencer::{Rules, Sequencer};
    use posegate::set::{
        Aging, CrossTerms, Estimate, Growth, Inflation, PoseSet, RadiusSquared, SplitWeight, Trust,
        Uncertainty,
    };
    use posegate::sight::Scene;
    use posegate::table::Table;
    use posegate::task::{
        BoundedDriveModel, Cylinder, Leg, MotionUpdate, Odometry, PathTolerance, PoseErrorSet, Risk,
    };
    use posegate::track::{Increment, OdometryErrors, Tracked, Tracker, TrackerSettings};
    use posegate::wire::{
        HypothesisCollector, Receiver, Reply, Request, Telemetry, counted_report_body, encode,
        hypothesis_body, increment_body, increment_from_body, report_body, report_from_body,
    };

    unsafe extern "C" {
        /// Not defined anywhere.
        fn a_panic_is_reachable() -> !;
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        // SAFETY: never linked.
        unsafe { a_panic_is_reachable() }
    }

    #[used]
    static SEAL: Seal = Seal::UNSEALED;

    static SOURCES: [Source; 1] = [Source {
        frame: FrameId::of("map"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: MotionBounds::STANDS_STILL,
    }];

    /// Calls a gate with all of its functions, and its outputs.
    fn track(fix: &Report) -> Option<Tracked> {
        let mut tracker = Tracker::<4>::new(black_box(TrackerSettings {
            errors: OdometryErrors::NONE,
            bounds: MotionBounds::new(black_box(1.0), black_box(0.0), black_box(1.0))?,
            trust: Trust::FULL,
            radius_squared: RadiusSquared::from_q16(black_box(1 << 16))?,
            maximum_gap_ms: 1,
            maximum_fix_age_ms: 1,
        }))?;
        for span_ms in black_box([[0, 0], [0, 1]]) {
            let ahead_m = black_box(0.0);
            let increment = Increment::of(ahead_m, ahead_m, ahead_m, span_ms)?;
            let body = increment_body(&increment);
            let received = increment_from_body(black_box(&body)).ok()?;
            black_box(tracker.odometry(received).is_ok());
        }
        black_box(tracker.fix(fix).is_ok());
        tracker.forget();
        let mut collector = HypothesisCollector::new();
        let body = hypothesis_body(black_box(1), fix)?;
        black_box(collector.take(black_box(&body)).is_ok());
        let body = counted_report_body(black_box(1), fix)?;
        black_box(collector.take(black_box(&body)).is_ok());
        tracker.tracked(black_box(1)).ok()
    }

    fn gate(bytes: &[u8]) {
        let settings = black_box(Settings {
            task: "dock",
            task_digest: [0; 32],
            sources: &SOURCES,
            maximum_age_ms: 2,
            response_ms: 1,
            report_period_ms: 1,
            permit_hold_ms: 1,
            inhibit_hold_ms: 1,
            permits_in_a_row: 1,
            restart: Restart::Automatic,
            most_runs: 1_000,
            look_at: None,
        });
        let (Ok(mut gate), Ok(interlock)) = (
            Gate::new(bytes, &settings, black_box(0)),
            Interlock::new(NoPin),
        ) else {
            return;
        };
        let interlock = interlock.with_read_back(NoPin, black_box(1));
        let interlock = interlock.and_then(|i| i.with_heartbeat(NoPin, black_box(1)));
        let Ok(mut interlock) = interlock else {
            return;
        };
        let report = black_box(Report {
            source: 0,
            frame: FrameId::UNNAMED,
            sequence: 0,
            stamp_ms: 0,
            belief: PoseEstimate::compact([0.0; 9]),
        });
        let step = gate.step(black_box(1), &report);
        black_box(interlock.apply(black_box(1), &step.permission).is_ok());
        let _ = black_box(gate.tick(black_box(2)));
        let _ = black_box(gate.scrub(black_box(3)));
        let _ = black_box(gate.examine(&report));
        if let Some(tracked) = track(&report) {
            let others = black_box([report.belief; 2]);
            let evidence = Evidence {
                others: &others,
                since_fix_ms: black_box(Some(700)),
                ..tracked.evidence()
            };
            let _ = black_box(gate.step_on(black_box(1), &evidence));
            let _ = black_box(gate.examine_on(&evidence));
        }
        black_box(Aging::new(&black_box([(64, Inflation::NONE); 2])).is_some());
        if let Some(aging) = Aging::from_words(black_box([0; 4])) {
            let source = Source {
                frame: FrameId::of("map"),
                trust: Trust::FULL,
                aging,
                motion: MotionBounds::STANDS_STILL,
            };
            black_box(source.trust_after(black_box(Some(1))));
            black_box(aging.is_within(black_box(Inflation::NONE)));
        }
        black_box((gate.state(), gate.advice()));
        let _ = black_box(gate.inhibit(black_box(2), black_box(Reason::InterlockFault)));
        gate.fault(black_box(Reason::InterlockFault));
        black_box(SEAL.check(bytes).is_ok());
        let _ = black_box(SEAL.scrub(black_box(&mut Scrub::new()), bytes, black_box(3)));
        black_box((gate.reset(black_box(4)).is_ok(), interlock.close().is_ok()));
        interlock.reset();
    }

    /// Calls a path, its motion update, a chain, and a plan.
    fn chain(bytes: &[u8], estimate: Estimate, covariance: [[f64; 3]; 3], radius: RadiusSquared) {
        let legs = [
            Leg::Straight(black_box(estimate)),
            Leg::Arc {
                x_m: black_box(0.0),
                y_m: black_box(0.0),
            },
        ];
        let cylinder = Cylinder::new(black_box(0.0), black_box(0.0)).unwrap_or_default();
        let within = PathTolerance {
            start: cylinder,
            end: cylinder,
        };
        let risk = Risk::from_confidence(black_box(0.0)).unwrap_or_default();
        let drift = black_box(BoundedDriveModel {
            k_turn: 0.0,
            k_drift: 0.0,
            k_slip: 0.0,
        });
        let odometry = black_box(Odometry {
            a1: 0.0,
            a2: 0.0,
            a3: 0.0,
            a4: 0.0,
        });
        let drives = [
            MotionUpdate::bounded(&estimate, &legs, &drift, within),
            MotionUpdate::gaussian(&estimate, &legs, &odometry, within, radius, risk),
        ];
        let known = [
            PoseErrorSet::gaussian(covariance, radius, risk),
            Ok(PoseErrorSet::bounded(cylinder)),
        ];
        let ([Ok(first), Ok(second)], Ok(table)) = (&drives, Table::parse(bytes)) else {
            return;
        };
        for knowledge in known.into_iter().flatten() {
            let steps = [
                Step::Localization {
                    table: &table,
                    bound: cylinder,
                    risk,
                },
                Step::Navigation(first),
                Step::Navigation(second),
                Step::Work(&table),
            ];
            let start = BeliefState {
                pose: first.from(),
                spread: cylinder,
                knowledge,
            };
            for assume in [StartAssumption::AtGoal, StartAssumption::General] {
                let found = evaluate::<4>(start, steps, assume, decide_with_margin);
                black_box(found.is_some_and(|found| found.first_failure().is_some()));
            }
        }
        let Ok(rules) = Rules::parse(bytes) else {
            return;
        };
        let mut plan = Sequencer::new(rules);
        if let Ok(set) = PoseSet::gaussian(estimate, covariance, radius) {
            let _ = black_box(plan.next(&set));
            plan.succeeded();
            plan.failed();
            black_box((plan.rule(), plan.surprises(), plan.rules().site_digest()));
        }
    }

    #[entry]
    fn main() -> ! {
        let bytes: &[u8] = black_box(&[]);
        let mut receiver = Receiver::new();
        loop {
            let estimate = Estimate {
                x_m: black_box(0.0),
                y_m: black_box(0.0),
                yaw_rad: black_box(0.0),
            };
            let covariance: [[f64; 3]; 3] = black_box([[0.0; 3]; 3]);
            let radius = RadiusSquared::from_q16(black_box(1)).unwrap_or(RadiusSquared::LARGEST);
            let gaussian = PoseSet::gaussian(estimate, covariance, radius);
            let bounded = PoseSet::bounded(estimate, black_box(0.0), black_box(0.0));
            if let (Ok(table), Ok(set)) = (Table::parse(bytes), gaussian) {
                let _ = black_box(decide(&table, &set));
                let _ = black_box(decide_with_margin(&table, &set));
                let bounds = MotionBounds::new(black_box(0.0), black_box(0.0), black_box(0.0));
                let growth = bounds.map(|bounds| bounds.within(black_box(0)));
                let moved = set.grown(growth.unwrap_or_default());
                let _ = black_box(decide(&table, &moved));
                let _ = black_box(examine(&table, &moved));
                let _ = black_box(examine(&table, &set));
                black_box(table.worst_case());
            }
            if let Some(scene) = Table::parse(bytes).ok().as_ref().and_then(Scene::of) {
                let sighting = scene.look(&Pose {
                    x_um: black_box(0),
                    y_um: black_box(0),
                    yaw: BinaryAngle(black_box(0)),
                });
                black_box(sighting.phi_rad_for_telemetry());
                black_box(sighting.psi_rad_for_telemetry());
                black_box(scene.record().bytes());
                let _ = black_box(sighting);
            }
            let inflation = Inflation::from_q16(black_box(1)).unwrap_or(Inflation::NONE);
            let share = SplitWeight::from_q8(black_box(1)).unwrap_or(SplitWeight::HALF);
            for cross_terms in [CrossTerms::Filled, CrossTerms::YawUnknown(share)] {
                let belief = PoseEstimate {
                    heading: Heading::Quaternion(black_box([0.0; 4])),
                    ..PoseEstimate::new(estimate, black_box(Uncertainty::Gaussian(covariance)))
                };
                let trust = black_box(Trust {
                    inflation,
                    cross_terms,
                });
                black_box(opinion(bytes, black_box(&belief), trust));
                let moved = Growth::new(black_box(0), black_box(0));
                black_box(opinion_after(bytes, black_box(&belief), trust, &moved));
            }
            gate(bytes);
            chain(bytes, estimate, covariance, radius);
            if let Ok(gate) = Evaluator::new(bytes, black_box(200)) {
                let (now, stamp) = (black_box(1), black_box(2));
                let _ = black_box(gate.permits(now, stamp, bounded));
                let verdict: Verdict = gate.evaluate(now, stamp, gaussian);
                let reply = Reply {
                    sequence: 0,
                    verdict: Ok(verdict),
                    interlock_high: false,
                };
                black_box(encode(&reply.body()));
            }
            if let Some(Ok(body)) = receiver.push(black_box(0)) {
                let request = Request::from_body(&body);
                black_box(request.is_ok_and(|request| request.pose_set().is_ok()));
                if let Ok(report) = report_from_body(&body) {
                    black_box(encode(&report_body(&report)));
                }
                if let Some(telemetry) = Telemetry::from_body(&body) {
                    black_box(encode(&telemetry.body()));
                }
            }
            #[cfg(seeded_panic)]
            black_box(bytes[black_box(3)]);
        }
    }
}
