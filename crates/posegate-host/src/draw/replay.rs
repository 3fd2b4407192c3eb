//! Draws a replay: verdicts over time, and the Stanford diagram if the truth is known.

use super::legend::{LINE, Sample, legend};
use super::palette;
use super::stanford;
use super::svg::{Anchor, Font, Picture, Style, literal, number};
use crate::log::replay::{Bucket, Replay, Timeline};

const LEFT: f64 = 104.0;
const WIDTH: f64 = 620.0;
const TOP: f64 = 58.0;
/// Height of a lane of shares.
const LANE: f64 = 34.0;
/// Height of the curve of margins.
const CURVE: f64 = 96.0;
const BETWEEN: f64 = 16.0;
/// Larger margins are drawn at this value.
const MOST_MARGIN: f64 = 3.0;

const PERMIT: Style = Style::filled("#009e73");
const DENIAL: Style = Style::filled("#f3d2bd");
const WRONG: Style = Style::filled("#000000");
const MARGIN: Style = Style::outlined("#0072b2", 1.4);
const LIMIT: Style = Style::outlined("#222222", 1.0).dashed("5 3");

/// Draws a replay.
#[must_use]
pub fn replay_picture(title: &str, replay: &Replay<'_>) -> String {
    let with_truth = replay.stanford().points() > 0;
    let bottom = TOP + 2.0 * (LANE + BETWEEN) + CURVE;
    let legend_top = bottom + 44.0;
    let diagram_top = legend_top + 3.0 * LINE + 34.0;
    let height = if with_truth {
        diagram_top + stanford::HEIGHT
    } else {
        legend_top + 3.0 * LINE + 12.0
    };
    let mut picture = Picture::new(LEFT + WIDTH + 40.0, height, title);
    let bold = Font::new(17.0, palette::INK).bold();
    picture.text([20.0, 30.0], &literal(title), &bold);
    timeline(&mut picture, replay.timeline());
    let false_permits = replay.tallies()[0].1.false_permits;
    let wrong = format!("a permit whose true pose was outside: {false_permits}");
    let mut entries = Vec::from([
        (
            Sample::Patch(PERMIT),
            "permitted, and open: as a share of the estimates of a moment",
        ),
        (
            Sample::Line(MARGIN),
            "the smallest margin of a moment; a permit is above the broken line",
        ),
    ]);
    if with_truth {
        entries.push((Sample::Patch(WRONG), &wrong));
    }
    legend(&mut picture, [LEFT, legend_top], &entries);
    if with_truth {
        stanford::draw(&mut picture, [LEFT, diagram_top], replay.stanford());
    }
    picture.finish()
}

/// A lane of shares: its name, and the count of a bucket.
type Lane = (&'static str, fn(&Bucket) -> u64);

fn timeline(picture: &mut Picture, timeline: &Timeline) {
    let buckets = timeline.buckets();
    let step = WIDTH / buckets.len().max(1) as f64;
    let small = Font::new(11.0, palette::INK);
    let end = small.anchored(Anchor::End);
    let lanes: [Lane; 2] = [
        ("verdicts", |bucket| bucket.permits),
        ("gate open", |bucket| bucket.open),
    ];
    let frame = Style::outlined(palette::FRAME, 1.0);
    for (index, (name, count)) in lanes.iter().enumerate() {
        let top = TOP + index as f64 * (LANE + BETWEEN);
        picture.text([LEFT - 8.0, top + 0.5 * LANE + 4.0], name, &end);
        // Draw equal neighbours as one rectangle.
        let mut start = 0;
        let look = |bucket: &Bucket| {
            (bucket.estimates > 0).then(|| count(bucket) as f64 / bucket.estimates as f64)
        };
        while let Some(bucket) = buckets.get(start) {
            let share = look(bucket);
            let alike = buckets
                .iter()
                .skip(start)
                .take_while(|other| look(other) == share);
            let length = alike.count();
            let (x, wide) = (LEFT + start as f64 * step, length as f64 * step);
            if let Some(share) = share {
                picture.rectangle([x, top, wide, LANE], &DENIAL);
                picture.rectangle([x, top + LANE * (1.0 - share), wide, LANE * share], &PERMIT);
            }
            start += length;
        }
        picture.rectangle([LEFT, top, WIDTH, LANE], &frame);
    }
    for (place, _) in buckets
        .iter()
        .enumerate()
        .filter(|(_, b)| b.false_permits > 0)
    {
        let x = LEFT + place as f64 * step;
        picture.rectangle([x, TOP - 7.0, step.max(1.5), 6.0], &WRONG);
    }
    let top = TOP + 2.0 * (LANE + BETWEEN);
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
    let mut points: Vec<[f64; 2]> = Vec::new();
    for (place, bucket) in buckets.iter().enumerate() {
        if bucket.least_margin.is_finite() {
            points.push([
                LEFT + (place as f64 + 0.5) * step,
                height(bucket.least_margin),
            ]);
        }
    }
    picture.line(&points, &MARGIN);
    if let [point] = points.as_slice() {
        picture.circle(*point, 2.5, &MARGIN);
    }
    picture.rectangle([LEFT, top, WIDTH, CURVE], &frame);
    let span = timeline.width_s() * buckets.len() as f64;
    let tick = round_step(span);
    let middle = small.anchored(Anchor::Middle);
    let mut time = 0.0;
    while tick > 0.0 && time <= span {
        let x = LEFT + WIDTH * time / span;
        picture.line(&[[x, bottom], [x, bottom + 4.0]], &frame);
        picture.text([x, bottom + 17.0], &number(time), &middle);
        time += tick;
    }
    let words = format!("seconds after {:.3} s", timeline.start_s());
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
