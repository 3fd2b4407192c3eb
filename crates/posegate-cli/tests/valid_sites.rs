//! A valid site never ends in an internal error (exit code 3). Its table is built and proven, or refused with
//! the reason.

use posegate_testkit::counts;
use posegate_testkit::run::Case;

/// The two that there are: `auto` and `both` are other words for facets.
const LAYOUTS: [&str; 2] = ["facets", "grid"];

fn site(success: &str, goal_yaw_deg: f64, table: &str) -> String {
    format!(
        "[task.t]\nkind = \"work\"\ngoal = {{ x = 1.0, y = -2.0, yaw_deg = {goal_yaw_deg:?} }}\nsuccess = {success}\n\n\
         [confidence]\nepsilon = 0.99\n\n{table}"
    )
}

fn table(x: [f64; 2], y: [f64; 2], yaw_deg: [f64; 2], [xy, step_deg]: [f64; 2]) -> String {
    format!(
        "[table]\nextent = {{ x = {x:?}, y = {y:?}, yaw_deg = {yaw_deg:?} }}\nstep = {{ xy = {xy:?}, yaw_deg = {step_deg:?} }}\n"
    )
}

/// Builds a site in every layout and returns the exit codes, none of which is 3. Built tables are proven again.
fn built(text: &str) -> [i32; 2] {
    let folder = Case::new(&[("site.toml", text.as_bytes())]);
    folder.expect(0, "check site.toml");
    LAYOUTS.map(|layout| {
        let file = format!("{layout}.posegate");
        let built = folder.run(&format!(
            "table build site.toml --task t --layout {layout} -o {file}"
        ));
        let (code, error) = (built.code, built.err);
        assert!(
            code == 0 || code == 2,
            "{layout}: exit code {code}: {error}\n{text}"
        );
        if code == 2 {
            assert!(
                error.contains("help:") && error.contains("task `t`"),
                "{layout}: {error}"
            );
        } else {
            folder.expect(0, &format!("table verify {file} site.toml"));
        }
        code
    })
}

/// Boxes whose arc is below a full turn by less than a unit of the table's headings, by some units, or by a
/// hundredth of a degree. The tables have the same arc, or a full turn.
#[test]
fn arc_of_nearly_a_full_turn_is_built() {
    let arc = |[lo, hi]: [f64; 2]| {
        format!(
            "{{ shape = \"box\", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [{lo:?}, {hi:?}] }}"
        )
    };
    let mut tried = 0;
    for lo in counts::one_a_day(&[-180.0, -179.0, 0.0, 5.0, 132.3275388813637]) {
        for short in [
            2e-9, 2.6e-9, 1e-8, 4e-8, 8e-8, 1.1e-7, 1.7e-7, 1e-6, 1e-4, 0.02,
        ] {
            let ends = [lo, lo + 360.0 - short];
            let shape = arc(ends);
            for yaw_deg in [ends, [-180.0, 180.0]] {
                let table = table([-0.2, 0.2], [-0.2, 0.2], yaw_deg, [0.05, 7.3]);
                let codes = built(&site(&shape, 90.0, &table));
                assert_eq!(codes, [0; 2], "{ends:?} in {yaw_deg:?}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, if counts::is_deep() { 100 } else { 20 });
}

/// A table of an arc is never a table of a full turn.
#[test]
fn arc_below_a_full_turn_is_not_a_full_turn() {
    let shape =
        "{ shape = \"box\", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [0.0, 359.99999999] }";
    let table = table([-0.2, 0.2], [-0.2, 0.2], [-180.0, 180.0], [0.05, 5.0]);
    let site = site(shape, 0.0, &table);
    let folder = Case::new(&[("site.toml", site.as_bytes())]);
    let line = "table build site.toml --task t --layout facets -o t.posegate";
    folder.expect(0, line);
    let bytes = folder.read("t.posegate");
    let table = posegate::table::Table::parse(&bytes).unwrap();
    let pieces: Vec<_> = table.facets().unwrap().pieces().collect();
    assert!(!pieces.is_empty() && pieces.iter().all(|piece| !piece.is_whole_circle()));
}

/// Regions that share an edge or a corner, or that overlap or leave a crack by micrometres or less. Also slivers,
/// corners nearly on an edge, thin robots and thin obstacles.
#[test]
fn slivers_are_built_or_refused_with_a_message() {
    let robot = "[[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]]";
    let square = "[[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]";
    let table = table([-0.6, 1.1], [-0.6, 0.6], [-10.0, 10.0], [0.1, 5.0]);
    let mut regions = Vec::new();
    for off in [
        "0.5",
        "0.500001",
        "0.499999",
        "0.500000001",
        "0.499999999",
        "0.499999999999999",
    ] {
        regions.push(format!(
            "{square}, [[{off}, -0.5], [1.0, -0.5], [1.0, 0.5], [{off}, 0.5]]"
        ));
        regions.push(format!(
            "{square}, [[{off}, {off}], [1.0, {off}], [1.0, 1.0], [{off}, 1.0]]"
        ));
        regions.push(format!(
            "{square}, [[{off}, -0.5], [1.0, -0.4], [0.50001, 0.5]]"
        ));
    }
    for thin in ["0.500001", "0.500000001", "0.500000000001"] {
        regions.push(format!(
            "{square}, [[0.5, -0.5], [{thin}, -0.5], [{thin}, 0.5], [0.5, 0.5]]"
        ));
        regions.push(format!(
            "{square}, [[0.5, -0.5], [{thin}, 0.0], [0.5, 0.5]]"
        ));
    }
    regions.push("[[-0.5, -0.5], [0.0, -0.5000000000001], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]], [[0.5, -0.5], [1.0, -0.5], [1.0, 0.5], [0.5, 0.5]]".into());
    let mut sets: Vec<String> = regions
        .iter()
        .map(|regions| {
            format!("{{ shape = \"footprint\", footprint = {robot}, regions = [{regions}] }}")
        })
        .collect();
    for thin in ["0.000001", "0.000000001"] {
        sets.push(format!("{{ shape = \"footprint\", footprint = [[0.2, 0.0], [-0.2, {thin}], [-0.2, 0.0]], region = {square} }}"));
        sets.push(format!(
            "{{ all = [{{ shape = \"footprint\", footprint = {robot}, region = {square} }}, {{ shape = \"clear\", footprint = {robot}, \
             obstacle = [[0.4, 0.3], [0.4{}, 0.3], [0.4{}, 0.5], [0.4, 0.5]] }}] }}",
            &thin[2..], &thin[2..]
        ));
        // Hardly any slack for the robot.
        sets.push(format!("{{ shape = \"footprint\", footprint = {robot}, region = [[-0.2, -0.1], [0.2, -0.1], [0.2, 0.1{}], [-0.2, 0.1{}]] }}", &thin[3..], &thin[3..]));
    }
    let (skipped, step) = counts::part(4);
    let (mut proven, mut tried) = (0, 0);
    for set in sets.iter().skip(skipped).step_by(step) {
        let codes = built(&site(set, 0.0, &table));
        proven += usize::from(codes[0] == 0);
        tried += 1;
    }
    assert!(tried >= 7 && proven > tried / 2, "{proven} of {tried}");
}

/// The proof chooses the right part of the set for each piece, also if the robot fits at few headings.
#[test]
fn facets_of_regions_that_touch_within_rounding_are_proven() {
    // A corner of the robot that is nearly on an edge, and regions that touch within 3e-13 m.
    let set = "{ shape = \"footprint\", footprint = [[0.2, -0.1], [0.2, 0.1], [0, 0.10000000071453756], [-0.2, 0.1], [-0.2, -0.1]], \
        regions = [[[0.5656854249492381, 0.565685424949238], [-0.7727406610312546, 0.2070552360820168], [0.20705523608201615, -0.7727406610312547]], \
        [[0.4242640687121908, -2.623734562945401e-13], [1.1313708498987385, 0.7071067811862851], [0.7071067811865477, 1.131370849898476], \
        [2.7755575615628914e-17, 0.42426406871192845]], [[0.7071067811865475, -5.551115123125783e-17], [0.3535533960824354, 0.35355339608243536], \
        [5.551115123125783e-17, 0.7071067811865475]]] }";
    assert_eq!(built(&site(set, 33.3, "")), [0; 2]);
}

/// The goal need not lie in the union of regions: the table covers the poses at which the robot fits.
#[test]
fn goal_outside_of_all_regions_is_valid() {
    let robot = "[[0.2, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.2, -0.1]]";
    let set = format!(
        "{{ shape = \"footprint\", footprint = {robot}, regions = [[[-2.0, -1.0], [-1.0, -1.0], [-1.0, 1.0], [-2.0, 1.0]], \
         [[1.0, -1.0], [2.0, -1.0], [2.0, 1.0], [1.0, 1.0]]] }}"
    );
    let table = table([-2.1, 2.1], [-1.1, 1.1], [-10.0, 10.0], [0.1, 5.0]);
    assert_eq!(built(&site(&set, 30.0, &table)), [0; 2]);
    // The answer about a pose names no obstacle either.
    let folder = Case::new(&[]);
    folder.write("site.toml", site(&set, 0.0, &table));
    let poses = "x_m,y_m,yaw_rad\n1.0,-2.0,0.0\n2.5,-2.0,0.0\n";
    folder.write("poses.csv", poses);
    let line = "contains site.toml --task t --poses poses.csv --json";
    let lines = folder.run(line).out;
    let lines: Vec<&str> = lines.lines().collect();
    assert!(
        lines[0].contains("\"inside\":false") && lines[1].contains("\"inside\":true"),
        "{lines:?}"
    );
    assert!(
        lines
            .iter()
            .all(|line| line.contains("\"region\"") && !line.contains("obstacle")),
        "{lines:?}"
    );
    // An obstacle on the goal is still a mistake.
    let clear = format!(
        "{{ all = [{set}, {{ shape = \"clear\", footprint = {robot}, obstacle = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]] }}] }}"
    );
    folder.write("site.toml", site(&clear, 0.0, &table));
    let check = folder.run("check site.toml");
    check.is_refused_with(&["an obstacle covers the goal"]);
}
