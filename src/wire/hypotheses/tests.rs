use super::*;
use crate::set::{Estimate, Uncertainty};
use proptest::prelude::*;
use std::vec::Vec as Bodies;

fn report(sequence: u32, x_m: f64) -> Report {
    let estimate = Estimate {
        x_m,
        y_m: 0.0,
        yaw_rad: 0.0,
    };
    let bounded = Uncertainty::Bounded {
        translation_m: 0.1,
        yaw_rad: 0.1,
    };
    Report {
        source: 1,
        frame: FrameId::of("map"),
        sequence,
        stamp_ms: 10 * sequence,
        belief: PoseEstimate::new(estimate, bounded),
    }
}

/// The messages of a report with hypotheses at 1 m, 2 m and so on.
fn messages(sequence: u32, others: u8) -> Bodies<Vec<u8, LONGEST_BODY>> {
    let report = |x: u8| report(sequence, f64::from(x));
    let mut bodies: Bodies<_> = (1..=others)
        .map(|number| hypothesis_body(number, &report(number)).unwrap())
        .collect();
    bodies.push(match others {
        0 => super::super::report_body(&report(0)),
        others => counted_report_body(others, &report(0)).unwrap(),
    });
    bodies
}

#[test]
fn hypotheses_round_trip_with_their_report() {
    let mut collector = HypothesisCollector::new();
    for others in [0, 1, 7, 3, 0] {
        let sequence = 40 + u32::from(others);
        let bodies = messages(sequence, others);
        let (last, first) = bodies.split_last().unwrap();
        for body in first {
            assert!(matches!(collector.take(body), Ok(None)));
        }
        let evidence = collector.take(last).unwrap().unwrap();
        assert_eq!(*evidence.report, report(sequence, 0.0));
        let expected: Bodies<PoseEstimate> = (1..=others)
            .map(|number| report(sequence, f64::from(number)).belief)
            .collect();
        assert_eq!(evidence.others, expected);
        assert_eq!(evidence.beside, Growth::NONE);
    }
    assert!(hypothesis_body(0, &report(1, 0.0)).is_none());
    assert!(counted_report_body(8, &report(1, 0.0)).is_none());
}

proptest! {
    /// Whatever is lost, doubled or reordered: a report that is returned has all of its hypotheses.
    #[test]
    fn returned_report_has_all_its_hypotheses(
        counts in prop::collection::vec(0u8..=7, 1..6),
        order in prop::collection::vec(any::<prop::sample::Index>(), 1..40),
        keep_order: bool,
    ) {
        let sent: Bodies<_> = (1u32..).zip(&counts).flat_map(|(k, count)| messages(k, *count)).collect();
        let mut picked: Bodies<usize> = order.iter().map(|at| at.index(sent.len())).collect();
        if keep_order {
            picked.sort_unstable();
            picked.dedup();
        }
        let mut collector = HypothesisCollector::new();
        for at in picked {
            if let Ok(Some(evidence)) = collector.take(&sent[at]) {
                let sequence = evidence.report.sequence;
                let count = counts[sequence as usize - 1];
                let places: Bodies<f64> = evidence.others.iter().map(|other| other.x_m).collect();
                let expected: Bodies<f64> = (1..=count).map(f64::from).collect();
                prop_assert_eq!(places, expected);
            }
        }
    }

    #[test]
    fn collected_report_re_encodes_to_its_body(body in prop::collection::vec(any::<u8>(), 0..160)) {
        let mut collector = HypothesisCollector::new();
        if let Ok(Some(evidence)) = collector.take(&body) {
            prop_assert_eq!(&super::super::report_body(evidence.report)[..], &body[..]);
        }
    }
}
