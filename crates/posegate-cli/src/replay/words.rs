//! The texts that report a replay.

use super::Arguments;
use super::odometry::no_edge;
use crate::recording::{Recorded, topics};
use crate::site_input::{Failure, print};
use posegate::gate::Reason;
use posegate_files::printable::printable;
use posegate_replay::Trajectory;
use posegate_replay::recording::{ReaderDiagnostics, SkipReason};
use posegate_replay::replay::{Clock, NOT_FRESH, Replay};
use serde_json::{Map, Value, json};
use std::path::Path;

/// Returns the failure for a recording without estimates, with the reasons.
pub fn no_estimates(
    arguments: &Arguments,
    diagnostics: &ReaderDiagnostics,
    outside: u64,
) -> Failure {
    let name = arguments.log.display();
    if outside > 0 {
        return Failure::usage(
            format!("{name}: all {outside} estimates are outside of --from and --to"),
            "times are those of the stamps, in seconds",
        );
    }
    if !diagnostics.transforms.is_empty() {
        return no_edge(&format!("{name}:"), diagnostics, arguments);
    }
    let refused = diagnostics
        .skipped
        .iter()
        .filter(|(_, skipped)| skipped.why != SkipReason::NotWanted)
        .map(|(topic, skipped)| {
            let why = skipped.why.name();
            format!(
                "; {topic} is not read: {why} ({}; {})",
                skipped.schema, skipped.encoding
            )
        });
    let refused: String = refused.collect();
    let damage = diagnostics
        .damage
        .as_deref()
        .map_or(String::new(), |damage| format!("; broken {damage}"));
    let bytes = diagnostics.first_undecodable.as_deref();
    let bytes = bytes.map_or(String::new(), |first| format!("; {first}"));
    let all = topics(diagnostics);
    let all = if all.is_empty() {
        all
    } else {
        format!("; its topics:{all}")
    };
    let why = printable(&format!("{name}: no estimate{refused}{damage}{bytes}")).into_owned();
    Failure::list(
        &format!("{why}{all}"),
        "give a recording with estimates, and the topic that has them",
    )
}

/// Checks that the named topics are in the bag.
pub fn check_topics(arguments: &Arguments, diagnostics: &ReaderDiagnostics) -> Result<(), Failure> {
    let is_there = |topic: &String| {
        diagnostics.read.contains_key(topic) || diagnostics.skipped.contains_key(topic)
    };
    let missing: String = arguments
        .recorded
        .topic
        .iter()
        .filter(|topic| !is_there(topic))
        .map(|topic| format!(" {}", printable(topic)))
        .collect();
    // A damaged bag may have lost the topic.
    if missing.is_empty() || diagnostics.damage.is_some() {
        return Ok(());
    }
    let name = printable(&arguments.log.display().to_string()).into_owned();
    Err(Failure::list(
        &format!(
            "{name} has no topic{missing}; it has:{}",
            topics(diagnostics)
        ),
        "leave it out, or name an existing topic",
    ))
}

/// Checks that a requested truth applies to at least one estimate.
pub fn check_requested(
    arguments: &Arguments,
    diagnostics: &ReaderDiagnostics,
    replay: &Replay<'_>,
) -> Result<(), Failure> {
    let [(_, verdicts), ..] = replay.tallies();
    let Some(truth) = arguments
        .recorded
        .truth
        .as_ref()
        .filter(|_| verdicts.with_truth == 0)
        .map(|truth| truth.as_path().to_string_lossy())
    else {
        return Ok(());
    };
    let skipped = diagnostics
        .skipped
        .get(&*truth)
        .map_or(String::new(), |skipped| {
            format!(
                "; the topic is not read: {} ({})",
                skipped.why.name(),
                skipped.schema
            )
        });
    let refused = replay.refused();
    let track = replay.track();
    Err(Failure::usage(
        format!(
            "--truth {truth}: none of {} estimates has a true pose; {} true poses, at most {:.3} s apart, {} left out, {} of another frame, {} not unit, {} tilted{skipped}",
            verdicts.estimates,
            track.map_or(0, Trajectory::taken),
            track.map_or(0.0, Trajectory::largest_gap_s),
            track.map_or(0, Trajectory::left_out),
            refused.other_frame,
            refused.not_unit,
            refused.tilted,
        ),
        "name the topic or file that has the truth of these times, in the world frame; a longer --truth-gap may be needed",
    ))
}

/// Returns the reader's counts and faults as JSON.
pub fn recording(arguments: &Arguments, input: &Recorded) -> Value {
    let diagnostics = input.recording.diagnostics();
    let mut read = diagnostics.read.clone();
    // The odometry is read in a pass of its own.
    let odometry = arguments.odom.as_ref().map(|odom| odom.as_path());
    let is_odometry = |topic: &str| odometry.is_some_and(|odom| odom == Path::new(topic));
    let (odometry, skipped) = diagnostics
        .skipped
        .iter()
        .partition::<Vec<_>, _>(|(topic, _)| is_odometry(topic));
    read.extend(
        odometry
            .into_iter()
            .map(|(topic, odometry)| (topic.clone(), odometry.messages)),
    );
    let skipped: Map<String, Value> = skipped
        .into_iter()
        .map(|(topic, skipped)| {
            let line = json!({
                "schema": skipped.schema,
                "encoding": skipped.encoding,
                "why": skipped.why.name(),
                "messages": skipped.messages,
            });
            (topic.clone(), line)
        })
        .collect();
    json!({
        "file": input.name,
        "bytes": input.recording.bytes(),
        "message_bytes": diagnostics.message_bytes,
        "topics": read,
        "skipped_topics": skipped,
        "undecodable": diagnostics.undecodable,
        "first_undecodable": diagnostics.first_undecodable,
        "indexed": diagnostics.indexed,
        "damage": diagnostics.damage,
        "bad_chunks": diagnostics.bad_chunks,
        "bad_records": diagnostics.bad_records,
        "outside_time_range": input.part.outside,
    })
}

/// Prints the summary as text.
pub fn sentences(
    arguments: &Arguments,
    replay: &Replay<'_>,
    summary: &Value,
    [permits, estimates]: [u64; 2],
) -> Result<(), Failure> {
    print(&format_args!(
        "{estimates} estimates, {permits} permitted; open {:.1} s of {:.1} s, opened {} times",
        summary["gate"]["open_s"].as_f64().unwrap_or(0.0),
        summary["gate"]["recorded_s"].as_f64().unwrap_or(0.0),
        summary["gate"]["openings"]
    ))?;
    for (reason, count) in replay.reasons() {
        print(&format_args!("  {count} {reason}: {}", reason.action()))?;
        if reason == Reason::Tilted {
            print(&format_args!(
                "    by up to {:.1} deg: if these are the poses of a camera, name its frame with --child-frame, and its place on the robot in the site ([frame.NAME])",
                summary["findings"]["most_tilt_deg"]
                    .as_f64()
                    .unwrap_or(f64::NAN)
            ))?;
        }
        if reason == Reason::FrameMismatch {
            print(&format_args!("    {}", frames(&summary["frame_mismatch"])))?;
        }
    }
    interlock(&summary["interlock"])?;
    if let Some(odometry) = summary.get("odometry") {
        print(&format_args!("{}", odometry_text(arguments, odometry)))?;
    }
    if replay.clock() == Some(Clock::Stamps) {
        print(&format_args!("freshness: {NOT_FRESH}"))?;
    }
    let truth = summary
        .get("truth")
        .filter(|truth| truth["estimates"] != json!(0));
    print(&format_args!(
        "{:<10} {:>9} {:>13} {:>14} {:>13}",
        "rule", "permits", "availability", "false permits", "false denials"
    ))?;
    for (name, tally) in replay.tallies() {
        if tally.estimates == 0 {
            print(&format_args!(
                "{name:<10} {:>9} {:>13} {:>14} {:>13}",
                "-", "-", "-", "-"
            ))?;
            continue;
        }
        let [wrong, missed] = match truth {
            Some(_) => [tally.false_permits, tally.false_denials].map(|count| count.to_string()),
            None => ["-".to_string(), "-".to_string()],
        };
        print(&format_args!(
            "{name:<10} {:>9} {:>13.4} {wrong:>14} {missed:>13}",
            tally.permits,
            tally.availability()
        ))?;
    }
    if let Some(truth) = truth {
        let get = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
        print(&format_args!(
            "truth known of {} estimates, {} in the success set; in the pose-set: {:.4}; NEES {:.2} (3 is honest); RMSE {:.4} m, {:.2} deg",
            truth["estimates"],
            truth["in_success_set"],
            get(&truth["coverage"]),
            get(&truth["nees"]["mean"]),
            get(&truth["rmse_m"]),
            get(&truth["rmse_yaw_rad"]).to_degrees()
        ))?;
    }
    let findings = replay.findings();
    for (name, count) in findings.named().into_iter().skip(1) {
        if count > 0 {
            print(&format_args!("found: {count} {name}"))?;
        }
    }
    if let Some(names) = summary["child_frames"]
        .as_array()
        .filter(|all| !all.is_empty())
    {
        let of = |name: &Value| {
            let text = printable(name.as_str().unwrap_or_default()).into_owned();
            let place = name.as_str().map(|name| &summary["body_frames"][name]);
            match place.and_then(Value::as_array).map(Vec::as_slice) {
                Some([x, y, yaw]) => {
                    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
                    format!(
                        "`{text}` at ({:.3} m, {:.3} m, {:.1} deg) on the robot",
                        number(x),
                        number(y),
                        number(yaw).to_degrees()
                    )
                }
                _ => format!("`{text}`, as the robot's base"),
            }
        };
        let names: Vec<String> = names.iter().map(of).collect();
        print(&format_args!("child frames: {}", names.join(", ")))?;
    }
    for key in ["skipped_topics", "looks"] {
        let part = summary["recording"].get(key).or(summary.get(key));
        if let Some(part) = part
            .and_then(Value::as_object)
            .filter(|part| !part.is_empty())
        {
            for (name, what) in part {
                print(&format_args!("{}: {name} {what}", key.replace('_', " ")))?;
            }
        }
    }
    if summary["recording"]["undecodable"] != json!(0) {
        let recording = &summary["recording"];
        print(&format_args!(
            "{} messages cannot be decoded: {}",
            recording["undecodable"], recording["first_undecodable"]
        ))?;
    }
    Ok(())
}

/// Returns how fast the robot was by its odometry, and the bounds that the odometry exceeds.
fn odometry_text(arguments: &Arguments, odometry: &Value) -> String {
    let number = |name: &str| odometry[name].as_f64().unwrap_or(f64::NAN);
    let (speed, gap) = (number("most_m_s"), number("longest_gap_s"));
    let rate = number("most_rad_s").to_degrees();
    // Rounded up, so that the printed number is enough.
    let beyond = |value: f64| ((value * 1e3).floor() + 1.0) * 1e-3;
    let mut more = String::new();
    for (flag, given, found) in [
        ("--max-speed", arguments.max_speed, speed),
        ("--max-yaw-rate", arguments.max_yaw_rate, rate),
    ] {
        // The tracker allows for the rounding of the stamps.
        if found > given * 1.05 {
            more += &format!(
                "; faster than {flag} {given} is a jump: give {flag} {:.3} or more",
                beyond(found)
            );
        }
    }
    if gap * 1e3 > f64::from(arguments.odom_gap_ms) + 1.0 {
        more += &format!(
            "; more than --odom-gap-ms {} is a gap, after which a new fix is needed",
            arguments.odom_gap_ms
        );
    }
    format!(
        "odometry: {} poses, up to {speed:.3} m/s and {rate:.1} deg/s, at most {:.0} ms apart{more}",
        odometry["poses"],
        gap * 1e3
    )
}

/// Returns the frames that estimates were in, and the one that they should be in.
fn frames(mismatch: &Value) -> String {
    let saw: Vec<String> = mismatch["saw"]
        .as_object()
        .into_iter()
        .flatten()
        .map(|(frame, count)| format!("`{}` ({count})", printable(frame)))
        .collect();
    format!(
        "the frames seen are {}; expected `{}`: give the frame of the success set with --frame, or the topic of poses in it",
        saw.join(", "),
        printable(mismatch["expected"].as_str().unwrap_or("")),
    )
}

/// Prints for how long the interlock was shut, and why it never opened.
fn interlock(times: &Value) -> Result<(), Failure> {
    let seconds = |value: &Value| value.as_f64().unwrap_or(0.0);
    let mut shut: Vec<(&String, f64)> = times["shut_s_by"]
        .as_object()
        .into_iter()
        .flatten()
        .map(|(reason, value)| (reason, seconds(value)))
        .collect();
    shut.sort_by(|a, b| b.1.total_cmp(&a.1));
    if !shut.is_empty() {
        let parts: Vec<String> = shut
            .iter()
            .map(|(reason, seconds)| format!("{seconds:.1} s {reason}"))
            .collect();
        print(&format_args!("interlock shut: {}", parts.join(", ")))?;
    }
    if times["open_steps_with_truth"].is_u64() {
        print(&format_args!(
            "interlock open at {} steps of the gate; at {} of them the truth is known, and at {} it was outside of the success set",
            times["open_steps"], times["open_steps_with_truth"], times["open_steps_outside"]
        ))?;
    }
    if let Some(why) = times["why"].as_str() {
        print(&format_args!("interlock never open: {why}"))?;
    }
    Ok(())
}
