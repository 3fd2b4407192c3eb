//! `posegate explain`: explains what a reason means and what to do about it.

use crate::site_input::{Failure, Outcome, answer, print, print_json};
use posegate::gate::Reason;
use posegate_site::similar;
use serde_json::json;

/// Explains what a reason for a denial means and what to do about it
#[derive(clap::Args)]
#[command(after_help = "Example:\n  posegate explain not_contained")]
pub struct Arguments {
    /// The reason [default: all reasons]
    reason: Option<String>,
    /// Print one line of JSON per reason
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let chosen: Vec<Reason> = match &arguments.reason {
        None => Reason::ALL.to_vec(),
        Some(name) => {
            let known = Reason::ALL.into_iter().find(|reason| reason.name() == name);
            let names: Vec<_> = Reason::ALL.iter().map(|reason| reason.name()).collect();
            vec![known.ok_or_else(|| {
                let help = match similar(name, names.iter().copied()) {
                    Some(similar) => format!("did you mean `{similar}`?"),
                    None => format!("the reasons are {}", names.join(", ")),
                };
                Failure::usage(format!("there is no reason `{name}`"), &help)
            })?]
        }
    };
    for reason in chosen {
        if arguments.json {
            print_json(&json!({
                "reason": reason.name(), "code": reason.code(),
                "meaning": reason.meaning(), "action": reason.action(),
            }))?;
        } else {
            print(&format_args!(
                "{} ({})\n  {}\n  {}",
                reason.name(),
                reason.code(),
                reason.meaning(),
                reason.action()
            ))?;
        }
    }
    Ok(answer(true))
}
