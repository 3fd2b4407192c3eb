//! The walk over grids that `bake` does not make: several runs in a row, the full circle, sets wider than the table,
//! and the worst pose.

use posegate_site::Site;
use posegate_testkit::sites;

use posegate::bake::{Extent, Layout, Step, TableSpec, grid};
use posegate::contain::{Cause, Decision, decide, examine};
use posegate::set::{Estimate, PoseSet, RadiusSquared};
use posegate::table::{Run, Table};
use posegate::verify::verify;
use sites::table_of;

fn spec(yaw_deg: [f64; 2], step_deg: f64) -> TableSpec {
    TableSpec {
        extent: Extent {
            x: [-1.0, 1.0],
            y: [-1.0, 1.0],
            yaw_deg,
        },
        step: Step {
            xy: 0.1,
            yaw_deg: step_deg,
        },
        layout: Layout::Grid,
    }
}

fn run(first: u16, last: u16) -> Run {
    Run { first, last }
}

fn disc(x_m: f64, y_m: f64, yaw_deg: f64, translation: f64, spread_deg: f64) -> PoseSet {
    let estimate = Estimate {
        x_m,
        y_m,
        yaw_rad: yaw_deg.to_radians(),
    };
    PoseSet::bounded(estimate, translation, spread_deg.to_radians()).unwrap()
}

fn is_inside(bytes: &[u8], set: &PoseSet) -> bool {
    let table = Table::parse(bytes).unwrap();
    let decision = decide(&table, set);
    let examination = examine(&table, set);
    assert_eq!(examination.decision, decision);
    assert_eq!(
        examination.margin.q16() >= 1 << 16,
        decision == Decision::Inside
    );
    // A pose is named only if it is clear of the covered cells.
    assert!(examination.worst_pose.is_none() || !(decision == Decision::Inside));
    decision == Decision::Inside
}

/// A wall of uncovered cells between two rooms: sets fit into either room, and no permitted set spans the wall.
#[test]
fn sets_are_inside_single_runs_and_never_across_a_gap() {
    let rows = vec![vec![run(0, 7), run(10, 19)]; 20];
    let bytes = table_of(spec([-10.0, 10.0], 5.0), &vec![rows; 4]);
    assert_eq!(
        Table::parse(&bytes)
            .unwrap()
            .grid()
            .unwrap()
            .slab(2)
            .runs(7)
            .count(),
        2
    );
    assert!(is_inside(&bytes, &disc(-0.6, 0.0, 0.0, 0.35, 2.0)));
    assert!(is_inside(&bytes, &disc(0.5, 0.0, 0.0, 0.45, 2.0)));
    assert!(!is_inside(&bytes, &disc(-0.1, 0.0, 0.0, 0.05, 2.0)));
    assert!(!is_inside(&bytes, &disc(0.2, 0.0, 0.0, 0.3, 2.0)));
    assert!(!is_inside(&bytes, &disc(-0.5, 0.0, 0.0, 0.31, 2.0)));
}

/// Every run, every row and every slab is evaluated: if any cell is removed, a set that covers it is denied.
#[test]
fn set_over_any_missing_cell_is_denied() {
    let full = vec![vec![vec![run(0, 19)]; 20]; 4];
    let bytes = table_of(spec([-10.0, 10.0], 5.0), &full);
    let set = disc(0.0, 0.0, 0.0, 0.98, 9.9);
    assert!(is_inside(&bytes, &set));
    for slab in 0..4usize {
        for row in 0..20usize {
            for column in 0..20u16 {
                let mut slabs = full.clone();
                slabs[slab][row] = [run(0, column.wrapping_sub(1)), run(column + 1, 19)]
                    .into_iter()
                    .filter(|r| r.first <= r.last && r.last < 20)
                    .collect();
                let bytes = table_of(spec([-10.0, 10.0], 5.0), &slabs);
                // The square about the disc touches every cell of the table.
                assert!(!is_inside(&bytes, &set), "{slab} {row} {column}");
            }
        }
    }
}

#[test]
fn set_over_an_empty_row_is_denied() {
    let mut rows = vec![vec![run(0, 19)]; 20];
    rows[13].clear();
    let bytes = table_of(spec([-10.0, 10.0], 5.0), &vec![rows; 4]);
    assert!(is_inside(&bytes, &disc(0.0, 0.0, 0.0, 0.29, 2.0)));
    assert!(!is_inside(&bytes, &disc(0.0, 0.0, 0.0, 0.31, 2.0)));
}

/// A table of the full circle has no seam, for any begin.
#[test]
fn full_circle_has_no_seam() {
    for lo in [-180.0, 0.0, 33.0, 180.0] {
        let slabs = vec![vec![vec![run(0, 19)]; 20]; 36];
        let bytes = table_of(spec([lo, lo + 360.0], 10.0), &slabs);
        for yaw in -20..=20 {
            let yaw = f64::from(yaw) * 18.0;
            assert!(is_inside(&bytes, &disc(0.0, 0.0, yaw, 0.5, 5.0)), "{yaw}");
            assert!(is_inside(&bytes, &disc(0.0, 0.0, yaw, 0.5, 180.0)), "{yaw}");
            assert!(
                is_inside(&bytes, &disc(0.0, 0.0, yaw, 0.5, 1000.0)),
                "{yaw}"
            );
        }
        // Every set that reaches the one bad heading is denied, also across the seam.
        let mut slabs = slabs;
        slabs[7] = vec![vec![]; 20];
        let bytes = table_of(spec([lo, lo + 360.0], 10.0), &slabs);
        let bad = lo + 75.0;
        for offset in [-170.0, -90.0, -20.0, 20.0, 90.0, 170.0f64] {
            let clear = offset.abs() - 5.0;
            assert!(is_inside(
                &bytes,
                &disc(0.0, 0.0, bad + offset, 0.5, clear - 0.1)
            ));
            assert!(!is_inside(
                &bytes,
                &disc(0.0, 0.0, bad + offset, 0.5, clear + 0.1)
            ));
        }
    }
}

/// A range of headings that passes 180 degrees.
#[test]
fn range_of_headings_may_pass_180_degrees() {
    let slabs = vec![vec![vec![run(0, 19)]; 20]; 8];
    let bytes = table_of(spec([160.0, 200.0], 5.0), &slabs);
    for yaw in [180.0, -180.0, 179.0, -179.0, 540.0, -540.0] {
        assert!(is_inside(&bytes, &disc(0.0, 0.0, yaw, 0.5, 15.0)), "{yaw}");
        assert!(!is_inside(&bytes, &disc(0.0, 0.0, yaw, 0.5, 20.1)), "{yaw}");
    }
    for yaw in [0.0, 159.9, 200.1, -159.9, 90.0] {
        let table = Table::parse(&bytes).unwrap();
        let set = disc(0.0, 0.0, yaw, 0.1, 1.0);
        assert_eq!(
            decide(&table, &set),
            Decision::Outside(Cause::OffTable),
            "{yaw}"
        );
    }
}

#[test]
fn set_wider_than_the_table_has_its_own_reason() {
    let slabs = vec![vec![vec![run(0, 19)]; 20]; 4];
    let bytes = table_of(spec([-10.0, 10.0], 5.0), &slabs);
    let table = Table::parse(&bytes).unwrap();
    let radius = RadiusSquared::from_q16(743_498).unwrap();
    let gaussian = |sigma: [f64; 3], x_m: f64| {
        let [a, b, c] = sigma.map(|s| s * s);
        let estimate = Estimate {
            x_m,
            y_m: 0.0,
            yaw_rad: 0.0,
        };
        PoseSet::gaussian(
            estimate,
            [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]],
            radius,
        )
        .unwrap()
    };
    let too_large = Decision::Outside(Cause::TooLarge);
    assert_eq!(decide(&table, &disc(0.0, 0.0, 0.0, 1.01, 1.0)), too_large);
    assert_eq!(decide(&table, &disc(0.0, 0.0, 0.0, 0.1, 10.1)), too_large);
    assert_eq!(decide(&table, &gaussian([0.3, 0.01, 0.01], 0.0)), too_large);
    assert_eq!(decide(&table, &gaussian([0.01, 0.3, 0.01], 0.0)), too_large);
    assert_eq!(
        decide(&table, &gaussian([0.01, 0.01, 0.06], 0.0)),
        too_large
    );
    // For any estimate.
    assert_eq!(
        decide(&table, &gaussian([0.3, 0.01, 0.01], 500.0)),
        too_large
    );
    assert_eq!(
        decide(&table, &gaussian([0.01, 0.01, 0.01], 500.0)),
        Decision::Outside(Cause::OffTable)
    );
    assert_eq!(
        decide(&table, &gaussian([0.01, 0.01, 0.01], 1.001)),
        Decision::Outside(Cause::OffTable)
    );
    assert_eq!(
        decide(&table, &gaussian([0.29, 0.29, 0.05], 0.0)),
        Decision::Inside
    );
}

/// The worst pose is a pose of the set, and no cell covers the poses just beyond it.
#[test]
fn worst_pose_is_at_the_exit_of_the_set() {
    let rows: Vec<Vec<Run>> = (0..20u16)
        .map(|row| vec![run(row / 4, 19 - row / 4)])
        .collect();
    let bytes = table_of(spec([-10.0, 10.0], 5.0), &vec![rows; 4]);
    let table = Table::parse(&bytes).unwrap();
    let set = disc(0.2, 0.3, 0.0, 0.64, 3.0);
    let examination = examine(&table, &set);
    let worst = examination.worst_pose.unwrap();
    let (dx, dy) = (
        f64::from(worst.x_um) * 1e-6 - 0.2,
        f64::from(worst.y_um) * 1e-6 - 0.3,
    );
    // On the border of the disc (found in 256 steps), to the right, where rows 13 to 15 end at x = 0.7: it leaves them first.
    let level = dx.hypot(dy) / 0.64;
    assert!(level <= 1.0 && level > 0.99, "{level}");
    assert!(examination.margin.q16() < 1 << 16);
    assert!(dx > 0.0, "{worst:?}");
}

/// The last edge of the most columns that a table can have is the only place of a part; and a wedge of 16,000 rows widens by a part of a cell a row.
/// The numbers of cells are those of another search, which solved for the borders.
#[test]
fn grids_of_the_most_columns_and_of_many_rows_have_their_cells() {
    let far = "{ any = [ { shape = \"box\", x = [1.0, 2.0], y = [-0.01, 0.01], yaw_deg = [-3.0, 3.0] }, \
               { shape = \"footprint\", footprint = [[0.0, 0.0]], region = [[32.76745, -0.5], [33.5, -0.5], [33.5, 0.5], [32.76745, 0.5]] } ] }";
    let wedge = "{ all = [ { shape = \"footprint\", footprint = [[0.0, 0.0]], region = [[0.0, 0.0], [0.00140624, -8.0], [0.0064062400000000005, -8.0]] }, \
                 { shape = \"box\", x = [-1.0, 1.0], y = [-40.0, 40.0], yaw_deg = [-3.0, 3.0] } ] }";
    for (success, x, y, xy, expected) in [
        (far, [0.0, 32.7675], [-0.005, 0.005], 0.0005, 80_000),
        (
            wedge,
            [-0.005_800, 0.009_406],
            [-7.9985, 8.0015],
            0.001,
            25_188,
        ),
    ] {
        let site = format!(
            "[task.t]\nkind = \"work\"\ngoal = {{ x = 0.0, y = 0.0, yaw_deg = 0.0 }}\nsuccess = {success}\n\
             [task.t.table]\nextent = {{ x = {x:?}, y = {y:?}, yaw_deg = [-1.0, 1.0] }}\nstep = {{ xy = {xy:?}, yaw_deg = 1.0 }}\n"
        );
        let site = Site::parse(&site, "site.toml").unwrap();
        let bytes = grid(&sites::order(&site, "t"), &|| ()).unwrap();
        let proof = verify(&bytes, &sites::claim(&site, "t"), &|| ()).unwrap();
        assert_eq!(proof.cells, expected, "{success}");
    }
}
