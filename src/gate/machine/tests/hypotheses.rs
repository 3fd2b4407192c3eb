//! Reports with several hypotheses and with slip: both evaluations decide on each.

use super::*;
use crate::set::Growth;

/// An estimate at `y_m` to the side of the goal.
fn at(y_m: f64) -> PoseEstimate {
    report(0, y_m).belief
}

fn evidence<'r>(report: &'r Report, others: &'r [PoseEstimate], beside: Growth) -> Evidence<'r> {
    Evidence {
        report,
        others,
        beside,
        since_fix_ms: None,
        elsewhere: Risk::NONE,
    }
}

/// Inside of the wider table only.
const BEYOND_M: f64 = 1.9;

#[test]
fn every_hypothesis_must_be_inside() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let step = |others: &[PoseEstimate], beside| {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let step = gate.step_on(1010, &evidence(&report(1, 0.0), others, beside));
        assert_eq!(step.permission.is_permit(), step.verdict.is_ok());
        step.verdict
    };
    let good = [at(0.0); 8];
    for count in 0..=7 {
        assert_eq!(step(&good[..count], Growth::NONE), Ok(()), "{count}");
    }
    let too_many = Err(Reason::TooManyHypotheses);
    assert_eq!(step(&good, Growth::NONE), too_many);
    assert_eq!(step(&[at(BEYOND_M); 8], Growth::NONE), too_many);
    for outside in 0..7 {
        let mut others = [at(0.0); 7];
        others[outside] = at(BEYOND_M);
        let denied = Err(Reason::NotContained);
        assert_eq!(step(&others, Growth::NONE), denied, "{outside}");
        others[outside].spread = None;
        let denied = Err(Reason::CovarianceUnknown);
        assert_eq!(step(&others, Growth::NONE), denied, "{outside}");
    }
    let metres = |metres: f64| Growth::of(metres, 0.0).unwrap();
    assert_eq!(step(&[], metres(0.3)), Ok(()));
    assert_eq!(step(&[], metres(1.9)), Err(Reason::NotContained));
    assert_eq!(step(&[at(1.0)], metres(0.9)), Err(Reason::NotContained));
}

/// The examination names the denied hypothesis, or the one with the least margin.
#[test]
fn the_examination_names_a_hypothesis() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
    let _ = gate.tick(1010);
    let first = report(1, 0.0);
    let examine =
        |others: &[PoseEstimate]| gate.examine_on(&evidence(&first, others, Growth::NONE));
    let is_denied = |verdict: &Verdict| matches!(verdict, Verdict::Deny { .. });
    assert_eq!(examine(&[]), (0, gate.examine(&first)));
    let (number, verdict) = examine(&[at(0.1), at(BEYOND_M), at(0.2)]);
    assert!(number == 2 && is_denied(&verdict), "{number} {verdict:?}");
    let (number, verdict) = examine(&[at(0.1), at(0.9), at(0.2)]);
    assert!(number == 2 && !is_denied(&verdict), "{number} {verdict:?}");
    assert_eq!(verdict, gate.examine(&report(1, 0.9)));
    let slip = Growth::of(1.9, 0.0).unwrap();
    let (_, verdict) = gate.examine_on(&evidence(&first, &[], slip));
    assert!(is_denied(&verdict), "{verdict:?}");
    let (_, verdict) = examine(&[at(0.0); 8]);
    assert_eq!(verdict, Verdict::deny(Reason::TooManyHypotheses));
}

/// A damaged table in memory permits sets that the flash does not: the second evaluation detects this in each hypothesis, and in the
/// movement.
#[test]
fn the_second_evaluation_decides_on_each_hypothesis_and_movement() {
    let table = Table::parse(SEE_T7).unwrap();
    let wide = wider();
    let with = |settings: &Settings<'_>, others: &[PoseEstimate], beside| {
        let mut gate = Gate::new(SEE_T7, settings, 900).unwrap();
        gate.table = Ok(Table::parse(&wide).unwrap());
        let step = gate.step_on(1010, &evidence(&report(1, 0.0), others, beside));
        step.verdict
    };
    let still = settings(&table, 1);
    let disagree = Err(Reason::EvaluationsDisagree);
    assert_eq!(with(&still, &[at(0.0); 7], Growth::NONE), Ok(()));
    for outside in 0..7 {
        let mut others = [at(0.0); 7];
        others[outside] = at(BEYOND_M);
        assert_eq!(with(&still, &others, Growth::NONE), disagree, "{outside}");
    }
    // Slip.
    let slip = Growth::of(1.75, 0.0).unwrap();
    assert_eq!(with(&still, &[], slip), disagree);
    // The robot's own movement: from its stamp at 1010 ms the permission ends 50 ms later.
    let moves = |metres_per_s: u32| {
        [Source {
            motion: MotionBounds::of_mm_mrad(1000 * metres_per_s, 0, 0),
            ..MAP
        }]
    };
    let slow = moves(1);
    let slow = Settings {
        sources: &slow,
        ..still
    };
    assert_eq!(with(&slow, &[], Growth::NONE), Ok(()));
    let fast = moves(35);
    let fast = Settings {
        sources: &fast,
        ..still
    };
    assert_eq!(with(&fast, &[], Growth::NONE), disagree);
}

/// Omitted hypotheses make the sets larger, in both evaluations.
#[test]
fn what_is_left_out_counts() {
    let table = Table::parse(SEE_T7).unwrap();
    let settings = settings(&table, 1);
    let risk = |confidence| Risk::from_confidence(confidence).unwrap();
    // A set that is inside with a margin of a few percent.
    let mut wide = report(1, 0.0);
    let spread = |sigma: f64| {
        let square = sigma * sigma;
        Some(Uncertainty::Gaussian([
            [square, 0.0, 0.0],
            [0.0, square, 0.0],
            [0.0, 0.0, 1e-5],
        ]))
    };
    let margin_of = |report: &Report, elsewhere| {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let _ = gate.tick(1010);
        let evidence = Evidence {
            since_fix_ms: None,
            elsewhere,
            ..evidence(report, &[], Growth::NONE)
        };
        match gate.examine_on(&evidence).1 {
            Verdict::Permit { margin } => f64::from(margin.q16()) / 65_536.0,
            Verdict::Deny { margin, .. } => margin.map_or(0.0, |m| f64::from(m.q16()) / 65_536.0),
        }
    };
    wide.belief.spread = spread(0.1);
    let alone = margin_of(&wide, Risk::NONE);
    wide.belief.spread = spread(0.1 * alone / 1.02);
    let (alone, with) = (margin_of(&wide, Risk::NONE), margin_of(&wide, risk(0.995)));
    assert!(alone > 1.0 && with < 1.0 && with > 0.85, "{alone} {with}");
    assert_eq!(margin_of(&wide, risk(0.98)), 0.0);
    let step = |table: &[u8], elsewhere| {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        gate.table = Ok(Table::parse(table).unwrap());
        let evidence = Evidence {
            since_fix_ms: None,
            elsewhere,
            ..evidence(&wide, &[], Growth::NONE)
        };
        gate.step_on(1010, &evidence).verdict
    };
    assert_eq!(step(SEE_T7, Risk::NONE), Ok(()));
    assert_eq!(step(SEE_T7, risk(0.995)), Err(Reason::NotContained));
    assert_eq!(step(SEE_T7, risk(0.98)), Err(Reason::ElsewhereTooLikely));
    // A bound has no distribution, and slip is not part of the sets.
    let mut bounded = at(0.0);
    bounded.spread = Some(Uncertainty::Bounded {
        translation_m: 0.01,
        yaw_rad: 0.01,
    });
    let little = report(1, 0.0);
    let slip = Growth::new(1, 0);
    for (others, beside, elsewhere, expected) in [
        (&[bounded][..], Growth::NONE, Risk::NONE, Ok(())),
        (&[], slip, Risk::NONE, Ok(())),
        (&[at(0.0)], Growth::NONE, risk(0.999), Ok(())),
        (
            &[bounded],
            Growth::NONE,
            risk(0.999),
            Err(Reason::ElsewhereTooLikely),
        ),
        (&[], slip, risk(0.999), Err(Reason::ElsewhereTooLikely)),
    ] {
        let mut gate = Gate::new(SEE_T7, &settings, 900).unwrap();
        let evidence = Evidence {
            since_fix_ms: None,
            elsewhere,
            ..evidence(&little, others, beside)
        };
        let examined = gate.examine_on(&evidence).1;
        let is_denied = examined == Verdict::deny(Reason::ElsewhereTooLikely);
        assert_eq!(is_denied, expected.is_err(), "{examined:?}");
        assert_eq!(gate.step_on(1010, &evidence).verdict, expected);
    }
    let larger = wider();
    assert_eq!(step(&larger, Risk::NONE), Ok(()));
    let disagree = Err(Reason::EvaluationsDisagree);
    assert_eq!(step(&larger, risk(0.995)), disagree);
}
