//! Any bits as a report of ROS, of MAVLink or of nine floats: no panic, no other heading than that of the report, and
//! the second evaluation confirms every permit of the first.
//!
//! The input is a byte for the table, a byte for the form, two of options, an inflation, and floats.
#![no_main]

use libfuzzer_sys::fuzz_target;
use posegate::contain::{Decision, decide, second};
use posegate::report::{PoseEstimate, mavlink, ros};
use posegate::set::{CrossTerms, Inflation, SplitWeight, Trust, Uncertainty};
use posegate_fuzz::input::Input;
use posegate_fuzz::{sound, tables};
use std::f64::consts::TAU;

fuzz_target!(|data: &[u8]| {
    let mut input = Input(data);
    let [which, form, options, share] = input.take();
    let inflation = u32::from_le_bytes(input.take());
    let share = SplitWeight::from_q8(share).unwrap_or(SplitWeight::HALF);
    let trust = Trust {
        inflation: Inflation::from_q16(inflation).unwrap_or(Inflation::NONE),
        cross_terms: match options & 3 {
            0 | 1 => CrossTerms::Filled,
            2 => CrossTerms::YawUnknown(share),
            _ => CrossTerms::AllUnknown(share),
        },
    };
    let axes = if options & 4 == 0 {
        mavlink::Axes::Up
    } else {
        mavlink::Axes::Down
    };
    let [x, y, a, b, c, d] = [(); 6].map(|()| input.float());
    let [xx, xy, xt, yy, yt, tt] = [(); 6].map(|()| input.float());
    let triangle = || {
        // Entries that must be ignored are NaN, which would invalidate any result.
        let mut all = [f32::NAN; 21];
        for (at, value) in [(0, xx), (1, xy), (5, xt), (6, yy), (10, yt), (20, tt)] {
            all[at] = value as f32;
        }
        all
    };
    let position = [x as f32, y as f32, f32::NAN];
    let mut yaw = None;
    let belief = match form % 5 {
        0 => {
            let mut covariance = [f64::NAN; 36];
            for (at, value) in [
                (0, xx),
                (1, xy),
                (5, xt),
                (6, xy),
                (7, yy),
                (11, yt),
                (30, xt),
                (31, yt),
                (35, tt),
            ] {
                covariance[at] = value;
            }
            yaw = Some(f64::atan2(
                2.0 * (d * c + a * b),
                d * d + a * a - b * b - c * c,
            ));
            PoseEstimate::from(&ros::PoseWithCovariance {
                position: [x, y, f64::NAN],
                orientation: [a, b, c, d],
                covariance,
            })
        }
        1 => mavlink::VisionPositionEstimate {
            position,
            angles: [a as f32, b as f32, c as f32],
            covariance: triangle(),
        }
        .belief(axes),
        2 => mavlink::Odometry {
            position,
            q: [d as f32, a as f32, b as f32, c as f32],
            pose_covariance: triangle(),
        }
        .belief(axes),
        3 => PoseEstimate::compact([x, y, a, xx, xy, xt, yy, yt, tt].map(|v| v as f32)),
        _ => {
            let mut belief =
                PoseEstimate::compact([x, y, a, xx, xy, xt, yy, yt, tt].map(|v| v as f32));
            belief.spread = Some(Uncertainty::Bounded {
                translation_m: xx,
                yaw_rad: tt,
            });
            belief
        }
    };
    let number = usize::from(which) % tables::BYTES.len();
    let table = &tables::all()[number];
    let opinion = second::opinion(tables::BYTES[number], &belief, trust);
    let Ok(set) = belief.pose_set(table.radius_squared(), trust) else {
        return;
    };
    if let Some(yaw) = yaw {
        let turns = yaw / TAU - f64::from(set.mean().yaw.0) / 4_294_967_296.0;
        assert!((turns - turns.round()).abs() * 4_294_967_296.0 <= 0.6);
    }
    if decide(table, &set) == Decision::Inside {
        assert_eq!(opinion, second::INSIDE, "{belief:?} {trust:?}");
        sound::holds(table, &set, posegate::contain::Margin::ONE, [1, 2, -3]);
    }
});
