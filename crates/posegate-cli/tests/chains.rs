//! `posegate chain` and `posegate plan`: the contract of the command line, and the message for each bad input.

use posegate_testkit::counts;
use posegate_testkit::run::Case;
use serde_json::Value;

const PAPER: &str = include_str!("../../../examples/sites/paper-chain.toml");

/// Runs a line in a folder with this site file. Returns the exit code, stdout, the words of stderr and the folder.
fn run(site: &str, line: &str) -> (i32, String, String, Case) {
    let folder = Case::new(&[("site.toml", site.as_bytes())]);
    let ended = folder.run(line);
    let words = ended.words();
    (ended.code, ended.out, words, folder)
}

fn json(site: &str, line: &str, code: i32) -> Value {
    Case::new(&[("site.toml", site.as_bytes())]).json(code, line)
}

fn changed(from: &str, to: &str) -> String {
    assert!(PAPER.contains(from), "{from}");
    PAPER.replace(from, to)
}

/// A plan does not check for collisions. A path through a wall is reported, so that "succeeds" is not read as "drives there".
#[test]
fn path_through_a_wall_is_reported() {
    let line = "plan site.toml --from back-to-dock --to dock";
    let block = |y: f64| {
        // It is too low to hide the tag.
        let [low, high] = [y - 0.1, y + 0.1];
        format!(
            "{PAPER}\n[wall.pillar]\ncorners = [[0.6, {low}], [0.8, {low}], [0.8, {high}], [0.6, {high}]]\nz = [0.0, 0.2]\n"
        )
    };
    for (y, crosses) in [(0.1, true), (-0.6, false)] {
        let (code, out, err, _) = run(&block(y), line);
        assert_eq!(code, 0, "{out}{err}");
        let reported = err.contains("the straight way of step 2 crosses `pillar`");
        assert_eq!(reported, crosses, "{err}");
    }
}

const DOCKS: &str = include_str!("../../../examples/sites/docks.toml");

/// A plan whose worst margin is hardly above 1 says so and names the remedy, and the remedy works.
#[test]
fn little_slack_is_reported_with_the_key_that_reserves_some() {
    let folder = Case::new(&[]);
    let posegate = |line: &str| {
        let ended = folder.run(line);
        (ended.code, ended.out)
    };
    let write = |name: &str, text: &str| folder.write(name, text);
    write("docks.toml", DOCKS);
    let line = "cover docks.toml --survive-lost-tags 1 -o with-tags.toml";
    let (code, out) = posegate(line);
    assert_eq!(code, 0, "{out}");
    let advice = ": this plan holds for hardly larger errors than stated: write `least_margin = 1.1` under [planner]";
    let said = |out: &str| out.lines().filter(|line| line.contains(advice)).count();
    let (code, plan) = posegate("plan with-tags.toml --to dock-2");
    assert_eq!((code, said(&plan)), (0, 1), "{plan}");
    assert!(plan.contains("worst margin 1.00 at step "), "{plan}");
    assert!(plan.contains(" (1 a metre, 1 a look), "), "{plan}");
    let (_, plan) = posegate("plan with-tags.toml --to dock-3");
    assert_eq!(said(&plan), 0, "{plan}");
    // A cover names the task with the worst margin of all.
    let (code, out) = posegate("cover docks.toml");
    assert_eq!((code, said(&out)), (0, 1), "{out}");
    let named = out.lines().find(|line| line.contains(advice)).unwrap();
    assert!(
        named.starts_with("worst margin 1.0") && named.contains(" to dock-"),
        "{named}"
    );

    let with = |text: &str, least: &str| {
        let head = format!("[planner]\nleast_margin = {least}\n");
        text.replacen("[planner]\n", &head, 1)
    };
    // A plan with more slack also holds for less, so plans with less are not more expensive: the library's places alone give 6.597
    // below 1.4.
    let tags = folder.text("with-tags.toml");
    let costs = ["1.02", "1.1", "1.3", "1.5"].map(|least| {
        write("slack.toml", &with(&tags, least));
        let (code, out) = posegate("plan slack.toml --to dock-2 --json");
        assert_eq!(code, 0, "{least}: {out}");
        let plan: Value = serde_json::from_str(&out).unwrap();
        let limit: f64 = least.parse().unwrap();
        let others = plan["contingencies"].as_array().unwrap().iter();
        for plan in others.chain([&plan]) {
            let steps = plan["steps"].as_array().unwrap().iter();
            let mut margins = steps.filter_map(|step| step["margin"].as_f64());
            assert!(
                margins.all(|margin| margin >= limit - 1e-4),
                "{least}: {plan}"
            );
        }
        plan["cost"].as_f64().unwrap()
    });
    // The unit of the cost is the user's.
    let large = with(&tags, "1.5").replacen(
        "[planner]\n",
        "[planner]\nmetre = 100000000.0\nlook_cost = 100000000.0\n",
        1,
    );
    write("large.toml", &large);
    let (_, out) = posegate("plan large.toml --to dock-2 --json");
    let plan: Value = serde_json::from_str(&out).unwrap();
    let cost = 1e-8 * plan["cost"].as_f64().unwrap();
    assert!((cost - costs[3]).abs() < 1e-6 * cost, "{cost} {costs:?}");

    let most = 1.01 * costs[3];
    assert!(costs.iter().all(|cost| *cost <= most), "{costs:?}");

    write("reserved.toml", &with(DOCKS, "1.1"));
    let (code, out) = posegate("cover reserved.toml --survive-lost-tags 1 -o more-tags.toml");
    assert_eq!((code, said(&out)), (0, 0), "{out}");
    for task in ["dock-1", "dock-2", "dock-3"] {
        let (code, out) = posegate(&format!("plan more-tags.toml --to {task} --json"));
        assert_eq!(code, 0, "{out}");
        let plan: Value = serde_json::from_str(&out).unwrap();
        let plans = plan["contingencies"]
            .as_array()
            .unwrap()
            .iter()
            .chain([&plan]);
        for plan in plans {
            let steps = plan["steps"].as_array().unwrap().iter();
            let margins: Vec<f64> = steps.filter_map(|step| step["margin"].as_f64()).collect();
            assert!(margins.len() >= 2, "{plan}");
            assert!(margins.iter().all(|margin| *margin >= 1.1), "{margins:?}");
        }
    }
    // No plan has so much slack: the nearest miss names the key. A margin below 1 is refused.
    write("too-much.toml", &with(DOCKS, "7.5"));
    let (code, out) = posegate("cover too-much.toml");
    assert_eq!(code, 1, "{out}");
    let paper = format!("{PAPER}\n[planner]\nleast_margin = 4.0\n");
    let (code, out, _, _) = run(&paper, "plan site.toml --from back-to-dock --to dock");
    assert_eq!(code, 1, "{out}");
    assert!(
        out.contains("times as large would fit, and the site's `least_margin` is 4"),
        "{out}"
    );
    let (code, _, err, _) = run(&with(DOCKS, "0.9"), "check site.toml");
    assert_eq!(code, 2);
    assert!(
        err.contains("least_margin") && err.contains("from 1 to 8"),
        "{err}"
    );
}

#[test]
fn chain_reports_every_step() {
    let line = "chain site.toml --name back-to-dock --json";
    let chain = json(PAPER, line, 0);
    assert_eq!(
        (&chain["success"], &chain["assume"]),
        (&true.into(), &"general".into())
    );
    assert_eq!(chain["risk"], 0.0);
    let steps = chain["steps"].as_array().unwrap();
    let types: Vec<_> = steps
        .iter()
        .map(|step| step["type"].as_str().unwrap())
        .collect();
    assert_eq!(
        types,
        [
            "localization",
            "navigation",
            "localization",
            "navigation",
            "work"
        ]
    );
    for step in steps {
        let task = step["type"] != "navigation";
        assert_eq!(step.get("contained").is_some(), task);
        assert_eq!(step.get("margin").is_some(), task);
        assert!(step["translation"].as_f64().unwrap() > 0.0);
        if task {
            assert!(
                step["contained"].as_bool().unwrap() && step["margin"].as_f64().unwrap() >= 1.0
            );
        }
    }
    assert_eq!(steps[0]["translation"], 0.05);
    assert!((steps[0]["yaw_rad"].as_f64().unwrap() - 2f64.to_radians()).abs() < 1e-15);
    // The estimate is within the previous set, enlarged by r_l.
    let spread = steps[0]["spread"]["translation"].as_f64().unwrap();
    assert!((spread - 1.05).abs() < 1e-12);
    // With the paper's assumption the first drive adds less.
    let paper = json(PAPER, &format!("{line} --assume at-goal"), 0);
    let grown = |chain: &Value| chain["steps"][1]["translation"].as_f64().unwrap();
    assert!(grown(&paper) < grown(&chain));
}

#[test]
fn failed_step_is_reported_with_its_number() {
    let site = changed(
        "translation = 1.0, yaw_deg = 2.0",
        "translation = 1.5, yaw_deg = 2.0",
    );
    let chain = json(&site, "chain site.toml --name back-to-dock --json", 1);
    assert_eq!(
        (&chain["success"], &chain["failed_step"]),
        (&false.into(), &0.into())
    );
    assert_eq!(chain["reason"], "not_contained");
    assert_eq!(chain["steps"][0]["contained"], false);
    let margin = chain["steps"][0]["margin"].as_f64().unwrap();
    assert!(margin > 0.8 && margin < 1.0, "{margin}");
    let (code, out, ..) = run(&site, "chain site.toml --name back-to-dock");
    assert!(code == 1 && out.contains("fails at step 1"), "{out}");
}

#[test]
fn gaussian_start_adds_its_risk_to_the_plan() {
    let site = changed(
        "bounded = { translation = 1.0, yaw_deg = 2.0 }",
        "covariance = [[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.0001]], epsilon = 0.98",
    );
    let chain = json(&site, "chain site.toml --name back-to-dock --json", 0);
    assert!((chain["risk"].as_f64().unwrap() - 0.02).abs() < 1e-12);
    let planned = json(
        &site,
        "plan site.toml --from back-to-dock --to dock --json",
        0,
    );
    assert!((planned["risk"].as_f64().unwrap() - 0.02).abs() < 1e-12);
    let (code, out, ..) = run(
        &site,
        "plan site.toml --from back-to-dock --to dock --most-risk 0.01",
    );
    assert!(code == 1 && out.contains("infeasible"), "{out}");
}

#[test]
fn infeasible_plan_reports_the_nearest_miss() {
    let line = "plan site.toml --from back-to-dock --to dock --json";
    let plan = json(PAPER, line, 0);
    assert_eq!(
        (&plan["status"], &plan["success"]),
        (&"optimal".into(), &true.into())
    );
    assert_eq!(
        plan["steps"].as_array().unwrap().last().unwrap()["task"],
        "dock"
    );
    let hard = changed("x = [-0.10, 0.10]", "x = [-0.06, 0.06]");
    let plan = json(&hard, line, 1);
    assert_eq!(
        (&plan["status"], &plan["success"]),
        (&"infeasible".into(), &false.into())
    );
    let miss = plan["nearest_miss"]["margin"].as_f64().unwrap();
    assert!(miss > 0.5 && miss < 1.0, "{miss}");
    assert!(plan["reason"].as_str().unwrap().contains("see-t7"));
    // A single tag cannot be lost.
    let plan = json(PAPER, &format!("{line} --survive-lost-tags 1"), 1);
    assert_eq!(plan["status"], "infeasible");
    // A reached limit is reported as a limit.
    let plan = json(PAPER, &format!("{line} --limit 1"), 1);
    assert_eq!(plan["status"], "limit");
}

#[test]
fn plan_uses_the_drive_costs_of_the_file() {
    let folder = Case::new(&[("site.toml", PAPER.as_bytes())]);
    let plan = |costs: &str| {
        folder.write("costs.csv", costs);
        folder.run("plan site.toml --from back-to-dock --to dock --costs costs.csv --json")
    };
    let cost = |costs: &str| plan(costs).lines()[0]["cost"].as_f64().unwrap();
    let free = cost("from,to,cost\nstart,see-t7,0\nsee-t7,dock,0\nsee-t7,see-t7,0\n");
    let costly =
        cost("from,to,cost\nstart,see-t7,30\nstart,dock,30\nsee-t7,dock,10\nsee-t7,see-t7,30\n");
    assert!(free <= 2.0 + 1e-9 && costly > 10.0, "{free} {costly}");
    for (bad, expected) in [
        ("to,from,cost\n", "costs.csv:1"),
        ("from,to,cost\nstart,dock,-1\n", "costs.csv:2"),
        ("from,to,cost\nstart,dock\n", "costs.csv:2"),
        ("from,to,cost\nstrat,dock,1\n", "no place `strat`"),
    ] {
        plan(bad).is_refused_with(&[expected]);
    }
}

#[test]
fn bad_input_is_reported_with_the_reason() {
    let chain = "chain site.toml --name back-to-dock";
    let plan = "plan site.toml --from back-to-dock --to dock";
    for (site, line, expected) in [
        (
            changed("{ task = \"dock\" }", "{ task = \"dok\" }"),
            chain,
            "there is no task `dok`",
        ),
        (
            changed("k_drift = 0.005", "k_drift = -0.005"),
            chain,
            "k_drift",
        ),
        (
            changed(
                "bounded = { translation = 1.0",
                "bounded = { translation = -1.0",
            ),
            chain,
            "translation",
        ),
        (
            changed(
                "bounded = { translation = 1.0, yaw_deg = 2.0 }",
                "covariance = [[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
            ),
            chain,
            "eigenvalue below 0",
        ),
        (
            changed(
                "bounded = { translation = 1.0, yaw_deg = 2.0 }",
                "covariance = [[1, 0, 0], [0, 1, 0]]",
            ),
            chain,
            "three rows of three",
        ),
        (
            changed("kind = \"bounded\"", "kind = \"straight\""),
            chain,
            "\"straight\"",
        ),
        (
            changed(
                "error_bound = { translation = 0.05",
                "error_bound = { translation = 9.0",
            ),
            chain,
            "does not fit into its own success set",
        ),
        (
            changed(
                "error_bound = { translation = 0.05",
                "error_bound = { translation = 9.0",
            ),
            plan,
            "does not fit into its own success set",
        ),
        (
            PAPER.to_owned(),
            "chain site.toml --name back-to-dok",
            "did you mean `back-to-dock`?",
        ),
        (
            PAPER.to_owned(),
            "plan site.toml --from back-to-dock --to see-t7",
            "no work task",
        ),
        (
            PAPER.to_owned(),
            "plan site.toml --from back-to-dock --to doc",
            "did you mean `dock`?",
        ),
        (
            PAPER.to_owned(),
            "plan site.toml --from back-to-dock --to dock --most-risk 2",
            "not a probability",
        ),
    ] {
        let case = Case::new(&[("site.toml", site.as_bytes())]);
        case.run(line).is_refused_with(&[expected]);
    }
    // A site without localization tasks and tags.
    let start = PAPER.find("[tag.t7]").unwrap();
    let end = PAPER.find("[task.dock]").unwrap();
    let steps = PAPER.find("steps = [").unwrap();
    let bare = format!("{}{}", &PAPER[..start], &PAPER[end..steps]);
    let (code, _, err, _) = run(&bare, plan);
    assert!(
        code == 2 && err.contains("no localization task and no tag"),
        "{err}"
    );
    // A site without a drive model has no drives.
    let still = changed(
        "model = { kind = \"bounded\", k_turn = 0.005, k_drift = 0.005, k_slip = 0.01 }\n",
        "",
    );
    let steps = still.find("steps = [").unwrap();
    let (code, out, ..) = run(&still[..steps], plan);
    assert!(code == 1 && out.contains("[navigation] model"), "{out}");
}

/// The core confirms every reported plan within the requested risk, for all confidences.
#[test]
fn reported_plan_is_within_the_requested_risk() {
    let mut plans = 0;
    for (epsilon, sigma, heading) in [
        (0.9, 0.05, 0.01),
        (0.9999, 0.05, 0.01),
        (0.9999, 0.02, 0.05),
        (0.99, 0.02, 0.05),
        (0.98, 0.1, 0.02),
    ] {
        let square = |v: f64| v * v;
        let start = format!(
            "covariance = [[{p:?}, 0.0, 0.0], [0.0, {p:?}, 0.0], [0.0, 0.0, {w:?}]], epsilon = {epsilon:?}, \
             spread = {{ translation = 0.3, yaw_deg = 1.0 }}",
            p = square(sigma),
            w = square(heading)
        );
        let sizes: &[f64] = if counts::is_deep() {
            &[0.10, 0.15, 0.2, 0.3, 0.4]
        } else {
            &[0.2]
        };
        for size in sizes {
            let site = PAPER
                .replace("bounded = { translation = 1.0, yaw_deg = 2.0 }", &start)
                .replace(
                    "kind = \"bounded\", k_turn = 0.005, k_drift = 0.005, k_slip = 0.01",
                    "kind = \"gaussian\", a1 = 2e-5, a2 = 2e-5, a3 = 2e-5, a4 = 2e-5",
                )
                .replace(
                    "[-0.10, 0.10], y = [-0.09, 0.09]",
                    &format!("[-{size:?}, {size:?}], y = [-{size:?}, {size:?}]"),
                );
            let most = 0.15;
            let line =
                format!("plan site.toml --from back-to-dock --to dock --most-risk {most} --json");
            let (mut code, mut out, err, folder) =
                run(&site, &format!("{line} --rules plan.rules"));
            if code != 0 {
                assert!(!folder.path().join("plan.rules").exists());
            }
            // A plan that cannot be written as rules must be within the risk, too.
            if code == 2 && err.contains("cannot be written as rules") {
                (code, out, ..) = run(&site, &line);
                assert_eq!(code, 0, "{out}");
            }
            assert!(code == 0 || code == 1, "{out}{err}");
            if code == 0 {
                let planned: Value = serde_json::from_str(&out).unwrap();
                assert_eq!(planned["success"], true, "{out}");
                assert!(planned["risk"].as_f64().unwrap() <= most + 1e-12, "{out}");
                for step in planned["steps"].as_array().unwrap() {
                    assert!(
                        step.get("contained").is_none_or(|inside| inside == true),
                        "{out}"
                    );
                }
                plans += 1;
            }
        }
    }
    let least = if counts::is_deep() { 5 } else { 1 };
    assert!(plans >= least, "{plans}");
}
