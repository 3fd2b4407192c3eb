//! Host tools for a Posegate gate: site files, plans, placement of tags, learning from logs, replay, pictures.
//!
//! Start with [`site::Site`]: a site file, read. The gate ([`posegate::gate::Gate`]) and its tables are in the package `posegate`; the
//! command line is in `posegate-cli`.
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod input;

mod sheet;

pub mod printable;

pub mod excerpt;

pub mod files;

pub mod guard;

pub mod learn;

pub mod place;

pub mod log;

pub mod site;

pub mod controller_cost;

pub mod inscribe;

pub mod plan;

pub mod cover;

pub mod site_build;

pub mod draw;

pub mod doctor;

pub mod page;

/// Returns the number of iterations of a test: `all`, or the smaller number `interpreted` under Miri, which is slow.
#[cfg(test)]
pub(crate) const fn rounds(all: u32, interpreted: u32) -> u32 {
    if cfg!(miri) { interpreted } else { all }
}
