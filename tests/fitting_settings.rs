//! Settings that fit a source open the gate and keep it open while reports arrive as stated. Settings that can never open are refused,
//! with the smallest number that can.

use posegate::gate::{Gate, InvalidParameter, Settings, Source};
use posegate::motion::MotionBounds;
use posegate::report::{FrameId, PoseEstimate, Report};
use posegate::set::{CrossTerms, Estimate};
use posegate::table::Table;
use proptest::prelude::*;

const SEE_T7: &[u8] = include_bytes!("../examples/tables/see-t7.posegate");
const CYCLE_MS: u32 = 20;

/// Returns how long a gate is open, ms, while good reports come every `period_ms`, each up to `jitter_ms` after its stamp.
fn open_ms(
    settings: &Settings<'_>,
    period_ms: u32,
    delays: &[u32],
) -> Result<u32, InvalidParameter> {
    let mut gate = Gate::new(SEE_T7, settings, 0)?;
    let estimate = Estimate {
        x_m: 0.0,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let mut coming: Vec<(u32, Report)> = (0..)
        .zip(delays)
        .map(|(sequence, delay)| {
            let stamp_ms = 1000 + sequence * period_ms;
            let report = Report {
                source: 0,
                frame: FrameId::of("map"),
                sequence,
                stamp_ms,
                belief: PoseEstimate::diagonal(estimate, [1e-4, 1e-4, 1e-5]),
            };
            (stamp_ms + delay, report)
        })
        .collect();
    coming.reverse();
    let (mut open, mut now) = (0, 1000);
    while let Some((arrives, report)) = coming.last() {
        now += CYCLE_MS;
        let step = if *arrives <= now {
            let step = gate.step(now, report);
            coming.pop();
            step
        } else {
            gate.tick(now)
        };
        open += if step.permission.is_permit() {
            CYCLE_MS
        } else {
            0
        };
    }
    Ok(open)
}

fn with_source<'a>(times: Settings<'a>, table: &Table<'a>, sources: &'a [Source]) -> Settings<'a> {
    Settings {
        task: table.task(),
        task_digest: table.task_digest(),
        sources,
        ..times
    }
}

fn sources() -> [Source; 1] {
    let still = MotionBounds::STANDS_STILL;
    [Source::new("map", 1.0, CrossTerms::Filled, still).unwrap()]
}

proptest! {
    /// After the hold time and three permits the gate is open until the last report, whatever the delays.
    #[test]
    fn fitting_settings_keep_the_gate_open(
        period_ms in 20u32..1500,
        share in 0.0..1.0f64,
        shares in prop::collection::vec(0.0..1.0f64, 12),
    ) {
        // Reports must not overtake each other within a cycle.
        let jitter_ms = (share * f64::from(period_ms.saturating_sub(CYCLE_MS))) as u32;
        let delays: Vec<u32> = shares.iter().map(|part| (part * f64::from(jitter_ms)) as u32).collect();
        let (table, sources) = (Table::parse(SEE_T7).unwrap(), sources());
        let settings = with_source(Settings::for_source(period_ms, jitter_ms), &table, &sources);
        let open = open_ms(&settings, period_ms, &delays).unwrap();
        // Open from the third report to the twelfth, each at most a cycle and its delay after its stamp.
        let least = (9 * period_ms).saturating_sub(jitter_ms + 3 * CYCLE_MS);
        prop_assert!(open >= least, "{open} of {least} ms with {period_ms} and {jitter_ms}");
    }

    /// Refused settings never open; with the number that the refusal names they open.
    #[test]
    fn refused_settings_never_open(
        cycles in 2u32..75,
        hold_ms in 1u32..1500,
        age_ms in 22u32..1500,
    ) {
        // Whole cycles, so that reports are evaluated at the distance of their stamps.
        let period_ms = CYCLE_MS * cycles;
        let (table, sources) = (Table::parse(SEE_T7).unwrap(), sources());
        let mut settings = with_source(Settings::for_source(period_ms, 0), &table, &sources);
        settings.permit_hold_ms = hold_ms;
        settings.maximum_age_ms = age_ms;
        let delays = [0; 12];
        let mut refused = 0;
        while let Err(error) = settings.check() {
            // With a period of 1 the gate can be made; a step does not use the period.
            let unstated = Settings { report_period_ms: 1, ..settings };
            prop_assert_eq!(open_ms(&unstated, period_ms, &delays), Ok(0), "{}", error);
            prop_assert_eq!(open_ms(&settings, period_ms, &delays), Err(error));
            match error {
                InvalidParameter::PermitHoldTooShort { least_ms } => {
                    prop_assert!(settings.permit_hold_ms < least_ms);
                    settings.permit_hold_ms = least_ms;
                }
                InvalidParameter::MaximumAgeTooShort { least_ms } => {
                    prop_assert!(settings.maximum_age_ms < least_ms);
                    settings.maximum_age_ms = least_ms;
                }
                other => return Err(TestCaseError::fail(format!("{other}"))),
            }
            let named = error.to_string();
            prop_assert!(named.contains("ms or more"), "{}", named);
            refused += 1;
            prop_assert!(refused <= 2);
        }
        prop_assert!(open_ms(&settings, period_ms, &delays).unwrap() > 0);
    }
}

/// With one required permit the gate opens for a while, however rare the reports are.
#[test]
fn single_permit_needs_no_next_report() {
    let (table, sources) = (Table::parse(SEE_T7).unwrap(), sources());
    let mut settings = with_source(Settings::for_source(1000, 0), &table, &sources);
    settings.permits_in_a_row = 1;
    settings.permit_hold_ms = 100;
    settings.inhibit_hold_ms = CYCLE_MS;
    assert!(open_ms(&settings, 1000, &[0; 6]).unwrap() >= 400);
    settings.permits_in_a_row = 2;
    assert_eq!(
        settings.check(),
        Err(InvalidParameter::PermitHoldTooShort { least_ms: 1000 })
    );
}

/// A permit that ends by itself restarts the inhibit hold time. If that time is not over at the next report, the gate
/// does not open again.
#[test]
fn single_permit_needs_hold_time_to_be_over() {
    let (table, sources) = (Table::parse(SEE_T7).unwrap(), sources());
    let mut settings = with_source(Settings::for_source(500, 0), &table, &sources);
    settings.permits_in_a_row = 1;
    settings.permit_hold_ms = 100;
    settings.inhibit_hold_ms = 450;
    assert_eq!(
        settings.check(),
        Err(InvalidParameter::PermitHoldTooShort { least_ms: 500 })
    );
    let unstated = Settings {
        report_period_ms: 1,
        ..settings
    };
    // It opens once after the start, and never again.
    assert_eq!(open_ms(&unstated, 500, &[0; 12]), Ok(120));
    settings.inhibit_hold_ms = 380;
    assert!(open_ms(&settings, 500, &[0; 12]).unwrap() > 1000);
}

#[test]
fn numbers_in_refusals_are_exact() {
    let (table, sources) = (Table::parse(SEE_T7).unwrap(), sources());
    let fitting = with_source(Settings::for_source(500, 0), &table, &sources);
    let hold = |permit_hold_ms| Settings {
        permit_hold_ms,
        ..fitting
    };
    let age = |maximum_age_ms| Settings {
        maximum_age_ms,
        ..fitting
    };
    assert_eq!(
        hold(499).check(),
        Err(InvalidParameter::PermitHoldTooShort { least_ms: 500 })
    );
    assert_eq!(
        age(519).check(),
        Err(InvalidParameter::MaximumAgeTooShort { least_ms: 520 })
    );
    for settings in [hold(500), age(520)] {
        assert!(open_ms(&settings, 500, &[0; 12]).unwrap() > 0);
    }
}
