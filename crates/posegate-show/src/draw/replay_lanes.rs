//! The lanes of a replay's picture: the states of the gate, the interlock and the rules in use today over time.

use super::letters::number;
use super::palette;
use super::svg::{Anchor, Font, Picture, Style};
use posegate::gate::Reason;
use posegate_replay::replay::{Bucket, Replay, RuleCounts, Thresholds};

pub(super) const LEFT: f64 = 176.0;
pub(super) const WIDTH: f64 = 620.0;
/// Height of a lane, and between two lanes, pixels.
const LANE: f64 = 26.0;
const BETWEEN: f64 = 10.0;
/// Height of the ticks of estimates.
const TICKS: f64 = 10.0;
/// Space between the gate's lanes and the rules' lanes.
const APART: f64 = 8.0;
/// Height of all lanes.
pub(super) const HEIGHT: f64 = TICKS + 6.0 + 2.0 * APART + 6.0 * (LANE + BETWEEN);
/// The most estimates that are drawn as single ones.
pub(super) const SPARSE: usize = 160;

pub(super) const PERMIT: Style = Style::filled("#009e73");
pub(super) const DENIAL: Style = Style::filled("#f3d2bd");
pub(super) const WRONG: Style = Style::filled("#000000");
const OLD: Style = Style::filled("none").with_fill_opacity("#009e73", 0.35);
pub(super) const SHUT: Style = Style::filled("#e3e6ea");
const TICK: Style = Style::outlined("#222222", 0.7);
/// The most reasons that are named; all others have one colour.
const MOST_NAMED: usize = 6;
const OTHERS: Style = Style::filled("#999999");
/// The colours of reasons that are rare, by their codes.
const RARE: [Style; 7] = [
    Style::filled("#7f5539"),
    Style::filled("#4d4d4d"),
    Style::filled("#e7298a"),
    Style::filled("#17becf"),
    Style::filled("#a6761d"),
    Style::filled("#1b4965"),
    Style::filled("#b5838d"),
];

/// Returns the colour of a reason: the same in every picture.
fn colour(reason: Reason) -> Style {
    match reason {
        Reason::NotContained => Style::filled("#d55e00"),
        Reason::OutsideTable => Style::filled("#56b4e9"),
        Reason::Stale => Style::filled("#e69f00"),
        Reason::Silent => Style::filled("#0072b2"),
        Reason::Qualifying => Style::filled("#cc79a7"),
        Reason::Holding => Style::filled("#f0e442"),
        Reason::PoseSetTooLarge => Style::filled("#8172b3"),
        other => {
            let place = usize::from(other.code()) % RARE.len();
            RARE.get(place).copied().unwrap_or(OTHERS)
        }
    }
}

/// Converts times to x coordinates of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub start_s: f64,
    pub span_s: f64,
}

impl Axis {
    /// Returns the axis of all times of a replay.
    pub fn of(replay: &Replay<'_>) -> Self {
        let (timeline, lanes) = (replay.timeline(), &replay.interlock().lanes);
        let ends = [
            (
                timeline.start_s(),
                timeline.width_s(),
                timeline.buckets().len(),
            ),
            (lanes.start_s(), lanes.width_s(), lanes.spans().len()),
        ];
        let known = ends.into_iter().filter(|(_, _, count)| *count > 0);
        let (start, end) = known.fold(
            (f64::INFINITY, f64::NEG_INFINITY),
            |(start, end), (from, width, count)| {
                (start.min(from), end.max(from + width * count as f64))
            },
        );
        if start < end {
            Self {
                start_s: start,
                span_s: end - start,
            }
        } else {
            Self {
                start_s: 0.0,
                span_s: 0.0,
            }
        }
    }

    /// Returns the x coordinate of a time, pixels.
    pub fn x(&self, time_s: f64) -> f64 {
        if !(self.span_s > 0.0) {
            return LEFT;
        }
        LEFT + WIDTH * ((time_s - self.start_s) / self.span_s).clamp(0.0, 1.0)
    }
}

/// A reason with its colour and the time for which it kept the interlock shut, seconds. `None` means all other
/// reasons.
pub(super) type Shade = (Option<Reason>, Style, f64);

/// Returns the reasons that kept the interlock shut, the commonest first.
pub(super) fn shades(replay: &Replay<'_>) -> Vec<Shade> {
    let mut all = replay.interlock().shut_s_by();
    all.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    let rest: f64 = all.iter().skip(MOST_NAMED).map(|(_, s)| s).sum();
    let named = all.iter().take(MOST_NAMED);
    let mut shades: Vec<Shade> = named
        .map(|(reason, seconds)| (Some(*reason), colour(*reason), *seconds))
        .collect();
    if rest > 0.0 {
        shades.push((None, OTHERS, rest));
    }
    shades
}

/// An interval of a lane: start and end, seconds; the share that is permitted; `true` if a permit in it was false.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Interval {
    from_s: f64,
    to_s: f64,
    share: f64,
    wrong: bool,
}

/// Returns the intervals of a rule: each estimate is valid until the next one.
fn intervals(replay: &Replay<'_>, counts: impl Fn(&Bucket) -> RuleCounts) -> Vec<Interval> {
    let timeline = replay.timeline();
    let at = |index: usize| timeline.start_s() + index as f64 * timeline.width_s();
    let mut all: Vec<Interval> = Vec::new();
    for (index, bucket) in timeline.buckets().iter().enumerate() {
        if bucket.estimates == 0 {
            continue;
        }
        if let Some(before) = all.last_mut() {
            before.to_s = at(index);
        }
        let rule = counts(bucket);
        all.push(Interval {
            from_s: at(index),
            to_s: at(index + 1),
            share: rule.permits as f64 / rule.judged as f64,
            wrong: rule.false_permits > 0,
        });
    }
    joined(all)
}

/// Joins equal neighbours, and removes intervals without a share: nothing in them was judged.
fn joined(mut all: Vec<Interval>) -> Vec<Interval> {
    all.dedup_by(|next, before| {
        let is_equal = next.share == before.share && next.wrong == before.wrong;
        let is_joined = is_equal && next.from_s - before.to_s < 1e-9;
        if is_joined {
            before.to_s = next.to_s;
        }
        is_joined
    });
    all.retain(|interval| interval.share.is_finite());
    all
}

/// Draws the lanes from `top` on; their height is [`HEIGHT`].
pub(super) fn lanes(picture: &mut Picture, replay: &Replay<'_>, axis: Axis, top: f64) {
    let mut top = ticks(picture, replay, axis, top);
    top = verdicts(picture, replay, axis, top);
    top = interlock(picture, replay, axis, top);
    top = reasons(picture, replay, axis, top);
    top += APART;
    let limits = limits(&Thresholds::IN_USE);
    for (rule, (name, limit)) in ["distance", "sigma", "ellipse"]
        .iter()
        .zip(limits)
        .enumerate()
    {
        names(picture, top, &[name, &limit]);
        let counts = |bucket: &Bucket| bucket.rules.get(rule).copied().unwrap_or_default();
        let all = intervals(replay, counts);
        if all.is_empty() {
            let font = Font::new(11.0, palette::FAINT).anchored(Anchor::Middle);
            let words = "not judged: the estimates have no covariance";
            picture.text([LEFT + 0.5 * WIDTH, top + 0.5 * LANE + 4.0], words, &font);
        }
        for interval in all {
            bar(picture, axis, top, &interval, [&PERMIT, &DENIAL]);
            if interval.wrong {
                let [x, wide] = place(axis, &interval);
                picture.rectangle([x, top, wide, 5.0], &WRONG);
            }
        }
        frame(picture, top);
        top += LANE + BETWEEN;
    }
}

/// Returns the limits of the rules as text.
fn limits(thresholds: &Thresholds) -> [String; 3] {
    let degrees = number(thresholds.sigma_yaw_rad.to_degrees());
    [
        format!("to the goal < {} m", number(thresholds.distance_m)),
        format!("x, y < {} m; yaw < {degrees}°", number(thresholds.sigma_m)),
        format!(
            "{}σ < {} m; side < {} m",
            number(thresholds.ellipse_scale),
            number(thresholds.ellipse_m),
            number(thresholds.ellipse_lateral_m)
        ),
    ]
}

/// Writes the name of a lane, and its limits below it.
fn names(picture: &mut Picture, top: f64, lines: &[&str]) {
    let heights: &[f64] = if lines.len() > 1 {
        &[11.0, 23.0]
    } else {
        &[17.0]
    };
    let fonts = [
        Font::new(11.0, palette::INK),
        Font::new(10.0, palette::FAINT),
    ];
    for ((line, height), font) in lines.iter().zip(heights).zip(fonts) {
        let at = [LEFT - 8.0, top + height];
        picture.text(at, line, &font.anchored(Anchor::End));
    }
}

fn frame(picture: &mut Picture, top: f64) {
    let style = Style::outlined(palette::FRAME, 1.0);
    picture.rectangle([LEFT, top, WIDTH, LANE], &style);
}

/// Returns the x coordinate of an interval and its width: at least a pixel.
fn place(axis: Axis, interval: &Interval) -> [f64; 2] {
    let x = axis.x(interval.from_s);
    [x, (axis.x(interval.to_s) - x).max(1.0)]
}

/// Draws an interval: its share in the first style, below the rest in the second.
fn bar(
    picture: &mut Picture,
    axis: Axis,
    top: f64,
    interval: &Interval,
    [style, rest]: [&Style; 2],
) {
    let [x, wide] = place(axis, interval);
    let high = LANE * interval.share;
    picture.rectangle([x, top, wide, LANE - high], rest);
    if high > 0.0 {
        picture.rectangle([x, top + LANE - high, wide, high], style);
    }
}

/// Draws a tick for each moment with estimates.
fn ticks(picture: &mut Picture, replay: &Replay<'_>, axis: Axis, top: f64) -> f64 {
    let timeline = replay.timeline();
    let font = Font::new(11.0, palette::INK).anchored(Anchor::End);
    picture.text([LEFT - 8.0, top + TICKS - 1.0], "estimates", &font);
    for (index, bucket) in timeline.buckets().iter().enumerate() {
        if bucket.estimates > 0 {
            let x = axis.x(timeline.start_s() + (index as f64 + 0.5) * timeline.width_s());
            picture.line(&[[x, top], [x, top + TICKS]], &TICK);
        }
    }
    top + TICKS + 6.0
}

/// Draws the verdicts: solid while the estimate is young enough, then pale until the next one.
fn verdicts(picture: &mut Picture, replay: &Replay<'_>, axis: Axis, top: f64) -> f64 {
    names(picture, top, &["gate", "each estimate alone"]);
    let counts = |bucket: &Bucket| RuleCounts {
        judged: bucket.estimates,
        permits: bucket.permits,
        false_permits: bucket.false_permits,
    };
    for interval in intervals(replay, counts) {
        bar(picture, axis, top, &interval, [&OLD, &DENIAL]);
    }
    let timeline = replay.timeline();
    let lasts = replay.maximum_age_s().max(timeline.width_s());
    let mut moments: Vec<Interval> = Vec::new();
    for (index, bucket) in timeline.buckets().iter().enumerate() {
        if bucket.permits == 0 {
            continue;
        }
        let from_s = timeline.start_s() + index as f64 * timeline.width_s();
        let next = timeline.buckets().iter().skip(index + 1);
        let free = next.take_while(|bucket| bucket.estimates == 0).count() + 1;
        let to_s = from_s + lasts.min(free as f64 * timeline.width_s());
        moments.push(Interval {
            from_s,
            to_s,
            share: bucket.permits as f64 / bucket.estimates as f64,
            wrong: bucket.false_permits > 0,
        });
    }
    for moment in joined(moments) {
        let [x, wide] = place(axis, &moment);
        let high = LANE * moment.share;
        picture.rectangle([x, top + LANE - high, wide, high], &PERMIT);
        if moment.wrong {
            picture.rectangle([x, top, wide, 5.0], &WRONG);
        }
    }
    frame(picture, top);
    top + LANE + BETWEEN
}

/// Draws the share of each moment for which the interlock was open.
fn interlock(picture: &mut Picture, replay: &Replay<'_>, axis: Axis, top: f64) -> f64 {
    let times = replay.interlock();
    let often = match times.openings {
        1 => "once".into(),
        count => format!("{count} times"),
    };
    let words = format!("open {:.1} s, {often}", times.open_s);
    names(picture, top, &["interlock", &words]);
    let lanes = &times.lanes;
    let at = |index: usize| lanes.start_s() + index as f64 * lanes.width_s();
    let all = lanes.spans().iter().enumerate();
    let all = all.map(|(index, span)| Interval {
        from_s: at(index),
        to_s: at(index + 1),
        // Full spans are equal but for rounding.
        share: (span.open_s() / span.all_s() * 1e6).round() / 1e6,
        wrong: false,
    });
    for interval in joined(all.collect()) {
        bar(picture, axis, top, &interval, [&PERMIT, &SHUT]);
    }
    frame(picture, top);
    top + LANE + BETWEEN
}

/// Draws the reasons why the interlock was shut, each as a share of each moment.
fn reasons(picture: &mut Picture, replay: &Replay<'_>, axis: Axis, top: f64) -> f64 {
    names(picture, top, &["reasons", "why it is shut"]);
    let lanes = &replay.interlock().lanes;
    let shades = shades(replay);
    let shares = |index: usize| -> Vec<i64> {
        let Some(span) = lanes.spans().get(index) else {
            return Vec::new();
        };
        let all = span.all_s();
        let named = |reason: Option<Reason>| reason.map_or(0.0, |reason| span.shut_s(reason));
        let known: f64 = shades.iter().map(|(reason, ..)| named(*reason)).sum();
        let rest = all - span.open_s() - known;
        let seconds = shades.iter().map(|(reason, ..)| match reason {
            Some(_) => named(*reason),
            None => rest,
        });
        // Full spans are equal but for rounding.
        seconds.map(|s| (s / all * 1e6).round() as i64).collect()
    };
    let mut start = 0;
    while start < lanes.spans().len() {
        let first = shares(start);
        let mut end = start + 1;
        while end < lanes.spans().len() && shares(end) == first {
            end += 1;
        }
        let at = |index: usize| axis.x(lanes.start_s() + index as f64 * lanes.width_s());
        let (x, wide) = (at(start), (at(end) - at(start)).max(1.0));
        let mut bottom = top + LANE;
        for (share, (_, style, _)) in first.iter().zip(&shades) {
            let high = LANE * *share as f64 / 1e6;
            if high > 0.0 {
                bottom -= high;
                picture.rectangle([x, bottom, wide, high], style);
            }
        }
        start = end;
    }
    frame(picture, top);
    top + LANE + BETWEEN
}
