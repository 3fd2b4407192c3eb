//! The facets of a success set: frames converted to small integers.
//!
//! Planes become one facet each, curves several chords. Facets that no pose of the table's extent needs are removed.
//! This choice is made by sampling headings; the result is proven afterwards like everything else.

use super::border::{Chord, HalfPlane, Region};
use super::frames::{self, Draft};
use super::{BakeError, BakeInput, parts, slab_start};
use crate::contain::facet_clearance_q14;
use crate::shape::{ConvexPart, SuccessSet, clipped, is_whole_circle};
use crate::table::{Axes, Cells, Facet, LARGEST_UNIT, LONGEST_LEVER};
use core::f64::consts::TAU;
use rayon::prelude::*;

/// The loss of the set that is accepted so that its facets can be proven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// The facets that are kept.
    pub keep: Keep,
    /// Every facet is moved inwards by this number of length units: where the lines of two chords meet, rounding can
    /// push them over the curve. More than [`Effort::ROUNDING`] are for chords that meet beyond it at some headings.
    pub inset: u8,
}

/// The facets of a piece that are kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Keep {
    /// Those that are needed at one of a few headings.
    #[default]
    Needed,
    /// Those that are needed at one of many headings, also to have no pose there: some pieces have poses at a few degrees only.
    NeededAtMany,
    /// All.
    All,
}

impl Effort {
    /// The largest inset that makes good only what rounding can do. A larger one may leave no pose.
    pub const ROUNDING: u8 = 12;
    /// The largest inset beyond that, micrometres.
    const WIDEST_UM: u32 = 60_000;

    /// The efforts to try, in this order.
    pub const EACH: [Self; 10] = [
        Self::new(Keep::Needed, 0),
        Self::new(Keep::Needed, 2),
        Self::new(Keep::NeededAtMany, 0),
        Self::new(Keep::NeededAtMany, 2),
        Self::new(Keep::All, 2),
        Self::new(Keep::All, Self::ROUNDING),
        // Some looks at a tag need one of these: `crates/posegate-site/tests/golden_tables.rs` has one.
        Self::new(Keep::All, 25),
        Self::new(Keep::All, 50),
        Self::new(Keep::All, 100),
        Self::new(Keep::All, 200),
    ];

    const fn new(keep: Keep, inset: u8) -> Self {
        Self { keep, inset }
    }

    /// Returns the inset in length units of 2^unit um.
    fn inset_at(self, unit: u8) -> f64 {
        let widest = Self::WIDEST_UM >> unit.min(31);
        f64::from(u32::from(self.inset).min(widest.max(u32::from(Self::ROUNDING))))
    }
}

/// The facet layout of a table before it is encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetPlan {
    /// Exponent k of the length unit, 2^k um.
    pub unit: u8,
    /// An estimate farther from the goal than this on a world axis is not inside, length units.
    pub reach: u16,
    /// The pieces.
    pub pieces: Vec<PiecePlan>,
}

impl FacetPlan {
    /// Largest number of frames of all pieces of a table.
    const MOST_FRAMES: usize = 255;

    /// Removes the last pieces, which add least, until the rest fits the format.
    pub fn fit(&mut self) {
        let frames = |pieces: &[PiecePlan]| pieces.iter().map(|p| p.frames.len()).sum::<usize>();
        while self.pieces.len() > 1 && frames(&self.pieces) > Self::MOST_FRAMES {
            self.pieces.pop();
        }
    }
}

/// One piece.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PiecePlan {
    /// Start of the arc relative to the goal's heading, 2^-32 turn.
    pub from: u32,
    /// Width of the arc, 2^-32 turn; `u32::MAX` for the whole circle.
    pub width: u32,
    /// The frames of the piece.
    pub frames: Vec<FramePlan>,
}

impl PiecePlan {
    /// Returns `true` if it has no facet: it contains no pose of the table's extent, so nothing bounds it. Tables have
    /// no such pieces.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }
}

/// One frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePlan {
    /// The axes of the facets' normals.
    pub axes: Axes,
    /// Length units. For world axes a point v of the robot, in its frame; for robot axes a point q of the world, from
    /// the goal.
    pub point: [i16; 2],
    /// The facets of the frame.
    pub facets: Vec<Facet>,
}

/// Number of headings at which a facet is evaluated.
const HEADINGS: usize = 121;
/// The larger number with which frames are chosen.
const SOME_HEADINGS: usize = 361;
/// The larger number with [`Keep::NeededAtMany`]: 0.2 degrees of a whole circle.
const MANY_HEADINGS: usize = 1_801;
/// Upper bound of the effect of a point's rounding between two of them (3 degrees of a whole circle), length units
/// times 2^14.
const BETWEEN_HEADINGS: f64 = 8.0;

/// Number of sampled poses along x, y and yaw that choose the parts of a non-convex set.
const LOOKS: [u32; 3] = [17, 17, 9];
/// Largest number of parts that become pieces.
const MOST_PARTS: usize = 24;

/// The length unit, and the table's extent and the goal in it.
struct Scale {
    unit: u8,
    reach: u16,
    metres: f64,
    goal: [f64; 2],
}

/// Returns the facets of an order's set.
pub(super) fn of_order(
    order: &BakeInput<'_>,
    cells: &Cells,
    effort: Effort,
) -> Result<FacetPlan, BakeError> {
    let set = order.success;
    let parts = parts::covering(set, parts::ranges(cells), LOOKS, MOST_PARTS);
    // A part that is empty within the extent is skipped.
    let drafts: Vec<(ConvexPart, Vec<Draft>)> = parts
        .into_iter()
        .filter_map(|part| frames::of_part(&part, cells).map(|drafts| (part, drafts)))
        .collect();
    if drafts.is_empty() {
        return Err(super::empty(order, cells));
    }
    let drafts = finest(set, cells, drafts, order)?;
    let all_drafts = || drafts.iter().flat_map(|(_, drafts)| drafts);
    let scale = scale(set, cells, all_drafts)?;
    let lever = lever(all_drafts(), &scale);
    let sagitta = sagitta(order);
    let mut pieces = Vec::new();
    for (part, drafts) in &drafts {
        let arcs = arcs(part, cells);
        let frames = drafts
            .iter()
            .map(|draft| frame(draft, &scale, lever, &arcs, sagitta, effort))
            .collect::<Option<Vec<FramePlan>>>();
        let Some(frames) = frames else {
            continue;
        };
        for (from, width) in arcs {
            let mut frames = match effort.keep {
                Keep::Needed => needed(&frames, (from, width), &scale, HEADINGS, false),
                Keep::NeededAtMany => needed(&frames, (from, width), &scale, MANY_HEADINGS, true),
                Keep::All => frames.clone(),
            };
            frames.retain(|frame| !frame.facets.is_empty());
            pieces.push(PiecePlan {
                from,
                width,
                frames,
            });
        }
    }
    if pieces.iter().all(PiecePlan::is_empty) {
        return Err(super::empty(order, cells));
    }
    Ok(FacetPlan {
        unit: scale.unit,
        reach: scale.reach,
        pieces,
    })
}

/// Returns the largest distance of a chord from its curve, metres.
fn sagitta(order: &BakeInput<'_>) -> f64 {
    (order.spec.step.xy / 2.0).clamp(1e-4, 0.05)
}

/// Returns the frames of the parts of a set, without those that no heading needs if that allows a smaller length unit: the farthest points
/// determine it, and the corners of what regions do not cover are far.
fn finest(
    set: &SuccessSet,
    cells: &Cells,
    drafts: Vec<(ConvexPart, Vec<Draft>)>,
    order: &BakeInput<'_>,
) -> Result<Vec<(ConvexPart, Vec<Draft>)>, BakeError> {
    if drafts.len() == 1 {
        return Ok(drafts);
    }
    fn all(drafts: &[(ConvexPart, Vec<Draft>)]) -> impl Iterator<Item = &Draft> {
        drafts.iter().flat_map(|(_, drafts)| drafts)
    }
    let known = scale(set, cells, || all(&drafts))?;
    let lever = lever(all(&drafts), &known);
    let wanted: Vec<Vec<bool>> = drafts
        .par_iter()
        .map(|(part, drafts)| {
            let arcs = arcs(part, cells);
            let frames = drafts
                .iter()
                .map(|draft| {
                    frame(
                        draft,
                        &known,
                        lever,
                        &arcs,
                        sagitta(order),
                        Effort::default(),
                    )
                })
                .collect::<Option<Vec<FramePlan>>>();
            let Some(frames) = frames else {
                return vec![true; drafts.len()];
            };
            let mut wanted = vec![false; drafts.len()];
            for arc in arcs {
                let needed = needed(&frames, arc, &known, SOME_HEADINGS, true);
                for (wanted, frame) in wanted.iter_mut().zip(needed) {
                    *wanted |= !frame.facets.is_empty();
                }
            }
            wanted
        })
        .collect();
    let nearest = drafts
        .iter()
        .zip(&wanted)
        .flat_map(|((_, drafts), wanted)| {
            drafts
                .iter()
                .zip(wanted)
                .filter_map(|(draft, wanted)| wanted.then_some(draft))
        });
    let nearest: Vec<&Draft> = nearest.collect();
    let finer = scale(set, cells, || nearest.iter().copied())?;
    if finer.unit >= known.unit {
        return Ok(drafts);
    }
    let kept = drafts
        .into_iter()
        .zip(wanted)
        .map(|((part, drafts), wanted)| {
            let mut wanted = wanted.into_iter();
            let drafts = drafts.into_iter().filter(|_| wanted.next().unwrap_or(true));
            (part, drafts.collect())
        });
    Ok(kept.collect())
}

/// Returns the arcs of headings of a set within the table's, 2^-32 turn above the goal's.
fn arcs(part: &ConvexPart, cells: &Cells) -> Vec<(u32, u32)> {
    let whole = cells.is_whole_circle();
    let from = slab_start(cells);
    let mut arcs = vec![[from, from + cells.yaw_span as i64]];
    let mut is_whole = whole;
    // Degrees that are whole units except for their rounding are kept (the proof allows for it).
    let units = |deg: f64| deg / 360.0 * 4_294_967_296.0;
    let up = |v: f64| libm::ceil(v - 1e-3) as i64;
    for shape in part.boxes().filter(|b| !is_whole_circle(b.yaw_deg)) {
        let own = [up(units(shape.yaw_deg[0])), -up(-units(shape.yaw_deg[1]))];
        arcs = if is_whole {
            vec![own]
        } else {
            let turns = (-2..=2i64).flat_map(|turns| {
                let [lo, hi] = own.map(|end| end + (turns << 32));
                arcs.iter().map(move |[a, b]| [lo.max(*a), hi.min(*b)])
            });
            turns.collect()
        };
        arcs.retain(|[lo, hi]| lo < hi);
        is_whole = false;
    }
    arcs.into_iter()
        .map(|[lo, hi]| {
            if is_whole {
                (0, u32::MAX)
            } else {
                // The format reads `u32::MAX` as the whole circle, so an arc that is slightly less ends a unit earlier.
                let widest = i64::from(u32::MAX - 1);
                (lo as u32, (hi - lo).min(widest) as u32)
            }
        })
        .collect()
}

/// Returns the smallest length unit in which every number of the layout fits.
fn scale<'a, D: Iterator<Item = &'a Draft>>(
    set: &SuccessSet,
    cells: &Cells,
    drafts: impl Fn() -> D,
) -> Result<Scale, BakeError> {
    let m = |um: i32| f64::from(um) * 1e-6;
    let goal = set.goal.yaw_deg.to_radians();
    let goal = [libm::cos(goal), libm::sin(goal)];
    let xs = [cells.x_lo_um, cells.x_hi_um()].map(m);
    let ys = [cells.y_lo_um, cells.y_hi_um()].map(m);
    // Per axis of the world.
    let corners = xs.iter().flat_map(|x| ys.map(|y| turned(goal, [*x, y])));
    let reach = corners.flatten().map(f64::abs).fold(0.0, f64::max);
    let lever = |draft: &Draft| {
        let [x, y] = match draft.axes {
            Axes::World => draft.point,
            Axes::Robot => turned(goal, draft.point),
        };
        x.abs() + y.abs()
    };
    let longest = |unit: f64| {
        let units = |v: f64| libm::ceil(v / unit) + 1.0;
        let reach = units(reach);
        let levers = drafts().map(|draft| match draft.axes {
            Axes::World => units(lever(draft)) + 1.0,
            Axes::Robot => units(lever(draft)) + 1.0 + 2.0 * reach,
        });
        // Offsets of facets are no larger than the extent's full width.
        (reach, levers.fold(2.0 * reach, f64::max))
    };
    for unit in 0..=LARGEST_UNIT {
        let metres = f64::from(1u32 << unit) * 1e-6;
        let (reach, lever) = longest(metres);
        if lever <= f64::from(LONGEST_LEVER) {
            return Ok(Scale {
                unit,
                reach: reach as u16,
                metres,
                goal,
            });
        }
    }
    Err(BakeError::NoPieces("the set reaches too far for facets"))
}

/// Transforms a vector from the goal's axes to the world's.
fn turned([c, s]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [c * x - s * y, s * x + c * y]
}

/// Returns the point of a frame, length units, before rounding: v belongs to the robot, q to the world.
fn point(draft: &Draft, scale: &Scale) -> [f64; 2] {
    let point = match draft.axes {
        Axes::World => draft.point,
        Axes::Robot => turned(scale.goal, draft.point),
    };
    point.map(|v| v / scale.metres)
}

/// Returns the layout's lever, as its reader computes it.
fn lever<'a>(drafts: impl Iterator<Item = &'a Draft>, scale: &Scale) -> u16 {
    let levers = drafts.map(|draft| {
        let [x, y] = point(draft, scale).map(|v| libm::round(v).abs() as u16);
        match draft.axes {
            Axes::World => x + y,
            Axes::Robot => x + y + 2 * scale.reach,
        }
    });
    levers.max().unwrap_or(0)
}

/// Converts a frame to integers; `None` if its region is empty.
fn frame(
    draft: &Draft,
    scale: &Scale,
    lever: u16,
    arcs: &[(u32, u32)],
    sagitta: f64,
    effort: Effort,
) -> Option<FramePlan> {
    let mut chords: Vec<Chord> = Vec::new();
    for plane in &draft.planes {
        match plane.segment(&draft.window) {
            Some(chord) => chords.push(chord),
            // The whole window is on one side of it.
            None if plane.slack(middle(&draft.window)) >= 0.0 => {}
            None => return None,
        }
    }
    if !draft.curves.is_empty() {
        let region = Region {
            curves: &draft.curves,
            window: &draft.window,
        };
        chords.extend(region.chords(&lattice(&draft.window), sagitta)?);
    }
    let world = matches!(draft.axes, Axes::World);
    let exact = point(draft, scale);
    let rounded = exact.map(libm::round);
    let moved = [rounded[0] - exact[0], rounded[1] - exact[1]];
    let turns = rounded != [0.0, 0.0] || !world;
    let turns_at: Vec<[f64; 2]> = arcs
        .iter()
        .flat_map(|arc| headings(*arc, scale, HEADINGS))
        .map(|yaw| [libm::cos(yaw), libm::sin(yaw)])
        .collect();
    let facet_of = |chord: &Chord| {
        let chord = if world {
            chord.map(|end| turned(scale.goal, end))
        } else {
            *chord
        };
        let along = [chord[1][0] - chord[0][0], chord[1][1] - chord[0][1]];
        let length = libm::hypot(along[0], along[1]);
        // Outward normal: the region is to the left.
        let [x, y] = [along[1] / length, -along[0] / length].map(|v| libm::round(v * 16_384.0));
        let facet = Facet {
            x: x as i16,
            y: y as i16,
            b: 0,
        };
        let clearance = facet_clearance_q14(facet, draft.axes, turns, scale.unit, lever);
        let ends = chord
            .iter()
            .map(|end| (x * end[0] + y * end[1]) / scale.metres);
        let least = ends.fold(f64::INFINITY, f64::min);
        // Rounding the point moves P: by R v in world axes, by -R' q in the robot's.
        let lost = turns_at.iter().map(|turn| {
            if world {
                let [mx, my] = turned(*turn, moved);
                x * mx + y * my
            } else {
                let [nx, ny] = turned(*turn, [x, y]);
                -(nx * moved[0] + ny * moved[1])
            }
        });
        let lost = lost.fold(f64::INFINITY, f64::min);
        let b = libm::floor((least + lost - clearance as f64 - BETWEEN_HEADINGS) / 16_384.0)
            - effort.inset_at(scale.unit);
        // A facet beyond the longest lever is beyond every pose of the table.
        let limit = f64::from(LONGEST_LEVER);
        (b <= limit).then(|| Facet {
            b: b.max(-limit) as i16,
            ..facet
        })
    };
    let mut facets: Vec<Facet> = chords.iter().filter_map(facet_of).collect();
    // Of parallel facets only the nearest one.
    facets.sort_by_key(|f| (f.x, f.y, f.b));
    facets.dedup_by_key(|f| (f.x, f.y));
    Some(FramePlan {
        axes: draft.axes,
        point: rounded.map(|v| v as i16),
        facets,
    })
}

/// Returns headings of the robot in the world over an arc.
fn headings((from, width): (u32, u32), scale: &Scale, count: usize) -> impl Iterator<Item = f64> {
    let radians = TAU / 4_294_967_296.0;
    let goal = libm::atan2(scale.goal[1], scale.goal[0]);
    (0..count).map(move |i| {
        let part = i as f64 / (count - 1) as f64;
        goal + (f64::from(from) + part * f64::from(width)) * radians
    })
}

fn middle(window: &[HalfPlane]) -> [f64; 2] {
    let [x1, x0, y1, y0] = [0, 1, 2, 3].map(|i| window[i].offset);
    [0.5 * (x1 - x0), 0.5 * (y1 - y0)]
}

/// Returns points of a window (its first four planes are a rectangle) as candidates for an inner point.
fn lattice(window: &[HalfPlane]) -> Vec<[f64; 2]> {
    let [x1, x0, y1, y0] = [0, 1, 2, 3].map(|i| window[i].offset);
    let at = |lo: f64, hi: f64, i: i32| lo + (hi - lo) * f64::from(i) / 48.0;
    (1..48)
        .flat_map(|i| (1..48).map(move |j| (i, j)))
        .map(|(i, j)| [at(-x0, x1, i), at(-y0, y1, j)])
        .collect()
}

/// A facet at a heading: a half-plane of positions, in world axes about the goal and length units.
struct Line {
    frame: usize,
    facet: usize,
    normal: [f64; 2],
    offset: f64,
}

/// Keeps the facets without which a piece would be larger at some heading. With `empty` also those without which it would have poses at a
/// heading where it has none.
fn needed(
    frames: &[FramePlan],
    arc: (u32, u32),
    scale: &Scale,
    count: usize,
    empty: bool,
) -> Vec<FramePlan> {
    let mut keep: Vec<Vec<bool>> = frames.iter().map(|f| vec![false; f.facets.len()]).collect();
    let far = 4.0 * f64::from(scale.reach);
    for yaw in headings(arc, scale, count) {
        let lines = lines(frames, yaw);
        for (i, line) in lines.iter().enumerate() {
            if !keep[line.frame][line.facet] && touches(line, i, &lines) {
                keep[line.frame][line.facet] = true;
            }
        }
        if !empty || middle_within(lines.iter(), far).is_some() {
            continue;
        }
        // The facet that cuts most off the middle of what the kept ones leave, until they leave nothing.
        loop {
            let kept = lines.iter().filter(|line| keep[line.frame][line.facet]);
            let Some([x, y]) = middle_within(kept, far) else {
                break;
            };
            let beyond = |line: &Line| line.normal[0] * x + line.normal[1] * y - line.offset;
            let open = lines.iter().filter(|line| !keep[line.frame][line.facet]);
            let Some(most) = open.max_by(|a, b| beyond(a).total_cmp(&beyond(b))) else {
                break;
            };
            keep[most.frame][most.facet] = true;
        }
    }
    frames
        .iter()
        .zip(&keep)
        .map(|(frame, keep)| FramePlan {
            facets: frame
                .facets
                .iter()
                .zip(keep)
                .filter_map(|(facet, keep)| keep.then_some(*facet))
                .collect(),
            ..frame.clone()
        })
        .collect()
}

/// Returns the facets at a heading.
fn lines(frames: &[FramePlan], yaw: f64) -> Vec<Line> {
    let (s, c) = (libm::sin(yaw), libm::cos(yaw));
    let mut lines = Vec::new();
    for (number, frame) in frames.iter().enumerate() {
        let [px, py] = frame.point.map(f64::from);
        for (index, facet) in frame.facets.iter().enumerate() {
            let [x, y] = [facet.x, facet.y].map(|v| f64::from(v) / 16_384.0);
            let (normal, shift) = match frame.axes {
                Axes::World => ([x, y], -(x * (c * px - s * py) + y * (s * px + c * py))),
                Axes::Robot => {
                    let normal = [c * x - s * y, s * x + c * y];
                    (normal, normal[0] * px + normal[1] * py)
                }
            };
            lines.push(Line {
                frame: number,
                facet: index,
                normal,
                offset: f64::from(facet.b) + shift,
            });
        }
    }
    lines
}

/// Returns the middle of the polygon that lines bound within a square of half width `far`, each moved outwards by two units; `None` if it
/// is empty.
fn middle_within<'a>(lines: impl Iterator<Item = &'a Line>, far: f64) -> Option<[f64; 2]> {
    let mut polygon = vec![[far, far], [-far, far], [-far, -far], [far, -far]];
    for line in lines {
        let [x, y] = line.normal;
        polygon = clipped(&polygon, |p| line.offset + 2.0 - x * p[0] - y * p[1]);
        if polygon.is_empty() {
            return None;
        }
    }
    let count = polygon.len() as f64;
    Some([0, 1].map(|axis| polygon.iter().map(|p| p[axis]).sum::<f64>() / count))
}

/// Returns `true` if a line bounds the polygon of all lines, with each of the others moved outwards by a unit.
fn touches(line: &Line, index: usize, lines: &[Line]) -> bool {
    let [nx, ny] = line.normal;
    let square = nx * nx + ny * ny;
    let foot = [nx * line.offset / square, ny * line.offset / square];
    let along = [-ny, nx];
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for (other, with) in lines.iter().enumerate() {
        if other == index {
            continue;
        }
        let rate = with.normal[0] * along[0] + with.normal[1] * along[1];
        let room = with.offset + 1.0 - with.normal[0] * foot[0] - with.normal[1] * foot[1];
        if rate > 1e-9 {
            high = high.min(room / rate);
        } else if rate < -1e-9 {
            low = low.max(room / rate);
        } else if room < 0.0 {
            return false;
        }
    }
    low < high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_insets_are_limited_in_metres() {
        let inset = |inset, unit| Effort::new(Keep::All, inset).inset_at(unit);
        let found = [inset(200, 8), inset(200, 12), inset(200, 31), inset(2, 12)];
        assert_eq!(found, [200.0, 14.0, 12.0, 2.0]);
    }
}
