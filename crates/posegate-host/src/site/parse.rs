//! Converts TOML to a [`Site`].

use std::collections::BTreeMap;
use std::path::Path;
use std::str;

use sha2::{Digest, Sha256};
use toml::de::DeTable;

use super::error::{SiteError, Source};
use super::named::NamedFile;
use super::reader::{Node, Table};
use super::{
    Extent, Layout, Navigation, Planner, Site, SiteTag, Step, TableOverrides, TableSpec, Task,
    TaskKind, camera, candidate, chain, controller, import, keys, learnt, places, planner, success,
};
use crate::input::{self, Limit};
use posegate::shape::{Pose3Deg, PoseDeg, SuccessSet, Tag, Tolerance, is_arc};

pub(super) fn read(path: &Path) -> Result<Site, SiteError> {
    let file = path.to_string_lossy();
    let bytes =
        input::read(path, Limit::FILE).map_err(|cause| SiteError::unreadable(&file, &cause))?;
    match str::from_utf8(&bytes) {
        Ok(text) => site(text, &file),
        Err(fault) => {
            let sound = fault.valid_up_to();
            let text = str::from_utf8(&bytes[..sound]).unwrap_or_default();
            let source = Source { file: &file, text };
            Err(source
                .error(sound..sound, "the file is not UTF-8")
                .expected("text in UTF-8")
                .help("save the file in the encoding UTF-8"))
        }
    }
}

pub(super) fn site(text: &str, file: &str) -> Result<Site, SiteError> {
    part(text, file, Sha256::digest(text.as_bytes()).into())
}

/// Reads a site from a part of a file's text. `sha256` is that of the complete file.
pub(super) fn part(text: &str, file: &str, sha256: [u8; 32]) -> Result<Site, SiteError> {
    let source = Source { file, text };
    let document = DeTable::parse(text).map_err(|fault| syntax(source, &fault))?;
    let root = Table::root(source, &document);
    root.refuse_unknown(&[
        &keys::CAMERAS,
        &keys::TAGS,
        &keys::CANDIDATES,
        &keys::ROWS,
        &keys::TASKS,
        &keys::TABLE,
        &keys::CONFIDENCE,
        &keys::SITE_CONTROLLER,
        &keys::CHAINS,
        &keys::NAVIGATION,
        &keys::PLANNER,
        &keys::WALLS,
        &keys::ERROR_MODELS,
        &keys::GOALS,
        &keys::IMPORTS,
    ])?;

    let mut cameras = BTreeMap::new();
    let mut calibrations = BTreeMap::new();
    if let Some(node) = root.optional(&keys::CAMERAS) {
        for (name, node) in node.any_table()?.named(&keys::CAMERA)? {
            let (camera, file) = camera::camera(&node)?;
            cameras.insert(name.to_owned(), camera);
            calibrations.extend(file.map(|file| (name, file)));
        }
    }
    let mut tags = BTreeMap::new();
    if let Some(node) = root.optional(&keys::TAGS) {
        for (name, node) in node.any_table()?.named(&keys::TAG)? {
            tags.insert(name.to_owned(), tag(&node)?);
        }
    }
    let mut goals = BTreeMap::new();
    if let Some(node) = root.optional(&keys::GOALS) {
        for (name, node) in node.any_table()?.named(&keys::ONE_GOAL)? {
            goals.insert(name.to_owned(), pose2(&node)?);
        }
    }
    let imports = import::imports(&root, &mut tags, &mut goals)?;
    let mut walls = BTreeMap::new();
    if let Some(node) = root.optional(&keys::WALLS) {
        for (name, node) in node.any_table()?.named(&keys::WALL)? {
            walls.insert(name.to_owned(), places::wall(name, &node)?);
        }
    }
    let levers = cameras.values().map(|camera: &super::SiteCamera| {
        libm::hypot(camera.mount.x, camera.mount.y) + camera.mount_tolerance.translation
    });
    let lever = levers.fold(0.0, f64::max);
    let heights = cameras.values().map(|camera: &super::SiteCamera| {
        libm::fabs(camera.mount.z) + camera.mount_tolerance.translation
    });
    let reach = [lever, heights.fold(0.0, f64::max)];
    let mut error_models = BTreeMap::new();
    let mut learnt = BTreeMap::new();
    if let Some(node) = root.optional(&keys::ERROR_MODELS) {
        for (name, node) in node.any_table()?.named(&keys::ONE_ERROR_MODEL)? {
            let (model, file) = places::error_model(&node, reach)?;
            error_models.insert(name.to_owned(), model);
            learnt.extend(file.map(|file| (name, file)));
        }
    }
    let names = success::Names {
        cameras: &cameras,
        tags: &tags,
        walls: &walls,
        error_models: &error_models,
        goals: &goals,
    };
    let defaults = match root.optional(&keys::TABLE) {
        Some(node) => TableKeys::read(&table_table(&node)?)?,
        None => TableKeys::default(),
    };
    let mut tasks = BTreeMap::new();
    if let Some(node) = root.optional(&keys::TASKS) {
        for (name, node) in node.any_table()?.named(&keys::TASK)? {
            tasks.insert(name.to_owned(), task(&node, &names, &defaults)?);
        }
    }
    let goals_of_tasks: Vec<[f64; 2]> = tasks
        .values()
        .map(|task: &Task| [task.success.goal.x, task.success.goal.y])
        .collect();
    let candidates = candidate::candidates(&root, &tags, &walls, &goals_of_tasks)?;
    let epsilon = match root.optional(&keys::CONFIDENCE) {
        Some(node) => node.table(&[&keys::EPSILON])?.number(&keys::EPSILON)?,
        None => Site::DEFAULT_EPSILON,
    };
    let controller = match root.optional(&keys::SITE_CONTROLLER) {
        Some(node) => Some(controller::controller(&node)?),
        None => None,
    };
    let navigation = match root.optional(&keys::NAVIGATION) {
        Some(node) => chain::navigation(&node)?,
        None => Navigation::default(),
    };
    let planner = match root.optional(&keys::PLANNER) {
        Some(node) => planner::planner(&node, &names, &candidates)?,
        None => Planner::default(),
    };
    let mut chains = BTreeMap::new();
    if let Some(node) = root.optional(&keys::CHAINS) {
        for (name, node) in node.any_table()?.named(&keys::CHAIN)? {
            let chain = chain::chain(&node, &tasks, &navigation, epsilon)?;
            chains.insert(name.to_owned(), chain);
        }
    }
    if let Some(node) = root.optional(&keys::TASKS) {
        for (_, node) in node.any_table()?.named(&keys::TASK)? {
            if let Some(from) = node.any_table()?.optional(&keys::TASK_FROM) {
                success::named(&from, "chain", &chains)?;
            }
        }
    }
    let named = [calibrations, imports, learnt];
    let files: Vec<NamedFile> = named.into_iter().flat_map(BTreeMap::into_values).collect();
    Ok(Site {
        cameras,
        tags,
        candidates,
        tasks,
        walls: walls.into_values().collect(),
        goals,
        chains,
        navigation,
        planner,
        table: defaults.complete(),
        epsilon,
        controller,
        digest: digest(sha256, files.iter().map(|file| &file.digest)),
        files: files.into_iter().map(|file| file.path).collect(),
        error_formulas: error_models
            .iter()
            .filter_map(|(name, model)| match model {
                places::SiteModel::Formula(model) => Some((name.clone(), *model)),
                places::SiteModel::Learnt(_) => None,
            })
            .collect(),
        error_models: error_models
            .into_iter()
            .filter_map(|(name, model)| match model {
                places::SiteModel::Learnt(model) => Some((name, model)),
                places::SiteModel::Formula(_) => None,
            })
            .collect(),
    })
}

/// Returns the SHA-256 of the site file's bytes. With calibrations, imports or learnt error models: that of
/// this digest and those of their files, in the order of the cameras' names, then the imports', then the
/// models'.
fn digest<'a>(own: [u8; 32], files: impl Iterator<Item = &'a [u8; 32]>) -> [u8; 32] {
    let mut files = files.peekable();
    if files.peek().is_none() {
        return own;
    }
    let all = files.fold(Sha256::new_with_prefix(own), Digest::chain_update);
    all.finalize().into()
}

pub(super) fn syntax(source: Source<'_>, fault: &toml::de::Error) -> SiteError {
    let end = source.text.len();
    let span = fault.span().unwrap_or(end..end);
    let (message, expected) = match fault.message().split_once(", expected ") {
        Some((message, expected)) if expected != "nothing" => (message, expected),
        _ => (fault.message(), "TOML"),
    };
    let help = if message.contains("duplicate key") {
        "give each key and each table once: remove or rename this one"
    } else if message.contains("must be quoted") || message.contains("string") {
        "put text into double quotes, on one line"
    } else {
        "write `key = value` lines under [table] headers, as in the file that `posegate init` writes"
    };
    source
        .error(span, format!("not valid TOML: {message}"))
        .expected(expected)
        .help(help)
}

pub(super) fn tag(node: &Node<'_>) -> Result<SiteTag, SiteError> {
    let table = node.table(&[
        &keys::ID,
        &keys::FAMILY,
        &keys::SIZE,
        &keys::POSE,
        &keys::TOLERANCE,
    ])?;
    let id = table.required(&keys::ID)?.whole(0..=u32::MAX)?;
    let family = table.required(&keys::FAMILY)?;
    let family_name = family.text()?;
    if family_name.is_empty() {
        return Err(family.error("the tag's family is empty"));
    }
    Ok(SiteTag {
        family: family_name.to_owned(),
        tag: Tag {
            id,
            size: table.number(&keys::SIZE)?,
            pose: pose3(&table.required(&keys::POSE)?)?,
        },
        tolerance: match table.optional(&keys::TOLERANCE) {
            Some(node) => places::tolerance(&node)?,
            None => Tolerance::NONE,
        },
    })
}

pub(super) fn pose3(node: &Node<'_>) -> Result<Pose3Deg, SiteError> {
    let table = node.table(&[
        &keys::X,
        &keys::Y,
        &keys::Z,
        &keys::ROLL,
        &keys::PITCH,
        &keys::YAW,
    ])?;
    Ok(Pose3Deg {
        x: table.number(&keys::X)?,
        y: table.number(&keys::Y)?,
        z: table.number(&keys::Z)?,
        roll_deg: table.number(&keys::ROLL)?,
        pitch_deg: table.number(&keys::PITCH)?,
        yaw_deg: table.number(&keys::YAW)?,
    })
}

pub(super) fn pose2(node: &Node<'_>) -> Result<PoseDeg, SiteError> {
    let table = node.table(&[&keys::X, &keys::Y, &keys::YAW])?;
    Ok(PoseDeg {
        x: table.number(&keys::X)?,
        y: table.number(&keys::Y)?,
        yaw_deg: table.number(&keys::YAW)?,
    })
}

fn task(
    node: &Node<'_>,
    names: &success::Names<'_>,
    defaults: &TableKeys,
) -> Result<Task, SiteError> {
    let table = node.table(&[
        &keys::KIND,
        &keys::GOAL,
        &keys::SUCCESS,
        &keys::ERROR_BOUND,
        &keys::TABLE,
        &keys::TOLERANCE,
        &keys::EXPECTED,
        &keys::TASK_FROM,
    ])?;
    let kind = kind(&table.required(&keys::KIND)?)?;
    let goal = table.required(&keys::GOAL)?;
    let goal = if goal.is_text() {
        *success::named(&goal, "goal", names.goals)?
    } else {
        pose2(&goal)?
    };
    let set = table.required(&keys::SUCCESS)?;
    let mut shape = success::shape(&set, names)?;
    if let Some(node) = table.optional(&keys::TOLERANCE) {
        shape = shape.within(places::tolerance(&node)?);
        if shape.has_empty_box() {
            return Err(node
                .error("the tolerance leaves nothing of a box in the success set")
                .help("survey the goal better, or make the box larger"));
        }
    }
    let success = SuccessSet { goal, shape };
    if let Some(obstacle) = success.covered_by() {
        return Err(set
            .error(format!(
                "an obstacle covers the goal, which is {:.3} m inside of it",
                -obstacle
            ))
            .expected("obstacles that do not cover the goal: their corners are in the goal frame")
            .help("move the obstacle, or the goal"));
    }
    let error_bound = match kind {
        TaskKind::Work if table.has(keys::ERROR_BOUND.name) => {
            return Err(table
                .error_at_key(
                    keys::ERROR_BOUND.name,
                    format!("{} is a work task and has an `error_bound`", table.title()),
                )
                .expected("an `error_bound` in localization tasks only")
                .help("remove it, or write `kind = \"localization\"`"));
        }
        TaskKind::Work => None,
        TaskKind::Localization => Some(learnt::error_bound(&table, &set, names)?),
    };
    let from = match table.optional(&keys::TASK_FROM) {
        Some(node) if kind == TaskKind::Localization => {
            return Err(node
                .error(format!(
                    "{} is no work task and has a `from`",
                    table.title()
                ))
                .expected("a `from` in work tasks only")
                .help("remove it"));
        }
        Some(node) => Some(node.text()?.to_owned()),
        None => None,
    };
    let own_table = match table.optional(&keys::TABLE) {
        Some(node) => {
            let own = table_table(&node)?;
            Some(TableKeys::read(&own)?.or(defaults))
        }
        None => None,
    };
    let said = own_table.unwrap_or(*defaults);
    let wish = TableOverrides {
        extent: said.extent,
        step: said.step,
        layout: said.layout,
        expected: match table.optional(&keys::EXPECTED) {
            Some(node) => Some(places::expected(&node)?),
            None => None,
        },
    };
    Ok(Task {
        kind,
        success,
        error_bound,
        from,
        table: own_table.and_then(TableKeys::complete),
        wish,
    })
}

fn kind(node: &Node<'_>) -> Result<TaskKind, SiteError> {
    match node.text()? {
        "work" => Ok(TaskKind::Work),
        "localization" => Ok(TaskKind::Localization),
        "navigation" => Err(node
            .error("navigation is not a kind of task")
            .help("write it as a `navigate` step of a [chain.NAME] table")),
        _ => Err(node.unknown_word(["work", "localization"])),
    }
}

/// The keys of a `table`. Each may be missing: the default is used.
#[derive(Clone, Copy, Default)]
struct TableKeys {
    extent: Option<Extent>,
    step: Option<Step>,
    layout: Option<Layout>,
}

fn table_table<'a>(node: &Node<'a>) -> Result<Table<'a>, SiteError> {
    node.table(&[&keys::EXTENT, &keys::STEP, &keys::LAYOUT])
}

impl TableKeys {
    fn read(table: &Table<'_>) -> Result<Self, SiteError> {
        let read = |key| table.optional(key);
        Ok(Self {
            extent: read(&keys::EXTENT).as_ref().map(extent).transpose()?,
            step: read(&keys::STEP).as_ref().map(step).transpose()?,
            layout: read(&keys::LAYOUT).as_ref().map(layout).transpose()?,
        })
    }

    fn or(self, defaults: &Self) -> Self {
        Self {
            extent: self.extent.or(defaults.extent),
            step: self.step.or(defaults.step),
            layout: self.layout.or(defaults.layout),
        }
    }

    fn complete(self) -> Option<TableSpec> {
        Some(TableSpec {
            extent: self.extent?,
            step: self.step?,
            layout: self.layout.unwrap_or_default(),
        })
    }
}

fn extent(node: &Node<'_>) -> Result<Extent, SiteError> {
    let table = node.table(&[&keys::EXTENT_X, &keys::EXTENT_Y, &keys::EXTENT_YAW])?;
    Ok(Extent {
        x: table.interval(&keys::EXTENT_X, |lo, hi| lo < hi)?,
        y: table.interval(&keys::EXTENT_Y, |lo, hi| lo < hi)?,
        yaw_deg: table.interval(&keys::EXTENT_YAW, |lo, hi| lo < hi && is_arc([lo, hi]))?,
    })
}

fn step(node: &Node<'_>) -> Result<Step, SiteError> {
    let table = node.table(&[&keys::STEP_XY, &keys::STEP_YAW])?;
    Ok(Step {
        xy: table.number(&keys::STEP_XY)?,
        yaw_deg: table.number(&keys::STEP_YAW)?,
    })
}

fn layout(node: &Node<'_>) -> Result<Layout, SiteError> {
    match node.text()? {
        "facets" => Ok(Layout::Facets),
        "grid" => Ok(Layout::Grid),
        "both" => Ok(Layout::Both),
        "auto" => Ok(Layout::Auto),
        _ => Err(node.unknown_word(["facets", "grid", "both", "auto"])),
    }
}
