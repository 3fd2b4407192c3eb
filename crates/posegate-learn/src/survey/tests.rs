use super::*;

#[test]
fn displacement_of_a_tag_is_recovered() {
    let residual = |difference| Residual {
        run: String::new(),
        dock: String::new(),
        tag: String::new(),
        difference,
        lever: [-1.5, 0.4],
    };
    let tag = Vector3::new(0.02, -0.01, 0.03);
    let effect = residual(Vector3::zeros()).by_tag(tag);
    assert!((residual(effect).of_tag() - tag).norm() < 1e-15);
    // A tag 2 m ahead, turned by 0.01 rad to the left. The robot uses the unturned tag, so it seems to be turned
    // to the right about the tag: 2 cm to the left.
    let ahead = Residual {
        lever: [-2.0, 0.0],
        ..residual(Vector3::zeros())
    };
    let effect = ahead.by_tag(Vector3::new(0.0, 0.0, 0.01));
    assert!(
        (effect - Vector3::new(0.0, 0.02, -0.01)).norm() < 1e-12,
        "{effect}"
    );
}

/// A site in which each name is a dock and a tag.
fn site(names: &[&str]) -> SurveyedSite {
    SurveyedSite {
        docks: names
            .iter()
            .map(|name| ((*name).into(), [0.0; 3]))
            .collect(),
        tags: names
            .iter()
            .map(|name| ((*name).into(), [1.0, 0.5]))
            .collect(),
    }
}

/// Dockings at a dock by a tag, numbered from 0, with the error that `pose` computes from three numbers around 0.
fn dockings(dock: &str, tag: &str, count: u64, pose: impl Fn([f64; 3]) -> [f64; 3]) -> Vec<Look> {
    let mut random = 7u64;
    let mut number = || {
        random = crate::random::mixed(random);
        (random >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let look = |docking: u64| Look {
        run: docking.to_string(),
        dock: dock.into(),
        tag: tag.into(),
        pose: pose([number(), number(), number()]),
    };
    (0..count).map(look).collect()
}

#[test]
fn looks_without_scatter_give_no_result() {
    let site = site(&["a"]);
    for count in 5..20 {
        for value in [0.0, 1e-3, 0.0123, 0.1, 0.3, -2.7, 1000.1] {
            let constant = |_: [f64; 3]| [value; 3];
            let in_x = |[_, y, yaw]: [f64; 3]| [value, 0.01 * y, 0.01 * yaw];
            let in_yaw = |[x, y, _]: [f64; 3]| [0.01 * x, 0.01 * y, value];
            let following = |[x, y, _]: [f64; 3]| [0.01 * x, 0.01 * y, 0.3 * x + 0.2 * y + value];
            for looks in [
                dockings("a", "a", count, constant),
                dockings("a", "a", count, in_x),
                dockings("a", "a", count, in_yaw),
                dockings("a", "a", count, following),
            ] {
                for report in survey(&looks, &site, 0.99).unwrap() {
                    let result = (report.significance, report.stale, report.region);
                    assert_eq!(result, (0.0, false, None), "{count} of {value}: {report:?}");
                    assert!(report.offset.is_some());
                }
            }
        }
    }
    // A thousandth of a millimetre is a scatter.
    let looks = dockings("a", "a", 6, |numbers| {
        numbers.map(|number| 0.02 + 1e-6 * number)
    });
    let found = survey(&looks, &site, 0.99).unwrap();
    assert!(found.iter().any(|report| report.stale), "{found:?}");
    assert!(found.iter().all(|report| report.region.is_some()));
}

#[test]
fn dock_and_tag_of_one_name_are_reported_together() {
    let looks = dockings("a", "a", 12, |numbers| {
        numbers.map(|number| 0.03 + 0.01 * number)
    });
    let found = survey(&looks, &site(&["a"]), 0.99).unwrap();
    let stale: Vec<&OffsetReport> = found.iter().filter(|report| report.stale).collect();
    assert_eq!(stale.len(), 1);
    assert_eq!(stale[0].kind, Surveyed::Dock);
    assert_eq!(stale[0].or, [(Surveyed::Tag, "a".to_owned())]);
}

#[test]
fn dockings_of_different_docks_are_distinguished_by_dock() {
    let small = |numbers: [f64; 3]| numbers.map(|number| 0.01 * number);
    let mut looks = dockings("a", "b", 6, small);
    looks.extend(dockings("b", "b", 7, small));
    // Two looks of one docking are one.
    looks.extend(dockings("b", "b", 3, small));
    let found = survey(&looks, &site(&["a", "b"]), 0.99).unwrap();
    let counted = found
        .iter()
        .map(|report| (report.kind, report.name.as_str(), report.dockings));
    assert_eq!(
        counted.collect::<Vec<_>>(),
        [
            (Surveyed::Dock, "a", 6),
            (Surveyed::Dock, "b", 7),
            (Surveyed::Tag, "b", 13)
        ]
    );
}
