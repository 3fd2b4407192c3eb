//! What the paper's figures show, as the example `paper_figures` draws them.

#[path = "../examples/paper_figures/figures/mod.rs"]
mod figures;

use posegate_show::draw::study::CaseStudy;
use posegate_testkit::picture::check_picture;

/// The three errors of Fig. 1, before and after each task in Fig. 2, and the panels and boxes of Fig. 3.
#[test]
fn figures_show_what_the_paper_shows() {
    let study = CaseStudy::run(&|| ()).unwrap();
    let [parking, chain, sections, plan] = figures::all(&study).unwrap();
    for (name, text) in [&parking, &chain, &sections, &plan] {
        check(text, name);
    }
    let [parking, chain, sections, plan] = [parking, chain, sections, plan].map(|(_, text)| text);
    // A car of 4.5 m by 1.5 m in a space of 5 m by 3 m has slacks of 25 cm along and 75 cm across.
    for shown in [
        "(a) error along x",
        "fits up to 0.25 m;",
        "(b) error across, y",
        "fits up to 0.75 m;",
        "(c) error in yaw",
        "yaw (rad)",
    ] {
        assert!(parking.contains(shown), "{shown}");
    }
    for shown in [
        "1. before see-t7",
        "after see-t7",
        "2. before dock",
        "after dock",
    ] {
        assert!(chain.contains(shown), "{shown}");
    }
    for panel in [
        "(a) yaw",
        "(b) yaw",
        "(c) yaw",
        "(d) yaw",
        "(e) yaw",
        "in S<tspan",
    ] {
        assert!(sections.contains(panel), "{panel}");
    }
    // The same pose-set in the same success set has one margin.
    let margins: Vec<&str> = chain
        .split("all of X\u{302} is in S, margin ")
        .skip(1)
        .filter_map(|rest| rest.split('<').next())
        .collect();
    assert_eq!(margins.len(), 2);
    for margin in margins {
        assert!(
            sections.contains(&format!(", margin {margin}<")),
            "{margin}"
        );
    }
    // On a telephone, the words of wider figures would be too small to be read.
    for figure in [&sections, &plan] {
        let (_, rest) = figure.split_once(" width=\"").unwrap();
        let wide: f64 = rest.split_once('"').unwrap().0.parse().unwrap();
        assert!(wide <= 760.0, "{wide}");
    }
    // The sets of the paper can be distinguished without colours: S is hatched, pose-sets are dashed.
    for figure in [&chain, &sections] {
        assert!(figure.contains("stroke=\"#b3001b\" stroke-width=\"0.6\""));
        assert!(figure.contains("stroke-dasharray=\"6 3\""));
    }
}

fn check(text: &str, name: &str) {
    check_picture(text, name);
    for shown in ["x (m)", "y (m)", "yaw", "margin"] {
        assert!(text.contains(shown), "{name} has no {shown}");
    }
}
