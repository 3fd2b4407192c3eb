//! Curves on logarithmic axes, to show the growth of a cost.

use posegate_show::draw::palette;
use posegate_show::draw::scene::{Anchor, Font, Picture, Sample, Style, legend, literal};

const LEFT: f64 = 74.0;
const TOP: f64 = 56.0;
const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 320.0;
/// Line styles that can be distinguished without colour.
const LINES: [Style; 3] = [
    Style::outlined("#0072b2", 2.0),
    Style::outlined("#d55e00", 2.0).dashed("6 3"),
    Style::outlined("#009e73", 2.0).dashed("2 3"),
];

/// Returns an SVG of curves of points (x, y), all above zero, on logarithmic axes; at most three.
#[must_use]
pub fn logarithmic(title: &str, axes: [&str; 2], curves: &[(&str, &[[f64; 2]])]) -> String {
    let decades = |axis: usize| -> [i32; 2] {
        let all = curves.iter().flat_map(|(_, points)| points.iter());
        let logs: Vec<f64> = all.map(|point| libm::log10(point[axis])).collect();
        let lo = logs.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if !(lo.is_finite() && hi.is_finite()) {
            return [0, 1];
        }
        let lo = libm::floor(lo + 1e-9) as i32;
        [lo, (libm::ceil(hi - 1e-9) as i32).max(lo + 1)]
    };
    let (across, up) = (decades(0), decades(1));
    let share = |[lo, hi]: [i32; 2], log: f64| (log - f64::from(lo)) / f64::from(hi - lo);
    let at = |x: f64, y: f64| {
        [
            LEFT + WIDTH * share(across, x),
            TOP + HEIGHT * (1.0 - share(up, y)),
        ]
    };
    let bottom = TOP + HEIGHT;
    let mut picture = Picture::new(
        LEFT + WIDTH + 40.0,
        bottom + 62.0 + 22.0 * curves.len() as f64,
        title,
    );
    let bold = Font::new(17.0, palette::INK).bold();
    picture.text([24.0, 32.0], &literal(title), &bold);
    let (frame, faint) = (
        Style::outlined(palette::FRAME, 1.0),
        Style::outlined("#cccccc", 0.7),
    );
    let label = Font::new(11.0, palette::INK);
    for decade in across[0]..=across[1] {
        let [x, _] = at(f64::from(decade), f64::from(up[0]));
        picture.line(&[[x, TOP], [x, bottom]], &faint);
        let middle = label.anchored(Anchor::Middle);
        picture.text([x, bottom + 16.0], &power(decade), &middle);
    }
    for decade in up[0]..=up[1] {
        let [_, y] = at(f64::from(across[0]), f64::from(decade));
        picture.line(&[[LEFT, y], [LEFT + WIDTH, y]], &faint);
        let end = label.anchored(Anchor::End);
        picture.text([LEFT - 6.0, y + 4.0], &power(decade), &end);
    }
    picture.rectangle([LEFT, TOP, WIDTH, HEIGHT], &frame);
    let middle = label.anchored(Anchor::Middle);
    picture.text([LEFT + 0.5 * WIDTH, bottom + 32.0], axes[0], &middle);
    picture.text_turned([22.0, TOP + 0.5 * HEIGHT], -90.0, axes[1], &middle);
    let mut entries: Vec<(Sample, &str)> = Vec::new();
    for ((name, points), style) in curves.iter().zip(LINES) {
        let points: Vec<[f64; 2]> = points
            .iter()
            .map(|[x, y]| at(libm::log10(*x), libm::log10(*y)))
            .collect();
        picture.line(&points, &style);
        for point in &points {
            picture.circle(*point, 3.0, &style);
        }
        entries.push((Sample::Line(style), name));
    }
    legend(&mut picture, [LEFT, bottom + 44.0], &entries);
    picture.finish()
}

fn power(decade: i32) -> String {
    if (0..=4).contains(&decade) {
        format!("{}", 10_i64.pow(decade.unsigned_abs()))
    } else if (-3..0).contains(&decade) {
        format!(
            "{:.*}",
            decade.unsigned_abs() as usize,
            libm::pow(10.0, f64::from(decade))
        )
    } else {
        format!("1e{decade}")
    }
}
