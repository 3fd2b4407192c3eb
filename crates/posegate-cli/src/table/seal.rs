//! `posegate table seal`: writes a checksum of a firmware's code into the firmware.

use crate::site_input::{Failure, Outcome, answer, print, print_json};
use posegate::gate::Seal;
use posegate::seal::seal;
use posegate_files::files::{Files, Input, Output};
use serde_json::json;

/// Seals a linked firmware, so that the controller can check its own code
///
/// Fills in the record `static SEAL: Seal = Seal::UNSEALED` of the firmware, after linking and before
/// flashing. The file is changed in place, or written to another file with -o. Sealing again changes nothing.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  posegate table seal target/thumbv7em-none-eabihf/release/firmware"
)]
pub struct Arguments {
    /// The linked firmware, an ELF file
    firmware: Input,
    /// The file to write; `-` for standard output [default: in place]
    #[arg(short, long)]
    output: Option<Output>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, files: &Files) -> Outcome {
    let (bytes, name) = files.read(&arguments.firmware)?;
    let sealed =
        seal(&bytes).map_err(|error| Failure::usage(format!("{name}: {error}"), error.help()))?;
    let (name, to_stdout) = match &arguments.output {
        Some(output) => (output.display(), output.is_standard()),
        None => (
            arguments.firmware.display(),
            arguments.firmware.is_standard(),
        ),
    };
    if arguments.json && to_stdout {
        return Err(Failure::usage(
            "standard output cannot hold both the firmware and the JSON".into(),
            "write the firmware to a file, or leave out --json",
        ));
    }
    match &arguments.output {
        Some(output) => files.write(output, &sealed.file)?,
        None => files.replace(&arguments.firmware, &sealed.file)?,
    }
    let length = sealed.image.len();
    if arguments.json {
        print_json(&json!({
            "file": name.to_string(), "start": sealed.start, "length": length,
            "crc32c": format!("{:08x}", Seal::SUM),
        }))?;
    } else if !to_stdout {
        print(&format_args!(
            "{name}: sealed: {length} bytes from {:#010x}",
            sealed.start
        ))?;
    }
    Ok(answer(true))
}
