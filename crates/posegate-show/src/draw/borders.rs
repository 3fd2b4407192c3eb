//! Borders of a set at a few of its headings, in small panels next to each other.

use super::letters::literal;
use super::palette;
use super::panel::{Panel, Window, signed, tick_at_scale};
use super::svg::{Font, Picture};

/// Largest number of headings.
const MOST: usize = 5;
const LEFT: f64 = 66.0;
const TOP: f64 = 84.0;
/// The largest panel, pixels.
const LARGEST: [f64; 2] = [190.0, 190.0];
/// Space between panels, pixels: horizontal and vertical.
const GAP: [f64; 2] = [40.0, 62.0];
/// Panels in a row: with three, A4 paper shows them at their own size.
const COLUMNS: usize = 3;

/// Returns an SVG of the borders at up to five headings, about evenly spaced, including the goal's. `sections` has headings
/// relative to the goal's in degrees, with closed polygons in metres of the goal frame.
#[must_use]
pub fn borders_picture(
    title: &str,
    window: &Window,
    sections: &[(f64, Vec<Vec<[f64; 2]>>)],
) -> String {
    let title = &literal(title);
    let last = sections.len().saturating_sub(1);
    let most = MOST.min(sections.len());
    let mut at: Vec<usize> = (0..most)
        .map(|k| k * last / most.saturating_sub(1).max(1))
        .collect();
    // Always includes the goal's own heading.
    let goal = sections.iter().position(|(yaw_deg, _)| *yaw_deg == 0.0);
    if let Some(goal) = goal
        && let Some(near) = at.iter_mut().min_by_key(|k| k.abs_diff(goal))
    {
        *near = goal;
    }
    let shown: Vec<_> = at.into_iter().filter_map(|k| sections.get(k)).collect();
    let first = Panel::fitted(*window, [LEFT, TOP], LARGEST);
    let pitch = [first.width() + GAP[0], first.height() + GAP[1]];
    let width = LEFT + pitch[0] * shown.len().clamp(1, COLUMNS) as f64;
    let rows = shown.len().div_ceil(COLUMNS).max(1);
    let height = TOP + pitch[1] * rows as f64 - 18.0;
    let mut picture = Picture::new(width.max(620.0), height, title);
    picture.text([24.0, 32.0], title, &Font::new(16.0, palette::INK).bold());
    let note = "In the frame of the goal; yaw counts from the goal's.";
    picture.text([24.0, 52.0], note, &Font::new(12.0, palette::FAINT));
    for (number, (yaw_deg, border)) in shown.into_iter().enumerate() {
        let panel = first.in_rows(number, COLUMNS, pitch);
        let empty = if border.is_empty() { ": empty" } else { "" };
        let title = format!("yaw {}°{empty}", signed(*yaw_deg));
        panel.draw(
            &mut picture,
            &title,
            tick_at_scale(first.scale, 42.0),
            |inside| {
                inside.polygons(border, &palette::AREA);
                inside.polygons(border, &palette::BORDER);
            },
        );
    }
    picture.finish()
}
