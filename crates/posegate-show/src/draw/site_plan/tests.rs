use super::*;

const DOCK: &str = include_str!("../../../../../examples/sites/dock.toml");

fn plan(task: &str, found: Result<MergedRoute, String>) -> MergedPlan {
    MergedPlan {
        from: "gate".into(),
        task: task.into(),
        found,
    }
}

fn route(worst_margin: f64) -> MergedRoute {
    MergedRoute {
        route: Route { steps: Vec::new() },
        cost: 4.8867,
        worst_margin: Some(worst_margin),
    }
}

#[test]
fn plan_without_margins_states_its_cost_only() {
    let found = MergedRoute {
        worst_margin: None,
        ..route(1.0)
    };
    let site = Site::parse(DOCK, "dock.toml").unwrap();
    let svg = site_routes_picture(&site, &[plan("dock-1", Ok(found))]);
    assert!(svg.contains(">dock-1 from gate: cost 4.887<"), "{svg}");
}

#[test]
fn picture_states_margin_and_cost_or_the_reason() {
    let site = Site::parse(DOCK, "dock.toml").unwrap();
    let plans = [
        plan("dock-1", Ok(route(1.0899))),
        plan("dock-3", Ok(route(1.0012))),
        plan("dock-2", Err("no chain arrives at the work task".into())),
    ];
    let svg = site_routes_picture(&site, &plans);
    // Rounded down, and the failure first.
    let good = svg.find(">dock-1 from gate: worst margin 1.08, cost 4.887<");
    let bad = svg.find(">dock-2 from gate: NO PLAN: no chain arrives at the work task<");
    assert!(bad.unwrap() < good.unwrap(), "{svg}");
    assert!(svg.contains(">The site: 2 of 3 plans found<"), "{svg}");
    assert!(
        svg.contains(">dock-3 from gate: worst margin 1.00, cost 4.887, little slack<")
            && svg.contains(">little slack: this plan holds for hardly larger errors"),
        "{svg}"
    );
    assert!(
        svg.contains(">costs are in the unit of the site file: 1 a metre, 1 a look<"),
        "{svg}"
    );
    let none = site_routes_picture(&site, &[]);
    assert!(
        none.contains(">The site: it was built without plans<"),
        "{none}"
    );
}

#[test]
fn long_lists_of_plans_end_with_their_number() {
    let mut plans: Vec<MergedPlan> = (0..100)
        .map(|number| plan(&format!("dock-{number}"), Ok(route(1.2))))
        .collect();
    plans.extend((0..2).map(|number| plan(&format!("bay-{number}"), Err("why".into()))));
    let site = Site::parse(DOCK, "dock.toml").unwrap();
    let notes = notes(&site, &plans);
    assert_eq!(notes.len(), PLANS + 2);
    assert!(!notes[0].1 && !notes[1].1 && notes[2].1);
    assert_eq!(
        notes[PLANS].0,
        "and 42 more plans, of which 0 are not found"
    );
}

#[test]
fn lines_are_broken_between_words() {
    let text = "infeasible: no chain of the library is certain to succeed; ".repeat(4);
    let lines = wrapped(text.trim_end(), 300.0);
    assert!(lines.len() > 3);
    assert_eq!(lines.join(" "), text.trim_end());
    assert!(
        lines
            .iter()
            .all(|line| text_width(line, SIZE, false) <= 300.0)
    );
}
