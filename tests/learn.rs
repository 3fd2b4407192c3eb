//! What is learnt holds on rows that it was not learnt from: bounds for their share of the detections, overall and
//! in every region that is accepted; inflated sets for theirs; and it is no looser than it must be.
#![cfg(feature = "std")]

use posegate::learn::{
    BoundsSettings, Detection, Detections, ErrorModel, acceptance, learn_bounds,
};
use std::time::Instant;

#[test]
#[ignore = "run by ci.sh recorded DIR"]
fn recorded_bounds() {
    let folder = std::env::var("POSEGATE_RECORDED").unwrap();
    let bytes = std::fs::read(format!("{folder}/apriltag_errors.csv")).unwrap();
    let all = Detections::read(&bytes, "apriltag_errors.csv").unwrap();
    let dbins = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.5];
    let pbins = [0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0];
    for quantile in [0.9, 0.95, 0.99] {
        for seed in 1..=3u64 {
            let mut learnt = Detections {
                rows: Vec::new(),
                sha256: [0; 32],
            };
            let mut held: Vec<Detection> = Vec::new();
            for (i, row) in all.rows.iter().enumerate() {
                let mut z = (i as u64).wrapping_mul(0x9e3779b97f4a7c15)
                    ^ seed.wrapping_mul(0xbf58476d1ce4e5b9);
                z ^= z >> 31;
                z = z.wrapping_mul(0x94d049bb133111eb);
                z ^= z >> 29;
                if z % 10 < 5 {
                    learnt.rows.push(*row)
                } else {
                    held.push(*row)
                }
            }
            let start = Instant::now();
            let model = learn_bounds(
                &learnt,
                &BoundsSettings {
                    quantile,
                    ..Default::default()
                },
            )
            .unwrap();
            let took = start.elapsed();
            let mut cells = vec![[0u64; 4]; 49];
            let mut total = [0u64; 4];
            for row in &held {
                let bin =
                    |bins: &[f64; 8], x: f64| bins.windows(2).position(|b| x >= b[0] && x < b[1]);
                let (Some(i), Some(j)) = (bin(&dbins, row.at[0]), bin(&pbins, row.at[2])) else {
                    continue;
                };
                let Some(e) = row.errors else { continue };
                let c = &mut cells[i * 7 + j];
                let Some(b) = model.bounds_deg(row.at) else {
                    c[3] += 1;
                    total[3] += 1;
                    continue;
                };
                for c in [c, &mut total] {
                    c[0] += 1;
                    c[1] += u64::from(e[0] <= b.0);
                    c[2] += u64::from(e[1] <= b.1);
                }
            }
            println!(
                "Q {quantile} seed {seed}: {took:?} regions {} refused {} total {total:?} {:.4} {:.4}",
                model.regions().count(),
                model.refused().count(),
                total[1] as f64 / total[0] as f64,
                total[2] as f64 / total[0] as f64
            );
            for i in 0..7 {
                let mut line = String::new();
                for j in 0..7 {
                    let c = cells[i * 7 + j];
                    let [lo, hi] = acceptance(c[0], quantile, 0.99);
                    let mark = |k: u64| {
                        if c[0] == 0 {
                            ' '
                        } else if k < lo {
                            '-'
                        } else if k > hi {
                            '+'
                        } else {
                            ' '
                        }
                    };
                    let mid = [
                        (dbins[i] + dbins[i + 1]) / 2.0,
                        10.0,
                        (pbins[j] + pbins[j + 1]) / 2.0,
                    ];
                    let b = model.bounds_deg(mid).map_or(f64::NAN, |b| b.0);
                    line += &format!(
                        " {:.3}{}{:.3}{}/{}({}) {:.3}|",
                        c[1] as f64 / c[0] as f64,
                        mark(c[1]),
                        c[2] as f64 / c[0] as f64,
                        mark(c[2]),
                        c[0],
                        c[3],
                        b
                    );
                }
                println!("{line}");
            }
            println!("{:?}", model.views(0.05, 2.0));
            let _: &ErrorModel = &model;
        }
    }
}
