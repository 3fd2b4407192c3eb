//! The jobs, one file for each or for a few that belong together.

pub mod browser;
pub mod budgets;
pub mod c;
pub mod compare;
pub mod dist;
pub mod docs;
pub mod faults;
pub mod figures;
pub mod flash;
pub mod fuzz;
pub mod lint;
pub mod mcap;
pub mod miri;
pub mod msrv;
pub mod mutants;
pub mod no_panic;
pub mod package;
pub mod planning;
pub mod python;
pub mod recorded;
pub mod ros2;
pub mod slurm;
pub mod steady;
pub mod test;
pub mod vectors;
pub mod wasm;
