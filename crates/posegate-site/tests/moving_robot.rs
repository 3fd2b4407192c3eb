//! Promise P7: at every moment at which the interlock is open, every possible pose of the robot is in the success
//! set. Possible poses follow from the report, the robot's motion since then, and its motion until the permission
//! ends.
//!
//! The judge shares no code with the gate: floats, the footprint's corners, and the hall's walls. A simulated source
//! reports sets that the judge has moved to the border between permit and denial; fixes come late, or not at all. The
//! robot drives towards the wall as fast as it may.

use posegate::gate::{Gate, Restart, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{Aging, Estimate, Trust, Uncertainty};
use posegate::table::Table;
use posegate_testkit::counts::{first_seed, is_deep};
use posegate_testkit::driven::{Found, driven};
use posegate_testkit::hall::{self, Believed};
use posegate_testkit::oracle::Rng;

/// A source, a controller, and a robot.
#[derive(Clone, Copy, Debug)]
struct Drive {
    speed: f64,
    rate: f64,
    cycle_ms: u32,
    response_ms: u32,
    maximum_age_ms: u32,
    permit_hold_ms: u32,
    permits_in_a_row: u16,
    period_ms: u32,
    latency_ms: u32,
}

impl Drive {
    fn drawn(rng: &mut Rng) -> Self {
        let cycle_ms = 1 + rng.below(20) as u32;
        let response_ms = cycle_ms + 1 + rng.below(20) as u32;
        let period_ms = 10 + rng.below(600) as u32;
        let latency_ms = rng.below(120) as u32;
        Self {
            speed: rng.log_within(0.02, 1.0),
            rate: if rng.chance(0.3) {
                0.0
            } else {
                rng.log_within(0.02, 1.5)
            },
            cycle_ms,
            response_ms,
            maximum_age_ms: latency_ms + response_ms + 1 + rng.below(800) as u32,
            permit_hold_ms: 1 + rng.below(700) as u32,
            permits_in_a_row: 1 + rng.below(2) as u16,
            period_ms,
            latency_ms,
        }
    }

    /// The longest time after its stamp for which a permission can last, if it is given as soon as the estimate
    /// arrives, seconds.
    fn longest(&self) -> f64 {
        let held = self.latency_ms + self.permit_hold_ms + self.response_ms;
        f64::from(held.min(self.maximum_age_ms)) * 1e-3
    }
}

/// Drives with a gate whose motion bounds are `stated(drive)`.
fn drive(rng: &mut Rng, bytes: &[u8], stated: impl Fn(&Drive) -> MotionBounds, found: &mut Found) {
    let table = Table::parse(bytes).expect("a table");
    let radius_squared = f64::from(table.radius_squared().q16()) / 65_536.0;
    let drive = Drive::drawn(rng);
    let sources = [Source {
        frame: FrameId::of("map"),
        trust: Trust::FULL,
        aging: Aging::NONE,
        motion: stated(&drive),
    }];
    let settings = Settings {
        task: "hall",
        task_digest: table.task_digest(),
        sources: &sources,
        maximum_age_ms: drive.maximum_age_ms,
        response_ms: drive.response_ms,
        report_period_ms: 1,
        permit_hold_ms: drive.permit_hold_ms,
        inhibit_hold_ms: 1,
        permits_in_a_row: drive.permits_in_a_row,
        restart: Restart::Automatic,
        most_runs: 1_000,
        look_at: None,
    };
    // Near the wrap of the clock.
    let start = u32::MAX - rng.below(3_000) as u32;
    let mut gate = Gate::new(bytes, &settings, start).expect("settings");
    let (mut now_ms, mut next_fix) = (0u32, 5u32);
    let (mut sequence, mut is_open) = (0u32, false);
    // The newest report that was permitted, and its stamp.
    let mut newest: Option<(u32, Believed)> = None;
    for _ in 0..200 {
        now_ms += 1 + rng.below(u64::from(drive.cycle_ms) as usize) as u32;
        let at = start.wrapping_add(now_ms);
        let step = if now_ms >= next_fix + drive.latency_ms {
            let stamp = next_fix;
            next_fix = now_ms.max(next_fix + drive.period_ms);
            if rng.chance(0.05) {
                // Lost before it is numbered.
                continue;
            }
            let longest = drive.longest();
            let (length, swing) = (drive.speed * longest, drive.rate * longest);
            let slack = rng.within(-0.004, 0.008);
            let drawn = Believed::drawn(rng, [0.15, 0.6]);
            let Some(set) = drawn.placed(rng.within(0.0, 6.3), slack, length, swing) else {
                return;
            };
            sequence += 1;
            let estimate = Estimate {
                x_m: set.mean[0],
                y_m: set.mean[1],
                yaw_rad: set.mean[2],
            };
            let covariance = set.covariance(radius_squared);
            let report = Report {
                source: 0,
                frame: FrameId::of("map"),
                sequence,
                stamp_ms: start.wrapping_add(stamp),
                belief: PoseEstimate::new(estimate, Uncertainty::Gaussian(covariance)),
            };
            let step = gate.step(at, &report);
            if step.verdict.is_ok() {
                newest = Some((stamp, set));
            }
            step
        } else {
            gate.tick(at)
        };
        let was_open = std::mem::replace(&mut is_open, step.permission.is_permit());
        if !is_open {
            continue;
        }
        found.openings += u64::from(!was_open);
        let (stamp, set) = newest.expect("an open gate has permitted a report");
        // Valid until the output has followed the next answer.
        let ends = f64::from(now_ms + drive.response_ms - stamp) * 1e-3;
        if found.note(-set.room(drive.speed * ends, drive.rate * ends)) {
            eprintln!("outside {ends} s after the stamp: {drive:?} {set:?}");
        }
    }
}

fn driven_with(openings: u64, seed: u64, stated: impl Fn(&Drive) -> MotionBounds + Sync) -> Found {
    let bytes = hall::facets(&hall::site([0.0; 3]), "hall", 2.5);
    driven(openings, seed, |rng, found| {
        drive(rng, &bytes, &stated, found)
    })
}

fn bounds(drive: &Drive) -> MotionBounds {
    MotionBounds::new(drive.speed, 0.0, drive.rate).expect("bounds")
}

#[test]
fn no_open_moment_has_a_pose_outside() {
    let openings = if is_deep() { 1_000_000 } else { 1_500 };
    let found = driven_with(openings, first_seed(), bounds);
    assert_eq!(found.outside, 0, "{found:?}");
    assert!(found.moments > 5 * found.openings, "{found:?}");
}

/// The judge detects a gate with bounds of no speed, of nine tenths of it, or of half the turn rate.
#[test]
fn judge_detects_a_gate_with_too_small_bounds() {
    let still = driven_with(200, 3, |_| MotionBounds::STANDS_STILL);
    assert!(still.outside > 100, "{still:?}");
    let slower = driven_with(800, 3, |drive| {
        MotionBounds::new(0.9 * drive.speed, 0.0, drive.rate).expect("bounds")
    });
    assert!(slower.outside > 20, "{slower:?}");
    let no_turn = driven_with(400, 3, |drive| {
        MotionBounds::new(drive.speed, 0.0, 0.5 * drive.rate).expect("bounds")
    });
    assert!(no_turn.outside > 5, "{no_turn:?}");
}
