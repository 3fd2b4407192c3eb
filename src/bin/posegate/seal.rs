//! `posegate seal`: a firmware's own checksum.

use crate::door::{Failure, Outcome, answer, print, read, write};
use posegate::gate::Seal;
use posegate::seal::seal;
use serde_json::json;
use std::path::PathBuf;

/// Seals a linked firmware, so that the controller can check its own code
///
/// Fills in the record `static SEAL: Seal = Seal::UNSEALED` of the firmware, after linking and before
/// flashing. The file is changed in place, or written elsewhere with -o. Sealing again changes nothing.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate seal target/thumbv7em-none-eabihf/release/firmware")]
pub struct Arguments {
    /// The linked firmware, an ELF file
    firmware: PathBuf,
    /// Where to write it; `-` for standard output [default: in place]
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let (bytes, name) = read(&arguments.firmware)?;
    let sealed =
        seal(&bytes).map_err(|error| Failure::usage(format!("{name}: {error}"), error.help()))?;
    let output = arguments.output.as_ref().unwrap_or(&arguments.firmware);
    if arguments.json && output.as_os_str() == "-" {
        return Err(Failure::usage(
            "standard output cannot hold both the firmware and the JSON".into(),
            "write the firmware to a file, or leave --json out",
        ));
    }
    write(output, &sealed.file)?;
    let length = sealed.image.len();
    if arguments.json {
        print(&json!({
            "file": output.display().to_string(), "start": sealed.start, "length": length,
            "crc32c": format!("{:08x}", Seal::SUM),
        }))?;
    } else if output.as_os_str() != "-" {
        print(&format_args!(
            "{}: sealed: {length} bytes from {:#010x}",
            output.display(),
            sealed.start
        ))?;
    }
    Ok(answer(true))
}
