//! Prints the site file of a synthetic plant (aisles, racks, docks, conveyors, chargers), from 1 to 100,000 endpoints:
//!
//! ```sh
//! cargo run --release -p posegate-site --example plant -- 1000 > plant.toml     # endpoints, and optionally a seed
//! posegate site build plant.toml -o built
//! ```

use std::io::Write;
use std::process::ExitCode;

use posegate_testkit::plant;

fn main() -> ExitCode {
    let mut given = std::env::args().skip(1);
    let endpoints = given.next().and_then(|text| text.parse().ok());
    let seed = given.next().map_or(Some(1), |text| text.parse().ok());
    match (endpoints, seed) {
        (Some(endpoints @ 1..=100_000), Some(seed)) => {
            let site = plant::plant(seed, endpoints);
            match std::io::stdout().lock().write_all(site.as_bytes()) {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => {
                    eprintln!("standard output: {error}");
                    ExitCode::FAILURE
                }
            }
        }
        _ => {
            eprintln!("usage: plant ENDPOINTS [SEED], with 1 to 100000 endpoints");
            ExitCode::from(2)
        }
    }
}
