//! The mounting sheet: A4 pages with one block per tag, for the person who mounts the tags and measures their poses.

mod block;
mod elevation;
mod place;
#[cfg(test)]
mod tests;

use super::letters::{escaped, literal, number};
use super::measure::fitted;
use super::palette;
use super::svg::{Anchor, Font, Picture, Style};
use posegate::shape::{Tag, Tolerance, Wall};

/// A tag that is to be mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct Mounted {
    /// The tag's name in the site file.
    pub name: String,
    /// The tag's family, such as `tag36h11`.
    pub family: String,
    /// The tag's number, size and pose.
    pub tag: Tag,
    /// Installation error for which the tasks are proven; `None` if none is known.
    pub reserve: Option<Tolerance>,
    /// The additional error beyond the reserve, in centimetres and degrees; `None` if it is not known.
    pub left: Option<f64>,
}

/// What a mounting sheet shows.
#[derive(Clone, Copy, Debug)]
pub struct MountingSheet<'a> {
    /// Heading of each page.
    pub title: &'a str,
    /// Which data the places come from, below the heading: the name of the site file and its digest.
    pub origin: &'a str,
    /// The tags, in the order of their blocks.
    pub tags: &'a [Mounted],
    /// The walls of the site.
    pub walls: &'a [Wall],
}

/// Width and height of an A4 page, pixels of 1/96 inch.
const PAGE: [f64; 2] = [794.0, 1123.0];
/// The printable part: printers leave 1 cm at each side.
const SIDES: [f64; 2] = [40.0, 754.0];
const TOP: f64 = 84.0;
const BLOCK: f64 = 494.0;
const BLOCKS_A_PAGE: usize = 2;
/// Space between pages in one picture, pixels.
const GAP: f64 = 24.0;

const NOTES: [&str; 2] = [
    "Places are those of the tag's middle. Heights are above the site's floor (z = 0); angles are counter-clockwise from above.",
    "Left and right are those of a person who faces the wall. Write the measured values into the site file, and check it again.",
];

/// Returns the sheet as an SVG: the A4 pages one below the other, 794 pixels (210 mm) wide. Pages have the same content as those of
/// [`mounting_sheet_html`], which prints each on its own sheet of paper.
#[must_use]
pub fn mounting_sheet(sheet: &MountingSheet<'_>) -> String {
    let mut pages = pages(sheet);
    if pages.len() == 1 {
        return pages.remove(0);
    }
    let step = PAGE[1] + GAP;
    let height = step * pages.len() as f64 - GAP;
    let body: String = (0..)
        .zip(&pages)
        .map(|(index, page)| {
            let top = number(step * f64::from(index));
            page.replacen("<svg ", &format!("<svg y=\"{top}\" "), 1)
        })
        .collect();
    let [width, height] = [PAGE[0], height].map(number);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<rect width=\"{width}\" height=\"{height}\" fill=\"#dddddd\"/>\n{body}</svg>\n",
        escaped(sheet.title)
    )
}

/// Returns the sheet as an HTML file that prints each page on one sheet of A4 paper.
#[must_use]
pub fn mounting_sheet_html(sheet: &MountingSheet<'_>) -> String {
    let title_text = escaped(sheet.title);
    let pages = pages(sheet).concat();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>{title_text}</title>\n<style>\n@page {{ size: A4 portrait; margin: 0; }}\nbody {{ margin: 0; }}\nsvg {{ display: block; width: 210mm; height: 296.9mm; margin: 0 auto; break-after: page; }}\nsvg:last-child {{ break-after: auto; }}\n</style>\n</head>\n<body>\n{pages}</body>\n</html>\n"
    )
}

/// Draws each page as a picture of its own.
fn pages(sheet: &MountingSheet<'_>) -> Vec<String> {
    let &MountingSheet {
        title,
        origin,
        tags,
        walls,
    } = sheet;
    let of = tags.len().div_ceil(BLOCKS_A_PAGE).max(1);
    let blocks: Vec<&[Mounted]> = if tags.is_empty() {
        vec![&[]]
    } else {
        tags.chunks(BLOCKS_A_PAGE).collect()
    };
    let page = |(index, tags): (usize, &&[Mounted])| {
        let mut picture = Picture::new(PAGE[0], PAGE[1], &literal(title));
        let font = Font::new(19.0, palette::INK).bold();
        let heading = fitted(&literal(title), 19.0, true, 560.0);
        picture.text([SIDES[0], 46.0], &heading, &font);
        let origin = fitted(&literal(origin), 11.0, false, SIDES[1] - SIDES[0]);
        let small = Font::new(11.0, palette::FAINT);
        picture.text([SIDES[0], 64.0], &origin, &small);
        let count = format!("page {} of {of}", index + 1);
        let right = Font::new(12.0, palette::FAINT).anchored(Anchor::End);
        picture.text([SIDES[1], 46.0], &count, &right);
        for (row, mounted) in tags.iter().enumerate() {
            let top = TOP + BLOCK * row as f64;
            let rule = [[SIDES[0], top - 14.0], [SIDES[1], top - 14.0]];
            picture.line(&rule, &Style::outlined(palette::FRAME, 1.0));
            block::draw(&mut picture, top, mounted, walls);
        }
        let foot = Font::new(11.0, palette::FAINT);
        for (row, note) in NOTES.into_iter().enumerate() {
            picture.text([SIDES[0], 1084.0 + 15.0 * row as f64], note, &foot);
        }
        picture.finish()
    };
    blocks.iter().enumerate().map(page).collect()
}
