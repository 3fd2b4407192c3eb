//! Plans without unnecessary looks, the bound for all chains, and plans on large sites.

use posegate::chain::StartAssumption;
use posegate_plan::{Options, PlanResult, Prepared, Status, StepKind, evaluate, plan_near};
use posegate_site::{ChainStep, Site};
use posegate_testkit::counts;
use posegate_testkit::planning_sites::{Drive, Random, hall};

/// A tag on a wall, a dock 1.5 m before it and a start 4 m before it. `views` places for each look.
fn dock_before_a_tag(views: u32) -> String {
    format!(
        "[camera.front]\nwidth_px = 640\nheight_px = 480\nfx = 615.0\nfy = 615.0\ncx = 320.0\ncy = 240.0\n\
         mount = {{ x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}\n\
         [planner]\nlook = {{ camera = \"front\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }}\n\
         r = [[0.03, 1.0]]\nviews = {views}\n\
         [navigation]\nmodel = {{ kind = \"bounded\", k_turn = 0.004, k_drift = 0.004, k_slip = 0.01 }}\n\
         controller = {{ translation = 0.005, yaw_deg = 0.2 }}\n\
         [tag.t1]\nid = 1\nfamily = \"tag36h11\"\nsize = 0.3\n\
         pose = {{ x = 0.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}\n\
         [task.dock]\nkind = \"work\"\ngoal = {{ x = 1.5, y = 0.2, yaw_deg = 185.0 }}\n\
         success = {{ shape = \"box\", x = [-0.12, 0.12], y = [-0.1, 0.1], yaw_deg = [-5.0, 5.0] }}\n\
         [chain.start]\n\
         start = {{ x = 4.0, y = -0.3, yaw_deg = 175.0, bounded = {{ translation = 0.25, yaw_deg = 3.0 }} }}\n"
    )
}

fn planned(site: &Site, from: &str, task: &str) -> PlanResult {
    let mut prepared = Prepared::of(site, Some(from)).expect("a library");
    let start = &site.chains[from].start;
    prepared
        .plan(start, task, &Options::default())
        .expect("an answer")
}

fn looks(planned: &PlanResult) -> usize {
    let steps = planned.plan.iter().flat_map(|plan| &plan.steps);
    steps
        .filter(|step| step.report.kind == StepKind::Localization)
        .count()
}

/// No place of the library allows a chain with one look: with these places the cheapest plan has two looks.
#[test]
fn unnecessary_look_is_omitted() {
    for views in [6, 12, 24] {
        let site = Site::parse(&dock_before_a_tag(views), "dock.toml").expect("a site");
        let found = planned(&site, "start", "dock");
        let plan = found.plan.as_ref().expect("a plan");
        assert_eq!(
            (found.status, looks(&found)),
            (Status::Optimal, 1),
            "{views}"
        );
        assert!(plan.report().succeeds());
        let margins = plan.steps.iter().filter_map(|step| step.report.margin);
        assert!(margins.into_iter().all(|margin| margin.q16() >= 1 << 16));
        // A look and the straight path; the work may also be done 0.12 m before the goal.
        let path = libm::hypot(4.0 - 1.5, 0.2 + 0.3);
        assert!(plan.cost < 1.005 * (1.0 + path), "{}", plan.cost);
        assert!(
            found.bound_of_all > 1.0 + path - 0.16,
            "{}",
            found.bound_of_all
        );
        assert!(found.gap().is_some_and(|gap| (0.0..0.05).contains(&gap)));
    }
}

/// Returns a site with random looks, a dock, a start and `count` random chains of up to three looks.
fn with_random_chains(random: &mut Random, count: usize) -> String {
    let model = if random.unit() < 0.3 {
        "model = { kind = \"gaussian\", a1 = 1e-5, a2 = 1e-6, a3 = 1e-5, a4 = 1e-6 }".to_owned()
    } else {
        format!(
            "model = {{ kind = \"bounded\", k_turn = {:?}, k_drift = {:?}, k_slip = {:?} }}",
            random.between(0.0, 0.006),
            random.between(0.0, 0.006),
            random.between(0.0, 0.015)
        )
    };
    let known = if random.unit() < 0.4 {
        let sigma = random.between(0.01, 0.06);
        let yaw = random.between(0.003, 0.012);
        // Correlated, so that a drive can make the position's own variance smaller.
        let shared = random.between(-0.9, 0.9) * sigma * yaw;
        format!(
            "covariance = [[{a:?}, 0.0, 0.0], [0.0, {a:?}, {shared:?}], [0.0, {shared:?}, {:?}]], epsilon = 0.99",
            yaw * yaw,
            a = sigma * sigma
        )
    } else {
        format!(
            "bounded = {{ translation = {:?}, yaw_deg = {:?} }}",
            random.between(0.02, 0.4),
            random.between(0.3, 3.0)
        )
    };
    let mut site = format!(
        "[camera.front]\nwidth_px = 640\nheight_px = 480\nfx = 615.0\nfy = 615.0\ncx = 320.0\ncy = 240.0\n\
         mount = {{ x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }}\n\
         [navigation]\n{model}\ncontroller = {{ translation = {:?}, yaw_deg = 0.1 }}\n\
         [task.dock]\nkind = \"work\"\ngoal = {{ x = 1.5, y = 0.2, yaw_deg = 180.0 }}\n\
         success = {{ shape = \"box\", x = [-{a:?}, {a:?}], y = [-{b:?}, {b:?}], yaw_deg = [-{w:?}, {w:?}] }}\n",
        random.between(0.0, 0.01),
        a = random.between(0.06, 0.3),
        b = random.between(0.06, 0.3),
        w = random.between(2.5, 9.0),
    );
    for (number, [y, yaw]) in [[0.0, 0.0], [1.5, -20.0]].into_iter().enumerate() {
        site += &format!(
            "[tag.t{number}]\nid = {number}\nfamily = \"tag36h11\"\nsize = 0.3\n\
             pose = {{ x = 0.0, y = {y:?}, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = {yaw:?} }}\n\
             [task.see-{number}]\nkind = \"localization\"\ngoal = {{ x = 1.5, y = 0.2, yaw_deg = 180.0 }}\n\
             success = {{ shape = \"visibility\", camera = \"front\", tag = \"t{number}\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }}\n\
             error_bound = {{ translation = {:?}, yaw_deg = {:?} }}\n",
            random.between(0.01, 0.05),
            random.between(0.3, 1.5)
        );
    }
    let begin = [
        random.between(2.0, 4.5),
        random.between(-0.6, 0.6),
        180.0 + random.between(-8.0, 8.0),
    ];
    let [x, y, yaw] = begin;
    let start = format!("start = {{ x = {x:?}, y = {y:?}, yaw_deg = {yaw:?}, {known} }}");
    for chain in 0..count {
        let (mut steps, mut at) = (vec![], begin);
        let mut drive = |to: [f64; 3], steps: &mut Vec<String>| {
            steps.push(format!("{{ navigate = [{at:?}, {to:?}], {model} }}"));
            at = to;
        };
        for _ in 0..chain % 4 {
            if random.unit() < 0.7 {
                let to = [
                    random.between(1.4, 4.0),
                    random.between(-0.4, 0.7),
                    180.0 + random.between(-6.0, 6.0),
                ];
                drive(to, &mut steps);
            }
            let look = usize::from(random.unit() < 0.2);
            steps.push(format!("{{ task = \"see-{look}\" }}"));
        }
        // Not always exactly to the goal.
        drive([1.5 + random.between(-0.05, 0.1), 0.2, 180.0], &mut steps);
        steps.push("{ task = \"dock\" }".into());
        site += &format!(
            "[chain.c{chain}]\n{start}\nsteps = [{}]\n",
            steps.join(", ")
        );
    }
    site
}

#[test]
fn no_proven_chain_costs_less_than_the_bound() {
    let mut proven = [0; 4];
    let mut tight = 0;
    let (sites, chains) = if counts::is_deep() { (60, 8) } else { (3, 4) };
    for seed in 0..sites {
        let text = with_random_chains(&mut Random(seed), chains);
        // The model of the site is that of all drives.
        let site =
            Site::parse(&text, "chains.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
        let found = planned(&site, "c0", "dock");
        let bound = found.bound_of_all;
        if let Some(plan) = &found.plan {
            assert!(
                plan.cost >= bound - 1e-9,
                "{} below {bound}: {text}",
                plan.cost
            );
            tight += usize::from(found.gap().is_some_and(|gap| gap < 0.1));
        }
        for (name, chain) in &site.chains {
            let report = evaluate(&site, name, chain, StartAssumption::General).expect("a report");
            if !report.succeeds() {
                continue;
            }
            let mut cost = 0.0;
            let mut at = [chain.start.pose.x, chain.start.pose.y];
            let mut looks = 0;
            for (step, report) in chain.steps.iter().zip(&report.steps) {
                match step {
                    ChainStep::Navigate { .. } => {
                        let to = report.after.pose;
                        cost += libm::hypot(to[0] - at[0], to[1] - at[1]);
                        at = [to[0], to[1]];
                    }
                    ChainStep::Task(_) if report.kind == StepKind::Localization => {
                        cost += 1.0;
                        looks += 1;
                    }
                    ChainStep::Task(_) => {}
                }
            }
            assert!(cost >= bound - 1e-9, "{name}: {cost} below {bound}: {text}");
            proven[looks] += 1;
        }
    }
    println!("proven chains by looks {proven:?}, plans within a tenth of the bound: {tight}");
    assert!(proven.iter().sum::<i32>() >= 2, "{proven:?}");
    assert!(tight >= 1, "{tight}");
    if counts::is_deep() {
        assert!(proven.iter().all(|count| *count >= 5), "{proven:?}");
    }
}

/// On a site with more looks than are prepared completely, a plan costs as much as with all of them.
#[test]
fn plans_near_the_path_cost_as_much_as_with_all_looks() {
    let mut plans = 0;
    let seeds = counts::one_a_day(&[0, 1, 2]);
    for seed in &seeds {
        let text = hall(&mut Random(*seed), 100, 8, Drive::Bounded);
        let site = Site::parse(&text, "hall.toml").expect("a site");
        let mut complete = Prepared::of(&site, None).expect("a library");
        for dock in 0..8 {
            let start = &site.chains[&format!("to{dock}")].start;
            let task = format!("dock{dock}");
            let options = Options::default();
            let all = complete.plan(start, &task, &options).expect("an answer");
            let near = plan_near(&site, None, start, &task, &options).expect("an answer");
            let cost = |found: &PlanResult| found.plan.as_ref().map(|plan| plan.cost);
            assert_eq!(near.status, all.status, "seed {seed}, {task}");
            assert_eq!(near.bound_of_all, all.bound_of_all, "seed {seed}, {task}");
            match (cost(&near), cost(&all)) {
                (Some(near), Some(all)) => {
                    assert!(
                        (near - all).abs() < 1e-3 * all,
                        "seed {seed}, {task}: {near}, {all}"
                    );
                    plans += 1;
                }
                (near, all) => assert_eq!(near, all, "seed {seed}, {task}"),
            }
        }
    }
    assert!(plans >= 4 * seeds.len(), "{plans}");
}

/// A tag whose region is near the path faces away, so the path to its viewpoints is long. A tag whose region is
/// farther away faces the robot and gives the cheaper plan. Dozens of tags beyond reach make the site too large to be
/// prepared completely.
#[test]
fn looks_near_the_path_do_not_hide_a_cheaper_plan_farther_away() {
    let mut text = String::from(
        r#"
[camera.front]
width_px = 640
height_px = 480
fx = 615.0
fy = 615.0
cx = 320.0
cy = 240.0
mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }
[confidence]
epsilon = 0.99
[planner]
look = { camera = "front", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }
r = [[0.02, 0.4]]
views = 4
range = 40.0
[navigation]
model = { kind = "bounded", k_turn = 0.0005, k_drift = 0.0005, k_slip = 0.001 }
controller = { translation = 0.005, yaw_deg = 0.2 }
[task.dock]
kind = "work"
goal = { x = 3.0, y = 0.0, yaw_deg = 0.0 }
success = { shape = "box", x = [-0.25, 0.25], y = [-0.25, 0.25], yaw_deg = [-8.0, 8.0] }
[chain.to]
start = { x = 0.0, y = 0.0, yaw_deg = 0.0, bounded = { translation = 0.3, yaw_deg = 1.5 } }
"#,
    );
    let near = [(1.5, 8.3), (1.5, -10.0)];
    let far = (0..70).map(|tag| (1000.0 + 6.0 * f64::from(tag), 0.0));
    for (id, (x, y)) in near.into_iter().chain(far).enumerate() {
        text += &format!(
            "[tag.t{id}]\nid = {id}\nfamily = \"tag36h11\"\nsize = 0.3\n\
             pose = {{ x = {x:?}, y = {y:?}, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 90.0 }}\n"
        );
    }
    let site = Site::parse(&text, "hall.toml").expect("a site");
    let start = &site.chains["to"].start;
    let found = plan_near(&site, None, start, "dock", &Options::default()).expect("an answer");
    let plan = found.plan.expect("a plan");
    let tags: Vec<&String> = plan.steps.iter().flat_map(|step| &step.tags).collect();
    assert_eq!(tags, ["t1"], "{}", plan.cost);
    assert!(plan.cost < 18.0, "{}", plan.cost);
}
