//! Draws a replay: a map of its estimates; lanes over time for the gate, the interlock, the reasons and the rules in use today; margins; and the Stanford
//! diagram if the truth is known.

use super::legend::{LINE, Sample, legend};
use super::letters::number;
use super::palette;
use super::replay_lanes::{
    Axis, DENIAL, HEIGHT, LEFT, PERMIT, SHUT, SPARSE, WIDTH, WRONG, lanes, shades,
};
use super::replay_map::{self, ReplayMap};
use super::stanford;
use super::svg::{Anchor, Font, Picture, Style, literal};
use posegate_replay::replay::Replay;

const TOP: f64 = 52.0;
/// Height of the curve of margins.
const CURVE: f64 = 96.0;
/// Height of the time axis with its words.
const TIMES: f64 = 44.0;
/// Larger margins are drawn at this value.
const MOST_MARGIN: f64 = 3.0;

const MARGIN: Style = Style::outlined("#0072b2", 1.4);
const POINT: Style = Style::filled("#0072b2");
const LIMIT: Style = Style::outlined("#222222", 1.0).dashed("5 3");

/// Returns an SVG of a replay: its map; margins, rules and the interlock over time.
#[must_use]
pub fn replay_picture(title: &str, replay: &Replay<'_>) -> String {
    let with_truth = replay.stanford().points() > 0;
    let map = ReplayMap::of(replay);
    let mut entries = entries(replay, with_truth);
    if let Some(map) = &map {
        entries.splice(0..0, map.entries());
    }
    let entries: Vec<(Sample, &str)> = entries.iter().map(|(s, words)| (*s, &**words)).collect();
    let top = TOP + map.as_ref().map_or(0.0, |_| replay_map::HEIGHT);
    let bottom = top + HEIGHT;
    let legend_top = bottom + CURVE + TIMES;
    let legend_end = legend_top + entries.len() as f64 * LINE + 12.0;
    let diagram_top = legend_end + 22.0;
    let height = if with_truth {
        diagram_top + stanford::HEIGHT
    } else {
        legend_end
    };
    let mut picture = Picture::new(LEFT + WIDTH + 40.0, height, title);
    let bold = Font::new(17.0, palette::INK).bold();
    picture.text([20.0, 30.0], &literal(title), &bold);
    let axis = Axis::of(replay);
    if let Some(map) = &map {
        map.draw(&mut picture, TOP - 14.0);
    }
    lanes(&mut picture, replay, axis, top);
    margins(&mut picture, replay, axis, bottom);
    times(&mut picture, axis, bottom + CURVE);
    legend(&mut picture, [LEFT, legend_top], &entries);
    if with_truth {
        stanford::draw(&mut picture, [LEFT, diagram_top], replay.stanford());
    }
    picture.finish()
}

/// Returns the legend: one entry for each colour.
fn entries(replay: &Replay<'_>, with_truth: bool) -> Vec<(Sample, String)> {
    let mut entries = Vec::from([
        (
            Sample::Patch(PERMIT),
            "permitted, or open; paler: too old to be used, until the next estimate".to_string(),
        ),
        (
            Sample::Patch(DENIAL),
            "denied: of several estimates of a moment each has its share of the height".into(),
        ),
        (
            Sample::Patch(SHUT),
            "interlock shut, for the reasons below it:".into(),
        ),
    ]);
    // A reason of less than half the last digit has no visible part of a lane.
    let visible = shades(replay);
    let visible = visible.into_iter().filter(|(.., seconds)| *seconds >= 0.05);
    for (reason, style, seconds) in visible {
        let name = reason.map_or("other reasons", |reason| reason.name());
        let words = format!("{}, {seconds:.1} s", literal(name));
        entries.push((Sample::Patch(style), words));
    }
    if with_truth {
        let [(_, gate), _, rules @ ..] = replay.tallies();
        let falsely: Vec<String> = [("gate", gate)]
            .into_iter()
            .chain(rules)
            .filter(|(name, _)| *name != "ate")
            .map(|(name, tally)| format!("{name} {}", tally.false_permits))
            .collect();
        let words = "permitted with the true pose outside of the success set: estimates";
        entries.push((Sample::Patch(WRONG), words.into()));
        entries.push((Sample::Words, falsely.join(", ")));
    }
    entries.push((
        Sample::Line(MARGIN),
        "the smallest margin of a moment".into(),
    ));
    entries.push((
        Sample::Line(LIMIT),
        "a permit has a margin of 1 or more".into(),
    ));
    entries
}

/// Draws the curve of margins, its upper edge at `top`.
fn margins(picture: &mut Picture, replay: &Replay<'_>, axis: Axis, top: f64) {
    let small = Font::new(11.0, palette::INK);
    let end = small.anchored(Anchor::End);
    let bottom = top + CURVE;
    let height = |margin: f64| bottom - CURVE * margin.min(MOST_MARGIN) / MOST_MARGIN;
    picture.text([LEFT - 34.0, top + 0.5 * CURVE + 4.0], "margin", &end);
    for margin in [0.0, 1.0, 2.0, MOST_MARGIN] {
        let words = if margin == MOST_MARGIN {
            format!("≥ {}", number(margin))
        } else {
            number(margin)
        };
        picture.text([LEFT - 6.0, height(margin) + 4.0], &words, &end);
    }
    picture.line(&[[LEFT, height(1.0)], [LEFT + WIDTH, height(1.0)]], &LIMIT);
    let timeline = replay.timeline();
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (place, bucket) in timeline.buckets().iter().enumerate() {
        if bucket.least_margin.is_finite() {
            let time = timeline.start_s() + (place as f64 + 0.5) * timeline.width_s();
            points.push([axis.x(time), height(bucket.least_margin)]);
        }
    }
    picture.line(&points, &MARGIN);
    if points.len() <= SPARSE {
        for point in points {
            picture.circle(point, 1.8, &POINT);
        }
    }
    let frame = Style::outlined(palette::FRAME, 1.0);
    picture.rectangle([LEFT, top, WIDTH, CURVE], &frame);
}

/// Draws the axis of time below `bottom`.
fn times(picture: &mut Picture, axis: Axis, bottom: f64) {
    let frame = Style::outlined(palette::FRAME, 1.0);
    let middle = Font::new(11.0, palette::INK).anchored(Anchor::Middle);
    let tick = round_step(axis.span_s);
    let mut time = 0.0;
    while tick > 0.0 && time <= axis.span_s {
        let x = axis.x(axis.start_s + time);
        picture.line(&[[x, bottom], [x, bottom + 4.0]], &frame);
        picture.text([x, bottom + 17.0], &number(time), &middle);
        time += tick;
    }
    let words = format!("seconds after {:.3} s", axis.start_s);
    picture.text([LEFT + 0.5 * WIDTH, bottom + 34.0], &words, &middle);
}

/// Returns a step of 1, 2 or 5 times a power of ten that divides a span into 5 to 12 parts.
fn round_step(span: f64) -> f64 {
    if !(span > 0.0 && span.is_finite()) {
        return 0.0;
    }
    let decade = libm::pow(10.0, libm::floor(libm::log10(span / 5.0)));
    let rest = span / 5.0 / decade;
    let factor = if rest >= 5.0 {
        5.0
    } else if rest >= 2.0 {
        2.0
    } else {
        1.0
    };
    factor * decade
}

#[cfg(test)]
mod tests {
    use super::round_step;

    #[test]
    fn ticks_are_round() {
        for (span, step) in [
            (97.0, 10.0),
            (60.0, 10.0),
            (7.0, 1.0),
            (0.3, 0.05),
            (5000.0, 1000.0),
        ] {
            assert!(
                (round_step(span) / step - 1.0).abs() < 1e-12,
                "{span}: {}",
                round_step(span)
            );
        }
        assert_eq!(round_step(0.0), 0.0);
        assert_eq!(round_step(f64::NAN), 0.0);
    }
}
