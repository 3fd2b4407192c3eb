//! A task's success set, heading by heading.

use super::belief::PoseSetF64;
use super::legend::{LINE, Sample, legend, verdict};
use super::palette;
use super::panel::{Inside, Panel, Window, signed, tick_at_scale};
use super::pieces::pieces;
use super::section::covered;
use super::subject::{ContainmentResult, DrawError, Subject};
use super::svg::{Font, Picture, literal};
use posegate::set::Uncertainty;
use rayon::prelude::*;

const LEFT: f64 = 66.0;
/// Available width of a row of panels, pixels.
const WIDTH: f64 = 1060.0;
/// Space between panels, pixels.
const GAP: [f64; 2] = [50.0, 66.0];
/// The largest panel, pixels.
const LARGEST: [f64; 2] = [226.0, 210.0];
/// Largest number of headings.
const MOST: usize = 9;

/// Returns an SVG of sections of a task's success set at several headings, with the content of its table, and
/// with the pose-sets on top.
///
/// # Errors
/// [`DrawError::NoExtent`] if no extent can be chosen.
pub fn task_sections(subject: &Subject<'_>) -> Result<String, DrawError> {
    let (window, yaw_deg) = subject.extent()?;
    let headings = headings(yaw_deg, &subject.beliefs, subject.goal().yaw_deg);
    let first = Panel::fitted(window, [LEFT, 96.0], LARGEST);
    let pitch = [first.width() + GAP[0], first.height() + GAP[1]];
    let columns = ((WIDTH + GAP[0]) / pitch[0]).max(1.0) as usize;
    let rows = headings.len().div_ceil(columns);
    let columns = headings.len().div_ceil(rows);
    let held: Vec<ContainmentResult> = subject.beliefs.iter().map(|b| subject.held(b)).collect();

    let results = results(subject, &held);
    let top = first.top + 42.0 * results.len() as f64;
    let first = Panel { top, ..first };
    let below = top + rows as f64 * pitch[1] - 22.0;
    let entries = entries(subject, &held);
    let height = below + 8.0 + entries.len().div_ceil(2) as f64 * LINE + 12.0;
    let across = columns as f64 * pitch[0] - GAP[0];
    let width = (LEFT + across + 24.0).max(760.0);
    let title = format!(
        "Success set S of {}, heading by heading",
        literal(subject.name)
    );
    let mut picture = Picture::new(width, height, &title);
    picture.text([24.0, 32.0], &title, &Font::new(19.0, palette::INK).bold());
    let goal = subject.goal();
    let note = format!(
        "In the frame of the goal at ({} m, {} m, {}°). Where the robot's reference point may be at a heading; yaw counts from the goal's.",
        signed(goal.x),
        signed(goal.y),
        signed(goal.yaw_deg)
    );
    picture.text([24.0, 54.0], &note, &Font::new(12.0, palette::FAINT));
    let proof = proof(subject);
    for (row, (inside, bold)) in results.iter().enumerate() {
        let at = [24.0, 68.0 + 42.0 * row as f64];
        verdict(&mut picture, at, *inside, bold, &proof);
    }

    // A finer border than a pixel is not visible.
    let borders: Vec<Vec<Vec<[f64; 2]>>> = headings
        .par_iter()
        .map(|yaw_deg| subject.section(*yaw_deg, &window, 1.0 / first.scale))
        .collect();
    for (index, (yaw_deg, border)) in headings.iter().zip(&borders).enumerate() {
        let panel = first.in_rows(index, columns, pitch);
        let empty = if border.is_empty() { ": empty" } else { "" };
        let title = format!("yaw {}°{empty}", signed(*yaw_deg));
        panel.draw(
            &mut picture,
            &title,
            tick_at_scale(first.scale, 42.0),
            |inside| {
                inside.polygons(border, &palette::AREA);
                table_at(subject, *yaw_deg, &window, inside);
                inside.polygons(border, &palette::BORDER);
                for (belief, held) in subject.beliefs.iter().zip(&held) {
                    pose_set(subject, belief, held.inside, *yaw_deg, inside);
                }
            },
        );
    }
    let half = entries.len().div_ceil(2);
    let (first, second) = entries.split_at(half);
    legend(&mut picture, [LEFT, below + 4.0], first);
    legend(&mut picture, [LEFT + 350.0, below + 4.0], second);
    Ok(picture.finish())
}

/// Draws the content of the table at a heading.
fn table_at(subject: &Subject<'_>, yaw_deg: f64, window: &Window, inside: &mut Inside<'_>) {
    let Some(table) = &subject.table else {
        return;
    };
    inside.cells(&covered(table, yaw_deg), &palette::CELLS);
    for piece in pieces(table, yaw_deg, window) {
        inside.polygons(&[piece], &palette::PIECE);
    }
}

/// Draws the section of a pose-set that contains the heading, in the goal frame.
pub(super) fn pose_set(
    subject: &Subject<'_>,
    belief: &PoseSetF64,
    holds: bool,
    yaw_deg: f64,
    inside: &mut Inside<'_>,
) {
    let heading = (subject.goal().yaw_deg + yaw_deg).to_radians();
    if let Some(section) = belief.section(heading) {
        let points = section.iter().map(|p| subject.in_goal(*p)).collect();
        let style = palette::of_set(holds);
        // Many filled sets on top of each other would hide what is below.
        let style = if subject.beliefs.len() > 3 {
            style.without_fill()
        } else {
            style
        };
        inside.polygons(&[points], &style);
    }
}

/// Returns the results of the containment tests: one for each pose-set if their names differ, else one for all.
fn results(subject: &Subject<'_>, held: &[ContainmentResult]) -> Vec<(bool, String)> {
    let is_bounded = |set: &PoseSetF64| matches!(set.spread, Uncertainty::Bounded { .. });
    if held.len() > 1 && !subject.beliefs.iter().all(is_bounded) {
        let within = held.iter().filter(|held| held.inside).count();
        let words = format!("{within} of {} pose-sets are inside", held.len());
        return vec![(within == held.len(), words)];
    }
    let each = subject.beliefs.iter().zip(held);
    each.map(|(set, ContainmentResult { inside, words })| {
        let words = format!("The pose-set of {}: {words}", name_of(set));
        (*inside, words)
    })
    .collect()
}

fn proof(subject: &Subject<'_>) -> String {
    let proven = if subject.table.is_some() {
        "by the gate, on the table"
    } else {
        "without a table: looked at, not proven"
    };
    match subject.left_out {
        0 => proven.into(),
        left_out => format!("{proven}; {left_out} more estimates are not drawn"),
    }
}

/// Returns the name of a pose-set.
pub(super) fn name_of(belief: &PoseSetF64) -> String {
    match belief.spread {
        Uncertainty::Bounded {
            translation_m,
            yaw_rad,
        } => format!(
            "{} m / {}° about the goal",
            super::letters::number(translation_m),
            super::letters::number(yaw_rad.to_degrees())
        ),
        Uncertainty::Gaussian(_) => "the estimate".into(),
    }
}

fn entries(subject: &Subject<'_>, held: &[ContainmentResult]) -> Vec<(Sample, &'static str)> {
    let mut entries = std::vec![
        (Sample::Line(palette::BORDER), "exact border of S"),
        (Sample::Patch(palette::AREA), "S"),
    ];
    if let Some(table) = &subject.table {
        if table.grid().is_some() {
            entries.push((Sample::Patch(palette::CELLS), "cells of the table: proven"));
        }
        if table.facets().is_some() {
            entries.push((Sample::Patch(palette::PIECE), "pieces of the table: proven"));
        }
    }
    entries.extend(of_sets(held));
    entries
}

/// Returns the entries of a legend for pose-sets.
pub(super) fn of_sets(held: &[ContainmentResult]) -> Vec<(Sample, &'static str)> {
    let all = [
        (true, palette::INSIDE, "pose-set that is inside"),
        (false, palette::NOT_INSIDE, "pose-set that is not inside"),
    ];
    let drawn = all
        .into_iter()
        .filter(|(inside, ..)| held.iter().any(|held| held.inside == *inside));
    drawn
        .map(|(_, style, words)| (Sample::Disc(style), words))
        .collect()
}

/// Returns round headings over a range of degrees, and the end headings of a single bounded pose-set.
fn headings([lo, hi]: [f64; 2], beliefs: &[PoseSetF64], goal_deg: f64) -> Vec<f64> {
    const STEPS: [f64; 14] = [
        0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 10.0, 15.0, 20.0, 30.0, 45.0, 90.0,
    ];
    let at = |step: f64| super::panel::multiples([lo, hi], step);
    let ends: Vec<f64> = match beliefs {
        [
            PoseSetF64 {
                estimate,
                spread: Uncertainty::Bounded { yaw_rad, .. },
                ..
            },
        ] => {
            let middle = estimate[2].to_degrees() - goal_deg;
            let ends = [-1.0, 1.0].map(|way| middle + way * yaw_rad.to_degrees());
            ends.into_iter()
                .filter(|end| (lo..=hi).contains(end))
                .collect()
        }
        _ => Vec::new(),
    };
    let slots = MOST - ends.len();
    let step = STEPS.into_iter().find(|step| at(*step).count() <= slots);
    let step = step.unwrap_or(90.0);
    let mut headings: Vec<f64> = at(step)
        // Drop headings near a pose-set's end, except the goal's.
        .filter(|heading| {
            let near = if *heading == 0.0 { 1e-6 } else { 0.45 * step };
            ends.iter().all(|end| (heading - end).abs() > near)
        })
        // The two ends of the full circle are the same heading.
        .filter(|heading| !(hi - lo >= 360.0 - 1e-9 && *heading >= lo + 360.0 - 1e-6))
        .chain(ends.iter().copied())
        .collect();
    headings.sort_by(f64::total_cmp);
    if headings.is_empty() {
        headings.push(0.5 * (lo + hi));
    }
    headings
}

#[cfg(test)]
mod tests {
    use super::*;
    use posegate::set::RadiusSquared;

    #[test]
    fn headings_are_round_and_have_the_pose_sets_ends() {
        assert_eq!(
            headings([-16.0, 16.0], &[], 0.0),
            [-16.0, -12.0, -8.0, -4.0, 0.0, 4.0, 8.0, 12.0, 16.0]
        );
        let expected = PoseSetF64 {
            estimate: [0.0, 0.0, 90.0_f64.to_radians()],
            spread: Uncertainty::Bounded {
                translation_m: 1.0,
                yaw_rad: 7.0_f64.to_radians(),
            },
            radius_squared: RadiusSquared::LARGEST,
        };
        let got = headings([-16.0, 16.0], &[expected], 90.0);
        let rounded: Vec<f64> = got.iter().map(|h| libm::round(h * 1e6) * 1e-6).collect();
        assert_eq!(rounded, [-15.0, -10.0, -7.0, 0.0, 7.0, 10.0, 15.0]);
        let narrow = PoseSetF64 {
            spread: Uncertainty::Bounded {
                translation_m: 1.0,
                yaw_rad: 1.0_f64.to_radians(),
            },
            ..expected
        };
        assert!(headings([-16.0, 16.0], &[narrow], 90.0).contains(&0.0));
        assert_eq!(
            headings([-180.0, 180.0], &[], 0.0),
            [-180.0, -135.0, -90.0, -45.0, 0.0, 45.0, 90.0, 135.0]
        );
        assert_eq!(headings([0.021, 0.022], &[], 0.0).len(), 1);
    }
}
