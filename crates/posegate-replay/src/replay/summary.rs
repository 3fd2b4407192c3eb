//! The summary of a replay, as JSON.

use super::tally::{Range, named};
use super::{Clock, Region, Replay, Thresholds};
use posegate::gate::Reason;
use serde_json::{Map, Value, json};

pub(super) fn summary(replay: &Replay<'_>) -> Value {
    let counts = &replay.counts;
    let thresholds = Thresholds::IN_USE;
    let rules: Map<String, Value> = replay
        .tallies()
        .iter()
        .map(|(name, tally)| {
            if tally.estimates == 0 {
                return ((*name).into(), Value::Null);
            }
            let mut line = json!({
                "permits": tally.permits,
                "availability": tally.availability(),
            });
            if tally.with_truth > 0 {
                line["false_permits"] = json!(tally.false_permits);
                line["false_denials"] = json!(tally.false_denials);
            }
            ((*name).into(), line)
        })
        .collect();
    let mut all = json!({
        "estimates": counts.verdicts.estimates,
        "clock": replay.clock().map(|clock| match clock {
            Clock::Logged => "logged",
            Clock::Stamps => "stamps",
        }),
        "freshness": match replay.clock() {
            Some(Clock::Logged) => "checked",
            _ => super::NOT_FRESH,
        },
        "reasons": reasons(&counts.verdict_reasons),
        "gate_reasons": reasons(&counts.gate_reasons),
        "ages_s": range(&counts.ages),
        "margins": {"permitted": range(&counts.permit_margins), "denied": range(&counts.denial_margins)},
        "gate": {
            "recorded_s": counts.interlock.recorded_s,
            "open_s": counts.interlock.open_s,
            "openings": counts.interlock.openings,
        },
        "interlock": interlock(replay),
        "rules": rules,
        "thresholds": {
            "distance_m": thresholds.distance_m,
            "sigma_m": thresholds.sigma_m,
            "sigma_yaw_rad": thresholds.sigma_yaw_rad,
            "ellipse_scale": thresholds.ellipse_scale,
            "ellipse_m": thresholds.ellipse_m,
            "ellipse_lateral_m": thresholds.ellipse_lateral_m,
            "ate_m": thresholds.ate_m,
        },
        "findings": findings(replay),
        "timeline": timeline(replay),
    });
    if let Some(odometry) = replay.odometry() {
        let most = odometry.extremes();
        all["odometry"] = json!({
            "poses": odometry.len(),
            "most_m_s": most.speed_m_s,
            "most_rad_s": most.turn_rad_s,
            "longest_gap_s": most.gap_s,
        });
    }
    let found = replay.findings();
    if found.other_frame > 0 {
        all["frame_mismatch"] = json!({"expected": replay.setup.world, "saw": found.frames});
    }
    let with_truth = counts.verdicts.with_truth;
    all["truth"] = if with_truth > 0 {
        truth(replay)
    } else {
        json!({})
    };
    let refused = replay.refused();
    for (name, count) in [
        ("estimates", with_truth),
        ("without", counts.verdicts.estimates - with_truth),
        ("not_finite", counts.truth_not_finite),
        ("lost", counts.truth_lost),
        ("of_other_frame", counts.truth_other_frame),
        (
            "poses",
            replay.track.as_ref().map_or(0, super::Trajectory::taken),
        ),
        (
            "poses_left_out",
            replay.track.as_ref().map_or(0, super::Trajectory::left_out),
        ),
        ("poses_of_other_frame", refused.other_frame),
        ("poses_not_unit", refused.not_unit),
        ("poses_tilted", refused.tilted),
    ] {
        all["truth"][name] = json!(count);
    }
    all
}

fn interlock(replay: &Replay<'_>) -> Value {
    let times = &replay.counts.interlock;
    let shut = times.shut_s_by().into_iter();
    let shut: Map<String, Value> = shut
        .map(|(reason, seconds)| (reason.name().into(), json!(seconds)))
        .collect();
    let mut all = json!({
        "openings": times.openings,
        "open_s": times.open_s,
        "shut_s_by": shut,
        "open_steps": replay.open_moments().open,
    });
    let moments = replay.open_moments();
    if moments.with_truth > 0 {
        all["open_steps_with_truth"] = json!(moments.with_truth);
        all["open_steps_outside"] = json!(moments.outside);
    }
    if let Some(why) = times.why_shut(replay.setup.settings) {
        all["why"] = json!(why.words);
        all["setting"] = why.setting.map_or(Value::Null, |(name, value, opens_with)| {
            json!({"name": name, "value": value, "opens_with": opens_with})
        });
    }
    all
}

fn truth(replay: &Replay<'_>) -> Value {
    let counts = &replay.counts;
    let stanford = &replay.stanford;
    let [held, sets] = counts.held;
    let regions: Map<String, Value> = Region::ALL
        .iter()
        .map(|region| (region.name().into(), json!(stanford.region(*region))))
        .collect();
    let rmse = counts.rmse();
    json!({
        "in_success_set": counts.verdicts.inside,
        "in_pose_set": held,
        "pose_sets": sets,
        "coverage": held as f64 / sets as f64,
        "nees": {"count": counts.nees.count, "mean": counts.nees.least_mean_most().map(|[_, mean, _]| mean), "expected": 3},
        "rmse_m": rmse.map(|[metres, _]| metres),
        "rmse_yaw_rad": rmse.map(|[_, radians]| radians),
        "most_error_m": counts.errors_m.least_mean_most().map(|[_, _, most]| most),
        "stanford": {"regions": regions, "left_out": stanford.left_out()},
    })
}

fn findings(replay: &Replay<'_>) -> Value {
    let findings = replay.findings();
    let named = findings.named().into_iter();
    let mut all: Map<String, Value> = named
        .map(|(name, count)| (name.into(), json!(count)))
        .collect();
    all.insert("frames".into(), json!(findings.frames));
    let most_tilt_deg = findings.most_tilt_rad.to_degrees();
    all.insert("most_tilt_deg".into(), json!(most_tilt_deg));
    Value::Object(all)
}

fn timeline(replay: &Replay<'_>) -> Value {
    let timeline = replay.timeline();
    let spans: Vec<Value> = timeline
        .buckets()
        .iter()
        .enumerate()
        .filter(|(_, bucket)| bucket.estimates > 0)
        .map(|(k, bucket)| {
            let margin = bucket.least_margin;
            json!({
                "from_s": timeline.start_s() + k as f64 * timeline.width_s(),
                "estimates": bucket.estimates,
                "permits": bucket.permits,
                "open": bucket.open,
                "false_permits": bucket.false_permits,
                "least_margin": margin.is_finite().then_some(margin),
                "most_age_s": bucket.most_age_s,
            })
        })
        .collect();
    json!({"span_s": timeline.width_s(), "without_time": timeline.without_time(), "spans": spans})
}

fn reasons(counts: &[u64; 64]) -> Value {
    let given = named(counts).into_iter();
    let all: Map<String, Value> = given
        .map(|(reason, count)| (Reason::name(reason).into(), json!(count)))
        .collect();
    Value::Object(all)
}

fn range(range: &Range) -> Value {
    match range.least_mean_most() {
        None => Value::Null,
        Some([least, mean, most]) => json!({"least": least, "mean": mean, "most": most}),
    }
}
