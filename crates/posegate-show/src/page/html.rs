//! The HTML text of the page.

use serde_json::{Value, json};

use super::contents::{Contents, PageError, PageInput, Shown, ShownChain};
use super::equal_tasks::{area, groups_of_equal};
use super::figures::{escaped, figure, folded, numbers, table};
use super::summary::summary;
use crate::draw::{
    Mounted, MountingSheet, SeenFrom, Subject, borders_picture, mounting_sheet, task_plan,
};
use data_encoding::BASE64;
use posegate::shape::{Pose3Deg, PoseDeg, Tag};
use posegate::table::Table;
use posegate_files::printable::fixed;
use posegate_plan::{ChainReport, StepKind, margin_text};
use posegate_replay::factor_text;
use posegate_site::{Site, SiteTag, TaskKind};

const PAGE: &str = include_str!("template/page.html");
const STYLE: &str = include_str!("template/style.css");
const CORE_SCRIPT: &str = include_str!("template/core.js");
const SCRIPT: &str = include_str!("template/page.js");

/// Returns the page of a site, one HTML file. The bytes are the same for the same site and version.
///
/// # Errors
/// [`PageError`] if a placement does not belong to the site.
pub fn page(order: &PageInput<'_>, contents: &Contents) -> Result<String, PageError> {
    let site = order.site;
    let placements = placements(order)?;
    let pictures: Vec<String> = order
        .pictures
        .iter()
        .map(|(title, svg)| figure(svg, title))
        .collect();
    let sections = [
        ("plan", "The site", plan(site, contents)),
        ("chains", "Plans and chains", chains(contents)),
        ("tasks", "Tasks", tasks(site, contents)),
        ("placements", "Best places of tags", placements),
        ("pictures", "Pictures", pictures.join("")),
        ("tags", "Mounting sheet", tags(site, &order.file)),
    ];
    let shown = || sections.iter().filter(|(_, _, text)| !text.is_empty());
    let nav: Vec<String> = shown()
        .map(|(id, title, _)| format!("<a href=\"#{id}\">{title}</a>"))
        .collect();
    let body: Vec<String> = shown()
        .map(|(id, title, text)| {
            format!("<section id=\"{id}\">\n<h2>{title}</h2>\n{text}</section>\n")
        })
        .collect();
    let tasks: Vec<(&str, Value)> = contents
        .tasks
        .iter()
        .filter_map(|task| Some((task.name.as_str(), task.to_json(site)?)))
        .collect();
    // Options are identified by number: a browser collapses spaces in an option's text.
    let options: Vec<String> = tasks
        .iter()
        .enumerate()
        .map(|(number, (name, _))| format!("<option value=\"{number}\">{}</option>", escaped(name)))
        .collect();
    let tasks: Vec<Value> = tasks.into_iter().map(|(_, task)| task).collect();
    let data =
        json!({ "core": BASE64.encode(super::CORE), "epsilon": site.epsilon, "tasks": tasks });
    // The data must not contain the end of the script element.
    let data = data.to_string().replace('<', "\\u003c");
    let parts = [
        ("title", escaped(&order.title)),
        ("version", env!("CARGO_PKG_VERSION").to_string()),
        ("digest", site.digest_text()),
        ("nav", nav.join("")),
        ("summary", summary(site, contents)),
        ("options", options.join("")),
        ("style", STYLE.trim().into()),
        ("core", CORE_SCRIPT.into()),
        ("script", SCRIPT.trim().into()),
        ("body", body.join("")),
        ("data", data),
    ];
    Ok(filled(PAGE, &parts))
}

/// Replaces each `{{name}}` of a template once. Inserted text is not scanned again.
fn filled(template: &str, parts: &[(&str, String)]) -> String {
    let mut out = String::new();
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        let part = parts.iter().find(|(known, _)| *known == name);
        out.push_str(part.map_or("", |(_, text)| text));
        rest = after;
    }
    out.push_str(rest);
    out
}

fn plan(site: &Site, contents: &Contents) -> String {
    let mut text = figure(
        &contents.plan,
        "The site from above: walls, tags and which way they look, goals, routes and where the robots look",
    );
    let goals = site.tasks.iter().map(|(name, task)| {
        let PoseDeg { x, y, yaw_deg } = task.success.goal;
        vec![name.clone(), fixed(x, 3), fixed(y, 3), fixed(yaw_deg, 2)]
    });
    let head = ["goal of", "x, m", "y, m", "yaw, deg"];
    text += &numbers("the goals of the site", &head, goals);
    let walls = site.walls.iter().map(|wall| {
        let corners = wall.corners.iter();
        let corners: Vec<String> = corners.map(|[x, y]| format!("({x:.3}, {y:.3})")).collect();
        let [low, high] = wall.z.map(|z| format!("{z:.3}"));
        let ends = format!("{low} to {high}");
        vec![wall.name.clone(), corners.join(" "), ends]
    });
    if !site.walls.is_empty() {
        let head = ["wall", "corners, m", "z, m"];
        text += &numbers("the walls of the site", &head, walls);
    }
    text
}

fn tasks(site: &Site, contents: &Contents) -> String {
    let mut rows = Vec::new();
    for shown in &contents.tasks {
        let kind = match site.tasks.get(&shown.name).map(|task| task.kind) {
            Some(TaskKind::Work) => "work",
            Some(TaskKind::Localization) => "localization",
            _ => "",
        };
        let mut row = vec![shown.name.clone(), kind.to_string()];
        match &shown.table {
            Ok((bytes, proof)) => {
                let parsed = Table::parse(bytes).ok();
                let layout = match &parsed {
                    Some(table) if table.facets().is_some() => "facets",
                    Some(_) => "grid",
                    None => "",
                };
                let crc = parsed.map_or(0, |table| table.crc());
                row.extend([
                    layout.to_string(),
                    bytes.len().to_string(),
                    format!("{crc:08x}"),
                    format!("{} corners, {} cells", proof.corners, proof.cells),
                ]);
            }
            Err(why) => row.extend([format!("no table: {why}"), "".into(), "".into(), "".into()]),
        }
        rows.push(row);
    }
    for (name, why) in &contents.left_out {
        rows.push(vec![name.clone(), format!("not shown: {why}")]);
    }
    let mut text = table(&TASK_HEAD, rows);
    for group in groups_of_equal(site, &contents.tasks) {
        let Some((first, others)) = group.split_first() else {
            continue;
        };
        text += &one_task(first, others);
    }
    text
}

const TASK_HEAD: [&str; 6] = [
    "task",
    "kind",
    "layout",
    "bytes in flash",
    "CRC-32C",
    "proven",
];

/// Returns the figures of a task. Those of equal tasks are folded.
fn one_task(shown: &Shown, others: &[&Shown]) -> String {
    let name = escaped(&shown.name);
    let mut text = format!("<h3 id=\"task-{name}\">{name}</h3>\n");
    if !others.is_empty() {
        let names: Vec<&str> = others.iter().map(|other| other.name.as_str()).collect();
        text += &format!(
            "<p>{} tasks are equal in the frames of their goals. The pictures are those of {name}; the same holds for {}.</p>\n",
            others.len() + 1,
            escaped(&names.join(", "))
        );
    }
    text += &figures_of(shown);
    let folds = others.iter().map(|other| {
        let name = escaped(&other.name);
        folded(
            &format!("the pictures of {}", other.name),
            &format!("<h3 id=\"task-{name}\">{name}</h3>\n{}", figures_of(other)),
        )
    });
    text + &folds.collect::<String>()
}

fn figures_of(shown: &Shown) -> String {
    let name = &shown.name;
    let title = format!("Success set S of {name}");
    let mut text = figure(
        &borders_picture(&title, &shown.window, &shown.sections),
        &format!("{name}: from where it succeeds, at some of its headings"),
    );
    text += "<div class=\"pair\">\n";
    text += &figure(&shown.floor, &format!("{name}: the floor about the goal"));
    if let Some((image, _)) = &shown.image {
        text += &figure(
            image,
            &format!("{name}: the camera's image from the goal and the worst poses"),
        );
    }
    text += "</div>\n";
    if let Some((_, seen)) = &shown.image {
        let of = format!("the camera's image in {name}");
        text += &numbers(&of, &SEEN_HEAD, seen.iter().map(seen_from));
    }
    let rows = shown.sections.iter().map(|(yaw_deg, rings)| {
        let range = |axis: usize| {
            let all = rings.iter().flatten().map(|point| point[axis]);
            let lo = all.clone().fold(f64::INFINITY, f64::min);
            let hi = all.fold(f64::NEG_INFINITY, f64::max);
            if lo <= hi {
                format!("{lo:.3} to {hi:.3}")
            } else {
                "empty".into()
            }
        };
        // `sum` of no rings would be -0.
        let area = rings.iter().fold(0.0, |sum, ring| sum + area(ring));
        let [yaw, area] = [format!("{yaw_deg:.2}"), format!("{area:.4}")];
        vec![yaw, area, range(0), range(1)]
    });
    text + &numbers(&format!("the sections of {name}"), &SECTION_HEAD, rows)
}

const SECTION_HEAD: [&str; 4] = [
    "heading from the goal's, deg",
    "area of the section, m²",
    "x, m",
    "y, m",
];

const SEEN_HEAD: [&str; 6] = [
    "tag",
    "seen from",
    "x, m",
    "y, m",
    "yaw, deg",
    "its corners in the image, px",
];

fn seen_from(seen: &SeenFrom) -> Vec<String> {
    let [x, y, yaw] = seen.pose;
    let corners = seen.corners.map(|corner| match corner {
        Some([u, v]) => format!("({u:.1}, {v:.1})"),
        None => "not in front of it".into(),
    });
    vec![
        seen.tag.clone(),
        seen.worst_for.map_or_else(
            || "the goal".into(),
            |name| format!("the worst pose of the set for {name}"),
        ),
        fixed(x, 4),
        fixed(y, 4),
        fixed(yaw.to_degrees(), 3),
        corners.join(" "),
    ]
}

fn chains(contents: &Contents) -> String {
    let mut rows = Vec::new();
    let mut more = String::new();
    for (what, list) in [("chain", &contents.chains), ("plan of", &contents.plans)] {
        for ShownChain { name, found } in list {
            let mut row = vec![format!("{what} {name}")];
            match found {
                Ok((report, picture)) => {
                    let end = match report.first_failure() {
                        None => format!("succeeds; risk at most {}", report.risk_text()),
                        Some((step, _)) => format!("FAILS at step {}", step + 1),
                    };
                    row.extend([
                        end.clone(),
                        report.worst_margin().map_or_else(
                            || "unknown".into(),
                            |(margin, step)| {
                                format!("{} at step {}", margin_text(margin), step + 1)
                            },
                        ),
                        steps_text(report),
                    ]);
                    let of = format!("the steps of {what} {name}");
                    let inside = figure(picture, &format!("{name}, step by step: {end}"))
                        + &numbers(&of, &STEP_HEAD, steps(report));
                    more += &folded(&format!("{what} {name}, step by step"), &inside);
                }
                Err(why) => row.extend([format!("none: {why}"), "unknown".into(), String::new()]),
            }
            rows.push(row);
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    table(&["", "result", "worst margin", "steps"], rows) + &more
}

/// Returns the steps of a chain as text.
fn steps_text(report: &ChainReport) -> String {
    let steps = report.steps.iter().map(|step| {
        let task = step.task.as_deref().unwrap_or_default();
        let ends = [step.before.pose, step.after.pose];
        match step.kind {
            StepKind::Localization => format!("look {task}"),
            StepKind::Work => format!("work {task}"),
            StepKind::Navigation => drive(ends),
        }
    });
    steps.collect::<Vec<_>>().join(", ")
}

/// Returns a drive from one pose to another in words: its straight length, or the turn of a robot that stays where it is.
fn drive([[x, y, yaw], to]: [[f64; 3]; 2]) -> String {
    let length = libm::hypot(to[0] - x, to[1] - y);
    if length >= 0.005 {
        return format!("drive {length:.2} m");
    }
    let turn = libm::remainder(to[2] - yaw, core::f64::consts::TAU);
    format!("turn by {}°", fixed(turn.to_degrees(), 0))
}

const STEP_HEAD: [&str; 6] = [
    "step",
    "what",
    "margin",
    "then within, m",
    "then within, deg",
    "failure",
];

fn steps(report: &ChainReport) -> impl Iterator<Item = Vec<String>> {
    let rows = report.steps.iter().enumerate();
    rows.map(|(number, step)| {
        let task = step.task.clone().unwrap_or_default();
        let what = match step.kind {
            StepKind::Localization => format!("look: {task}"),
            StepKind::Work => format!("work: {task}"),
            StepKind::Navigation => "drive".into(),
        };
        let [translation, yaw] = step.after.enclosing();
        vec![
            (number + 1).to_string(),
            what,
            step.margin.map_or_else(String::new, factor_text),
            above(translation, 4),
            above(yaw.to_degrees(), 3),
            step.failure
                .map_or_else(String::new, |failure| failure.to_string()),
        ]
    })
}

/// Formats a bound, rounded up.
fn above(value: f64, digits: u32) -> String {
    let unit = libm::pow(10.0, f64::from(digits));
    format!("{:.*}", digits as usize, libm::ceil(value * unit) / unit)
}

/// Formats a value that is better if larger, rounded down.
fn below(value: f64, digits: u32) -> String {
    let unit = libm::pow(10.0, f64::from(digits));
    format!("{:.*}", digits as usize, libm::floor(value * unit) / unit)
}

const PLACE_HEAD: [&str; 8] = [
    "place",
    "x, m",
    "y, m",
    "z, m",
    "yaw, deg",
    "mean cost, no unit",
    "P(miss)",
    "margin",
];

fn placements(order: &PageInput<'_>) -> Result<String, PageError> {
    let mut text = String::new();
    for (task, placement) in &order.placements {
        let Some(of) = order.site.tasks.get(task) else {
            return Err(PageError::NoTask(task.clone()));
        };
        let is_mounted = |pose| of.success.tags().iter().any(|tag| tag.pose == pose);
        let is_before = pose_of(&placement["before"]).is_none_or(is_mounted);
        // The user may have written the found place into the site file, whose digest is then another one.
        let is_adopted = !is_before && is_adopted(&of.success.tags(), placement);
        if !is_before && !is_adopted {
            return Err(PageError::OtherTag(task.clone()));
        }
        let digest = order.site.digest_text();
        if let Some(other) = placement["site_digest"].as_str()
            && is_before
            && other != digest
        {
            return Err(PageError::OtherSite(task.clone(), other.into(), digest));
        }
        let mut rows = Vec::new();
        let named = [("before", &placement["before"]), ("best", placement)];
        let others = placement["others"].as_array().into_iter().flatten();
        for (name, place) in named
            .into_iter()
            .chain(others.map(|other| ("another", other)))
        {
            if name == "before" && place.is_null() {
                continue;
            }
            rows.push(place_row(name, place).ok_or_else(|| PageError::NoPlacement(task.clone()))?);
        }
        text += &format!("<h3>the tag of {}</h3>\n", escaped(task));
        text += if is_adopted {
            "<p>The site file has the tag at the best place. The numbers are those of the file before the tag was moved.</p>\n"
        } else {
            "<p>The site file, the plans and the mounting sheet have the tag at the place \u{201c}before\u{201d}. To mount it at the best place, write that pose into the site file.</p>\n"
        };
        text += "<div class=\"pair\">\n";
        // The present place of the tag in the site file.
        let now = if is_adopted {
            placement
        } else {
            &placement["before"]
        };
        for (name, what) in named {
            if let Some(picture) = floor_with_tag_at(order.site, task, now, what) {
                text += &figure(&picture, &format!("{task}, the tag {name}"));
            }
        }
        text += "</div>\n";
        text += &table(&PLACE_HEAD, rows);
        // Older versions of `posegate place` do not state it.
        if let Some(definition) = placement["cost_definition"].as_str() {
            text += &format!("<p>Cost of a view: {}.</p>\n", escaped(definition));
        }
    }
    Ok(text)
}

fn pose_of(place: &Value) -> Option<Pose3Deg> {
    let number = |key: &str| place["tag_pose"][key].as_f64();
    Some(Pose3Deg {
        x: number("x")?,
        y: number("y")?,
        z: number("z")?,
        roll_deg: number("roll_deg")?,
        pitch_deg: number("pitch_deg")?,
        yaw_deg: number("yaw_deg")?,
    })
}

/// Returns `true` if a tag is at the found place, or within the reserve for which that place was proven.
fn is_adopted(tags: &[Tag], placement: &Value) -> bool {
    let Some(found) = pose_of(placement) else {
        return false;
    };
    let reserve = |key: &str| placement["reserve"][key].as_f64().unwrap_or(0.0);
    // A pose is copied with four decimals.
    let (metres, degrees) = (
        reserve("translation").max(1e-4),
        reserve("yaw_deg").max(1e-2),
    );
    tags.iter().map(|tag| tag.pose).any(|own| {
        let off = [own.x - found.x, own.y - found.y, own.z - found.z];
        let turn = (own.yaw_deg - found.yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
        let lean = (own.roll_deg - found.roll_deg).abs() + (own.pitch_deg - found.pitch_deg).abs();
        off.iter().map(|v| v * v).sum::<f64>().sqrt() <= metres
            && turn.abs() <= degrees
            && lean <= 1e-2
    })
}

/// Draws the floor of a task with its tag at a place. If there are several tags, the moved tag is the one nearest to
/// the pose `now`.
fn floor_with_tag_at(site: &Site, task: &str, now: &Value, place: &Value) -> Option<String> {
    let pose = pose_of(place)?;
    let size = place["size"].as_f64();
    let mut site = site.clone();
    let own = site.tasks.get_mut(task)?;
    let tags = own.success.tags();
    let tag = match (tags.as_slice(), pose_of(now)) {
        ([only], _) => *only,
        (tags, Some(now)) => {
            let off = |tag: &Tag| libm::hypot(tag.pose.x - now.x, tag.pose.y - now.y);
            let nearest = tags.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            *nearest?
        }
        _ => return None,
    };
    own.success = own.success.with_views_of(&tag, |view| {
        view.tag.pose = pose;
        view.tag.size = size.unwrap_or(view.tag.size);
    });
    for other in site.tags.values_mut().filter(|other| other.tag == tag) {
        other.tag.pose = pose;
        other.tag.size = size.unwrap_or(tag.size);
    }
    task_plan(&Subject::new(&site, task).ok()?).ok()
}

fn place_row(name: &str, place: &Value) -> Option<Vec<String>> {
    let pose = |key: &str| place["tag_pose"][key].as_f64();
    let number = |key: &str, text: fn(f64) -> String| {
        let value = place[key].as_f64();
        value.map_or_else(|| "unknown".into(), text)
    };
    Some(vec![
        name.into(),
        fixed(pose("x")?, 4),
        fixed(pose("y")?, 4),
        fixed(pose("z")?, 4),
        fixed(pose("yaw_deg")?, 2),
        number("mean", |mean| format!("{mean:.6}")),
        number("p_miss", |share| above(share, 6)),
        // Rounded down, so that it is never too large.
        number("margin", |margin| below(margin, 6)),
    ])
}

/// Draws the mounting sheet of all tags of a site.
fn sheet(site: &Site, file: &str) -> String {
    let mounted = |(name, tag): (&String, &SiteTag)| Mounted {
        name: name.clone(),
        family: tag.family.clone(),
        tag: tag.tag,
        reserve: (!tag.tolerance.is_none()).then_some(tag.tolerance),
        left: None,
    };
    mounting_sheet(&MountingSheet {
        title: "Mounting sheet",
        origin: &site.origin(file),
        tags: &site.tags.iter().map(mounted).collect::<Vec<_>>(),
        walls: &site.walls,
    })
}

/// Returns the table of the tags and their mounting sheet.
fn tags(site: &Site, file: &str) -> String {
    if site.tags.is_empty() {
        return String::new();
    }
    let rows = site.tags.iter().map(|(name, tag)| {
        let (pose, off) = (tag.tag.pose, tag.tolerance);
        let mut row = vec![
            name.clone(),
            format!("{} {}", tag.family, tag.tag.id),
            format!("{:.3}", tag.tag.size),
        ];
        row.extend([pose.x, pose.y, pose.z].map(|v| fixed(v, 4)));
        row.extend([pose.roll_deg, pose.pitch_deg, pose.yaw_deg].map(|v| fixed(v, 2)));
        row.push(if off.is_none() {
            "unknown".to_owned()
        } else {
            format!("{:.3} m, {:.2} deg", off.translation, off.turn_deg)
        });
        row
    });
    let caption = "The mounting sheet: each tag with its place and size";
    let sheet = figure(&sheet(site, file), caption);
    table(&TAG_HEAD, rows) + &folded("the mounting sheet", &sheet)
}

const TAG_HEAD: [&str; 10] = [
    "tag",
    "number",
    "size, m",
    "x, m",
    "y, m",
    "z, m",
    "roll, deg",
    "pitch, deg",
    "yaw, deg",
    "may be off by",
];
