//! The program `posegate`: the command line of the library.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    posegate_cli::program(std::env::args_os())
}
