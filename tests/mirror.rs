//! The mirror image of a set on the mirror image of a table has the same answer, to within the roundings: (x, y, yaw) becomes (x, -y, -yaw).
//!
//! No formula of the decision is symmetric by construction: facets, levers, slabs and several pieces have signs of their own.
#![cfg(feature = "std")]

#[path = "../crates/posegate-testkit/src/oracle/mod.rs"]
mod oracle;

use oracle::Rng;
use posegate::contain::{Decision, decide};
use posegate::set::{Estimate, PoseSet};
use posegate::table::{HEADER_LENGTH, Table, checksum};
use std::f64::consts::TAU;

/// Tables of facets, and the largest difference of the accepted scales of a set and of its image, of the scale; the largest in the mean. The search across several pieces takes
/// facets and headings in an order that the image reverses, and ends after a number of steps.
const TABLES: [(&str, f64, f64); 6] = [
    ("examples/tables/dock.posegate", 0.002, 0.0002),
    ("examples/tables/see-t7.posegate", 0.01, 0.0002),
    ("tests/data/turning.posegate", 0.003, 0.0002),
    ("tests/data/over-180.posegate", 0.005, 0.0002),
    ("tests/data/corner.posegate", 0.2, 0.001),
    ("tests/data/see-bay.posegate", 0.2, 0.001),
];

/// Returns the table of the mirror image.
fn mirrored(bytes: &[u8]) -> Vec<u8> {
    let table = Table::parse(bytes).expect("a table");
    let cells = *table.cells();
    let mut image = bytes.to_vec();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let mut set = |at: usize, value: u32| image[at..at + 4].copy_from_slice(&value.to_le_bytes());
    // The goal's y, heading and sine; the lower ends of y and of the headings.
    for at in [20, 24, 32] {
        set(at, word(at).wrapping_neg());
    }
    set(40, cells.y_hi_um().wrapping_neg() as u32);
    set(
        52,
        word(52).wrapping_add(cells.yaw_span as u32).wrapping_neg(),
    );
    let layout = word(76) as usize;
    assert!(layout >= HEADER_LENGTH);
    let [pieces, frames] = [1, 2].map(|at| usize::from(bytes[layout + at]));
    let facets = usize::from(u16::from_le_bytes([bytes[layout + 4], bytes[layout + 5]]));
    let first_piece = layout + 12;
    for piece in 0..pieces {
        let at = first_piece + 12 * piece;
        if word(at + 4) != u32::MAX {
            set(at, word(at).wrapping_add(word(at + 4)).wrapping_neg());
        }
    }
    // The y of frames and of normals.
    let first_frame = first_piece + 12 * pieces;
    let first_facet = first_frame + 6 * frames;
    let of_frames = (0..frames).map(|frame| first_frame + 6 * frame + 4);
    let of_facets = (0..facets).map(|facet| first_facet + 6 * facet + 2);
    for at in of_frames.chain(of_facets) {
        let y = i16::from_le_bytes([bytes[at], bytes[at + 1]]).wrapping_neg();
        image[at..at + 2].copy_from_slice(&y.to_le_bytes());
    }
    // The sight record is not asked.
    image[92..96].fill(0);
    if word(92) != 0 {
        let end = word(92) as usize;
        image.truncate(end);
        image.extend([0; 4]);
        let length = image.len() as u32;
        image[12..16].copy_from_slice(&length.to_le_bytes());
    }
    let end = image.len() - 4;
    let crc = checksum(&image[..end]);
    image[end..].copy_from_slice(&crc.to_le_bytes());
    image
}

/// A pose, deviations, and the covariances xy, x-yaw and y-yaw.
#[derive(Clone, Copy, Debug)]
struct Set {
    pose: [f64; 3],
    covariance: [[f64; 3]; 3],
}

impl Set {
    fn image(&self) -> Self {
        let [x, y, yaw] = self.pose;
        let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = self.covariance;
        Self {
            pose: [x, -y, -yaw],
            covariance: [[xx, -xy, -xt], [-xy, yy, yt], [-xt, yt, tt]],
        }
    }

    /// Returns the largest scale at which the set is inside, within a thousandth of it.
    fn accepted(&self, table: &Table<'_>) -> f64 {
        let [x_m, y_m, yaw_rad] = self.pose;
        let at = Estimate { x_m, y_m, yaw_rad };
        let is_inside = |scale: f64| {
            let covariance = self.covariance.map(|row| row.map(|v| v * scale * scale));
            PoseSet::gaussian(at, covariance, table.radius_squared())
                .is_ok_and(|set| decide(table, &set) == Decision::Inside)
        };
        let (mut low, mut high) = (0.01f64, 100.0);
        if !is_inside(low) {
            return 0.0;
        }
        while high / low > 1.001 {
            let middle = (low * high).sqrt();
            if is_inside(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

#[test]
fn image_of_a_set_has_the_same_answer() {
    let mut rng = Rng::new(7);
    let (mut all, mut others) = (0u32, 0u32);
    for (path, most, in_the_mean) in TABLES {
        let bytes = std::fs::read(format!("{}/{path}", env!("CARGO_MANIFEST_DIR"))).expect("bytes");
        let image = mirrored(&bytes);
        let tables = [&bytes, &image].map(|bytes| Table::parse(bytes).expect("a table"));
        let [table, image] = &tables;
        let (cells, goal) = (table.cells(), table.goal());
        let half = |low: i32, high: i32| (f64::from(high) - f64::from(low)) / 2e6;
        let wide = [
            half(cells.x_lo_um, cells.x_hi_um()),
            half(cells.y_lo_um, cells.y_hi_um()),
            cells.yaw_span as f64 / 4_294_967_296.0 * TAU / 2.0,
        ];
        let middle = [
            f64::from(cells.x_lo_um) / 1e6 + wide[0],
            f64::from(cells.y_lo_um) / 1e6 + wide[1],
            f64::from(cells.yaw_lo.0) / 4_294_967_296.0 * TAU + wide[2],
        ];
        let turn = f64::from(goal.pose.yaw.0) / 4_294_967_296.0 * TAU;
        let (s, c) = turn.sin_cos();
        let (mut held, mut worst, mut sum) = (0u32, 0.0f64, 0.0);
        for _ in 0..1_500 {
            let [x, y, yaw] = [0, 1, 2].map(|k| middle[k] + wide[k] * rng.within(-0.8, 0.8));
            let sigma = wide.map(|wide| wide * 10f64.powf(rng.within(-2.5, -0.8)));
            let [a, b, free] = [0; 3].map(|_| rng.within(-0.95, 0.95));
            let between = a * b + ((1.0 - a * a) * (1.0 - b * b)).sqrt() * free;
            let entry = |i: usize, j: usize, rho: f64| rho * sigma[i] * sigma[j];
            let (xy, xt, yt) = (entry(0, 1, between), entry(0, 2, a), entry(1, 2, b));
            let set = Set {
                pose: [
                    f64::from(goal.pose.x_um) / 1e6 + c * x - s * y,
                    f64::from(goal.pose.y_um) / 1e6 + s * x + c * y,
                    turn + yaw,
                ],
                covariance: [
                    [entry(0, 0, 1.0), xy, xt],
                    [xy, entry(1, 1, 1.0), yt],
                    [xt, yt, entry(2, 2, 1.0)],
                ],
            };
            let [one, other] = [set.accepted(table), set.image().accepted(image)];
            // A set of a few length units is decided by their roundings.
            if one.max(other) * sigma[0].min(sigma[1]) < 2e-3 {
                continue;
            }
            held += 1;
            let apart = (one - other).abs() / one.max(other);
            worst = worst.max(apart);
            sum += apart;
            // The set itself, on the image of the table.
            let swapped = set.accepted(image);
            others += u32::from((one - swapped).abs() > 0.1 * one);
            assert!(apart <= most, "{path}: {one} and {other} for {set:?}");
        }
        let mean = sum / f64::from(held);
        println!("{path}: {held} sets, scales differ by {worst:.5}, in the mean by {mean:.5}");
        assert!(held > 40 && mean <= in_the_mean, "{path}: {held} {mean}");
        all += held;
    }
    assert!(others * 4 > all, "{others} of {all} differ");
}
