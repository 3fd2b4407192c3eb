//! Inflations by the time since the last fix: both evaluations use the factor of the age, and never a smaller one.

use super::*;
use crate::gate::InvalidParameter;
use crate::set::Inflation;
use proptest::prelude::*;

fn factor(times: f64) -> Inflation {
    Inflation::new(times).unwrap()
}

/// 1 up to half a second, 9 up to 5 s, 100 up to a minute, else 2500.
fn aged() -> Source {
    Source {
        trust: Trust {
            inflation: factor(2500.0),
            ..Trust::FULL
        },
        aging: Aging::new(&[
            (512, factor(1.0)),
            (4992, factor(9.0)),
            (59_968, factor(100.0)),
        ])
        .unwrap(),
        ..MAP
    }
}

/// The factor of an age, by its definition.
fn defined(since_fix_ms: Option<u32>) -> f64 {
    match since_fix_ms {
        Some(0..=512) => 1.0,
        Some(513..=4992) => 9.0,
        Some(4993..=59_968) => 100.0,
        _ => 2500.0,
    }
}

fn verdict(
    source: Source,
    y_m: f64,
    since_fix_ms: Option<u32>,
    table: &[u8],
) -> Result<(), Reason> {
    let see_t7 = Table::parse(SEE_T7).unwrap();
    let sources = [source];
    let settings = Settings {
        sources: &sources,
        ..settings(&see_t7, 1)
    };
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    gate.table = Ok(Table::parse(table).unwrap());
    let report = report(1, y_m);
    let evidence = Evidence {
        since_fix_ms,
        ..Evidence::of(&report)
    };
    let step = gate.step_on(1010, &evidence);
    assert_eq!(step.permission.is_permit(), step.verdict.is_ok());
    if step.verdict.is_ok() {
        let (_, examined) = gate.examine_on(&evidence);
        assert!(matches!(examined, Verdict::Permit { .. }), "{examined:?}");
    }
    step.verdict
}

proptest! {
    /// The verdict equals that of a source whose only inflation is the factor of the age.
    #[test]
    fn verdict_is_that_of_the_factor_of_the_age(
        y_m in -2.0f64..2.0,
        age in prop_oneof![Just(None), (0u32..70_000).prop_map(Some), any::<u32>().prop_map(Some),
            prop_oneof![Just(512u32), Just(513), Just(4992), Just(4993), Just(59_968), Just(59_969)].prop_map(Some)],
    ) {
        let plain = Source {
            trust: Trust { inflation: factor(defined(age)), ..Trust::FULL },
            ..MAP
        };
        prop_assert_eq!(verdict(aged(), y_m, age, SEE_T7), verdict(plain, y_m, None, SEE_T7));
    }
}

#[test]
fn an_older_fix_permits_less() {
    let permits = |y_m: f64, age| verdict(aged(), y_m, age, SEE_T7).is_ok();
    let ages = [Some(0), Some(4992), Some(59_968), Some(59_969), None];
    let farthest = ages.map(|age| {
        let steps = (0..200).take_while(|k| permits(0.01 * f64::from(*k), age));
        steps.count()
    });
    let falls = farthest.windows(2).all(|pair| pair[0] >= pair[1]);
    assert!(falls && farthest[0] > farthest[1] && farthest[2] > farthest[3]);
    assert_eq!(farthest[3], farthest[4]);
}

/// A damaged table in memory permits sets that the flash does not. The second evaluation detects this with the factor of every age.
#[test]
fn the_second_evaluation_uses_the_age() {
    let wide = wider();
    // Between the sets that the flash permits for an old fix and for a fresh fix.
    for (y_m, fresh, older) in [(1.25, 512, 4993), (1.0, 4992, 59_969)] {
        assert_eq!(verdict(aged(), y_m, Some(fresh), &wide), Ok(()), "{y_m}");
        let found = [Some(older), None].map(|age| verdict(aged(), y_m, age, &wide));
        assert!(found.iter().all(Result::is_err), "{y_m}: {found:?}");
    }
    let found = (0..200).map(|k| verdict(aged(), 0.01 * f64::from(k), Some(4993), &wide));
    let disagrees = found.filter(|found| *found == Err(Reason::EvaluationsDisagree));
    assert!(disagrees.count() > 20);
}

#[test]
fn factors_beyond_the_source_and_damaged_tables_are_refused() {
    let see_t7 = Table::parse(SEE_T7).unwrap();
    let check = |source: Source| {
        let sources = [source];
        let settings = Settings {
            sources: &sources,
            ..settings(&see_t7, 1)
        };
        Gate::new(SEE_T7, &settings, 900).err()
    };
    assert_eq!(check(aged()), None);
    let small = Trust {
        inflation: factor(99.0),
        ..Trust::FULL
    };
    let smaller = Source {
        trust: small,
        ..aged()
    };
    assert_eq!(check(smaller), Some(InvalidParameter::Aging));
}

/// A step that changes in memory is found in the next cycle.
#[test]
fn a_changed_table_of_ages_is_found() {
    let see_t7 = Table::parse(SEE_T7).unwrap();
    let [good, bad] = [512u32, 576].map(|until| {
        [Source {
            aging: Aging::new(&[(until, factor(1.0))]).unwrap(),
            ..aged()
        }]
    });
    let settings = Settings {
        sources: &good,
        ..settings(&see_t7, 1)
    };
    let changed = Settings {
        sources: &bad,
        ..settings
    };
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    gate.settings = &changed;
    let damaged = State::Latched(Reason::MemoryDamaged);
    assert_eq!(gate.tick(1020).state, damaged);
}

/// Without an age the examination, too, uses the source's own factor.
#[test]
fn an_examination_without_an_age_is_that_of_the_source() {
    let see_t7 = Table::parse(SEE_T7).unwrap();
    let sources = [aged()];
    let settings = Settings {
        sources: &sources,
        ..settings(&see_t7, 1)
    };
    let gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    let permits = |y_m: f64, since_fix_ms| {
        let report = report(1, y_m);
        let evidence = Evidence {
            since_fix_ms,
            ..Evidence::of(&report)
        };
        matches!(gate.examine_on(&evidence).1, Verdict::Permit { .. })
    };
    let differs = |y_m: &f64| permits(*y_m, Some(0)) && !permits(*y_m, None);
    let places = (0..200).map(|k| 0.01 * f64::from(k));
    assert!(places.filter(differs).count() > 10);
}
