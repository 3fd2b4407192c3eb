//! Plans fail no more often than their stated risk. A judge that shares no code with the planner executes them with the
//! largest errors that the site allows, and the lower bound of the failure rate never exceeds the stated risk. Planners
//! that state too small a risk are detected.

use posegate::chain::StartAssumption;
use posegate::shape::Shape;
use posegate_plan::{Options, Prepared, Status, StepKind, evaluate};
use posegate_site::{ChainStart, DriveModel, Site, StartUncertainty};

use posegate_testkit::counts;
use posegate_testkit::judge;
use posegate_testkit::planning_sites as sites;

use judge::{Model, Robot, Set, Start, Step, least_rate, run};
use sites::{Drive, Random, hall};

fn robot(site: &Site) -> Robot {
    let model = match site.navigation.model.expect("a model") {
        DriveModel::Bounded(drift) => Model::Bounded([drift.k_turn, drift.k_drift, drift.k_slip]),
        DriveModel::Gaussian(noise) => Model::Gaussian([noise.a1, noise.a2, noise.a3, noise.a4]),
    };
    let controller = site.navigation.controller;
    Robot {
        model,
        controller: [controller.translation, controller.turn_deg.to_radians()],
    }
}

fn known(start: &ChainStart) -> Start {
    match start.known {
        StartUncertainty::Bounded {
            translation,
            yaw_deg,
        } => Start::Bounded([translation, yaw_deg.to_radians()]),
        StartUncertainty::Gaussian { covariance, .. } => {
            Start::Gaussian([0, 1, 2].map(|k| covariance[k][k].sqrt()))
        }
    }
}

fn begin(start: &ChainStart) -> [f64; 3] {
    [start.pose.x, start.pose.y, start.pose.yaw_deg.to_radians()]
}

/// Returns a work task's set, from the numbers of the site file.
fn dock(site: &Site, name: &str) -> Set {
    let task = &site.tasks[name];
    let Shape::Box(set) = &task.success.shape else {
        panic!("docks are boxes");
    };
    let goal = task.success.goal;
    Set::Box {
        goal: [goal.x, goal.y, goal.yaw_deg.to_radians()],
        x: set.x[1],
        y: set.y[1],
        yaw: set.yaw_deg[1].to_radians(),
    }
}

fn tag(site: &Site, name: &str) -> Set {
    let tag = &site.tags[name].tag;
    Set::Tag {
        pose: [
            tag.pose.x,
            tag.pose.y,
            tag.pose.z,
            tag.pose.yaw_deg.to_radians(),
        ],
        size: tag.size,
    }
}

/// Returns the steps of a plan for the judge.
fn steps(site: &Site, plan: &posegate_plan::Plan) -> Vec<Step> {
    plan.steps
        .iter()
        .map(|step| match step.report.kind {
            StepKind::Navigation => Step::Drive {
                to: step.report.after.pose,
            },
            StepKind::Work => Step::Work {
                set: dock(site, step.report.task.as_deref().expect("a task")),
            },
            StepKind::Localization => Step::Look {
                set: tag(site, &step.tags[0]),
                bound: step.report.after.certain,
                doubt: 0.0,
            },
        })
        .collect()
}

fn failures(seed: u64, runs: u64, start: &ChainStart, robot: &Robot, steps: &[Step]) -> u64 {
    let mut random = Random(seed);
    (0..runs)
        .filter(|_| run(&mut random, begin(start), known(start), robot, steps).is_some())
        .count() as u64
}

fn number(name: &str, default: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.map_or(default, |text| text.parse().expect("a number"))
}

/// At least 200 random sites and a million runs in all, in the deep job; a fifth of the sites in the fast suite.
#[test]
fn plans_fail_no_more_often_than_stated() {
    let fewer = if counts::is_deep() { 220 } else { 44 };
    let sites = number("POSEGATE_PLANNED_SITES", fewer);
    let runs = number("POSEGATE_PLAN_RUNS", 5_000);
    let (mut plans, mut executed, mut looks, mut rescues, mut none) = (0, 0, 0, 0, 0);
    for seed in 0..sites {
        let mut random = Random(seed);
        let drive = if seed % 3 == 2 {
            Drive::Gaussian
        } else {
            Drive::Bounded
        };
        let tags = 1 + (seed % 4) as usize;
        let text = hall(&mut random, tags, 1, drive);
        let site =
            Site::parse(&text, "hall.toml").unwrap_or_else(|error| panic!("{error}\n{text}"));
        let options = Options {
            survive_a_lost_tag: seed % 5 == 0,
            ..Options::default()
        };
        let mut prepared = Prepared::of(&site, None).unwrap();
        let start = &site.chains["to0"].start;
        let planned = prepared.plan(start, "dock0", &options).unwrap();
        let Some(plan) = &planned.plan else {
            assert_eq!(planned.status, Status::Infeasible, "{text}");
            assert!(
                planned.nearest.is_some_and(|miss| miss.scale < 1.0),
                "{text}"
            );
            none += 1;
            continue;
        };
        assert_eq!(planned.status, Status::Optimal);
        assert!(plan.report().succeeds(), "{text}");
        plans += 1;
        let robot = robot(&site);
        let mut ways = vec![(plan.risk, steps(&site, plan))];
        for other in &planned.contingencies {
            assert!(other.plan.report().succeeds(), "{text}");
            // The steps up to the failed look, then the plan without its tag.
            let mut path: Vec<Step> = steps(&site, plan)[..other.step].to_vec();
            let rest = steps(&site, &other.plan);
            assert!(
                other
                    .plan
                    .steps
                    .iter()
                    .all(|step| step.tags.iter().all(|tag| !other.tags.contains(tag)))
            );
            path.extend(rest);
            let before: f64 = plan.steps[..other.step]
                .iter()
                .map(|step| step.report.risk)
                .sum();
            assert!((before - other.risk_before).abs() < 1e-12);
            ways.push((before + other.plan.risk, path));
            rescues += 1;
        }
        for (risk, path) in ways {
            looks += path
                .iter()
                .filter(|step| matches!(step, Step::Look { .. }))
                .count();
            let failed = failures(seed, runs, start, &robot, &path);
            executed += runs;
            assert!(
                least_rate(failed, runs) <= risk,
                "{failed} of {runs} runs failed, promised {risk}:\n{text}\n{path:?}"
            );
        }
    }
    println!(
        "{{\"name\": \"planning: plans executed, no promise broken\", \"value\": {plans}, \"unit\": \"plans\", \"runs\": {executed}, \
         \"looks\": {looks}, \"rescues\": {rescues}, \"without a plan\": {none}, \"goal\": null}}"
    );
    assert!(plans * 2 > sites, "{plans} plans, {none} without");
    assert!(sites < 200 || executed >= 1_000_000, "{executed}");
    assert!(sites < 200 || rescues >= 5, "{rescues}");
}

/// The judge detects that a chain with the paper's assumption, the estimate at each task's goal, fails too often.
#[test]
fn ignored_recentring_is_detected() {
    let site = Site::parse(
        &format!(
            "{}[task.dock]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\n\
             success = {{ shape = \"box\", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }}\n\
             [chain.now]\nstart = {{ x = 0.0, y = 0.0, yaw_deg = 0.0, bounded = {{ translation = 0.5, yaw_deg = 2.0 }} }}\n\
             steps = [{{ task = \"see\" }}, {{ task = \"dock\" }}]\n",
            LOOK
        ),
        "site.toml",
    )
    .unwrap();
    let chain = &site.chains["now"];
    let evaluated = |assume| evaluate(&site, "now", chain, assume).unwrap();
    assert!(evaluated(StartAssumption::AtGoal).succeeds());
    assert!(!evaluated(StartAssumption::General).succeeds());
    let steps = [
        Step::Look {
            set: tag(&site, "t"),
            bound: [0.05, 2f64.to_radians()],
            doubt: 0.0,
        },
        Step::Work {
            set: dock(&site, "dock"),
        },
    ];
    let robot = Robot {
        model: Model::Bounded([0.0; 3]),
        controller: [0.0; 2],
    };
    let failed = failures(1, 10_000, &chain.start, &robot, &steps);
    assert!(
        least_rate(failed, 10_000) > evaluated(StartAssumption::AtGoal).risk,
        "{failed}"
    );
}

const LOOK: &str = "[camera.front]\nwidth_px = 640\nheight_px = 480\nfx = 615.0\nfy = 615.0\ncx = 320.0\ncy = 240.0\n\
    mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n\
    [tag.t]\nid = 7\nfamily = \"tag36h11\"\nsize = 0.30\n\
    pose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }\n\
    [task.see]\nkind = \"localization\"\ngoal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }\n\
    success = { shape = \"visibility\", camera = \"front\", tag = \"t\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }\n\
    error_bound = { translation = 0.05, yaw_deg = 2.0, coverage = 0.9 }\n";

/// Each look fails with probability 1/10, and two looks never fail in one run. The sum of the risks bounds the
/// failure rate. A product, which assumes independence, does not.
#[test]
fn product_of_risks_is_detected() {
    let looks = 6;
    let steps: Vec<&str> = std::iter::repeat_n("{ task = \"see\" }", looks).collect();
    let site = Site::parse(
        &format!(
            "{LOOK}[chain.many]\nstart = {{ x = 0.0, y = 0.0, yaw_deg = 0.0, bounded = {{ translation = 0.02, yaw_deg = 0.2 }} }}\n\
             steps = [{}]\n",
            steps.join(", ")
        ),
        "site.toml",
    )
    .unwrap();
    let chain = &site.chains["many"];
    let report = evaluate(&site, "many", chain, StartAssumption::AtGoal).unwrap();
    assert!(report.succeeds());
    let product = 1.0
        - report
            .steps
            .iter()
            .map(|step| 1.0 - step.risk)
            .product::<f64>();
    assert!(
        (report.risk - 0.6).abs() < 1e-9 && product < 0.47,
        "{} {product}",
        report.risk
    );
    let robot = Robot {
        model: Model::Bounded([0.0; 3]),
        controller: [0.0; 2],
    };
    let steps: Vec<Step> = (0..looks)
        .map(|_| Step::Look {
            set: tag(&site, "t"),
            bound: [1e-3, 1e-3],
            doubt: 0.1,
        })
        .collect();
    let failed = failures(1, 20_000, &chain.start, &robot, &steps);
    let rate = least_rate(failed, 20_000);
    assert!(rate <= report.risk && rate > product, "{rate}");
}
