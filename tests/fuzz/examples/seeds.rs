//! Writes seeds for every target into a folder: real tables, and the recorded estimates of
//! `tests/data/estimates.csv`.

use posegate::set::Estimate;
use posegate::wire::{Reply, Request, Uncertainty, encode};
use posegate_fuzz::input::SET_LENGTH;
use posegate_fuzz::tables;
use std::f64::consts::TAU;
use std::path::Path;

/// Largest table that is a seed, bytes. Larger tables are slow and add nothing.
const LARGEST: usize = 4_000;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let folder = std::env::args().nth(1).ok_or("usage: seeds DIR")?;
    let write = |target: &str, name: String, bytes: Vec<u8>| {
        let folder = Path::new(&folder).join(target);
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join(name), bytes)
    };
    // Sets in the middle of a table: small, of some size, correlated.
    let middle = [0x00, 0x80, 0x00, 0x80, 0x00, 0x80];
    let set = |kind: u8, size: u8| {
        let mut set = vec![kind, 2];
        set.extend(middle);
        set.extend([0, size, 0, size, 0, size, 0, 0x90, 0, 0x70, 0, 0x80]);
        assert_eq!(set.len(), SET_LENGTH);
        set
    };
    for (number, table) in tables::BYTES.iter().enumerate() {
        // Without its checksum a table is invalid, unless the harness repairs it.
        let table = &table[..table.len() - 4];
        for (kind, size) in [(2, 0xa0), (2, 0x50), (0, 0x60), (2, 0x30)] {
            if table.len() <= LARGEST {
                let bytes = [table, &[0; 4], &set(kind, size)[..], &set(1, size), &[0]].concat();
                write("table", format!("seed-{number}-{kind}-{size}"), bytes)?;
            }
        }
    }
    for (number, row) in rows()?.into_iter().step_by(20).enumerate() {
        let [x, y, yaw, xx, xy, xt, yy, yt, tt] = row;
        let covariance = [[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]];
        let table = number % tables::BYTES.len();
        let radius_squared = tables::all()[table].radius_squared();
        // The estimates were recorded at a goal at the origin.
        let goal = tables::all()[table].goal().pose;
        let (x_m, y_m) = (
            f64::from(goal.x_um) * 1e-6 + x,
            f64::from(goal.y_um) * 1e-6 + y,
        );
        let yaw_rad = f64::from(goal.yaw.signed()) / 4_294_967_296.0 * TAU + yaw;
        for form in 0..5u8 {
            let mut bytes = vec![table as u8, form, number as u8 & 7, 128, 0, 0, 1, 0];
            let (s, c) = (yaw_rad / 2.0).sin_cos();
            let turn = match form {
                0 | 2 => [0.0, 0.0, s, c],
                1 => [0.0, 0.0, yaw_rad, 0.0],
                _ => [yaw_rad, 0.0, 0.0, 0.0],
            };
            let numbers = [x_m, y_m]
                .into_iter()
                .chain(turn)
                .chain([xx, xy, xt, yy, yt, tt]);
            bytes.extend(numbers.flat_map(f64::to_le_bytes));
            write("report", format!("seed-{number}-{form}"), bytes)?;
        }
        let bounds = [0.01 + 0.2 * xx.sqrt(), 0.01 + 0.2 * tt.sqrt()];
        for kind in [0, 1] {
            let mut bytes = vec![table as u8, kind];
            bytes.extend(radius_squared.q16().to_le_bytes());
            let spread = if kind == 0 {
                covariance.as_flattened()
            } else {
                &bounds
            };
            let floats = [x_m, y_m, yaw_rad]
                .into_iter()
                .chain(spread.iter().copied());
            bytes.extend(floats.flat_map(f64::to_le_bytes));
            write("estimate", format!("seed-{number}-{kind}"), bytes)?;
            let request = Request {
                sequence: number as u16,
                table: table as u8,
                stamp_ms: 1000,
                now_ms: 1010,
                radius_squared,
                estimate: Estimate { x_m, y_m, yaw_rad },
                spread: if kind == 0 {
                    Uncertainty::Gaussian(covariance)
                } else {
                    let [translation_m, yaw_rad] = bounds;
                    Uncertainty::Bounded {
                        translation_m,
                        yaw_rad,
                    }
                },
            };
            messages(&request, &mut |name, bytes| {
                write("wire", format!("seed-{name}-{number}-{kind}"), bytes)
            })?;
        }
    }
    Ok(())
}

/// Adds a request and the reply to it, in their frames and as bodies.
fn messages(
    request: &Request,
    write: &mut impl FnMut(&str, Vec<u8>) -> std::io::Result<()>,
) -> Result<(), Failure> {
    let reply = Reply::refused(posegate::wire::WireError::Content);
    let (request, reply) = (request.body(), reply.body());
    write(
        "line",
        [&[0][..], &encode(&request), &encode(&reply)].concat(),
    )?;
    let mut bodies = vec![1];
    for body in [&request[..], &reply] {
        bodies.push(body.len() as u8);
        bodies.extend_from_slice(body);
    }
    write("bodies", bodies)?;
    Ok(())
}

/// Returns estimate and covariance of the recorded rows, without rows that are not numbers.
fn rows() -> Result<Vec<[f64; 9]>, Failure> {
    let text = include_str!("../../data/estimates.csv");
    let rows = text.lines().skip(1).filter_map(|line| {
        let fields = line.split(',').skip(2).take(9).map(str::parse);
        let row: Vec<f64> = fields.collect::<Result<_, _>>().ok()?;
        row.try_into().ok()
    });
    let rows: Vec<_> = rows.collect();
    if rows.len() < 100 {
        return Err("tests/data/estimates.csv has few rows".into());
    }
    Ok(rows)
}
