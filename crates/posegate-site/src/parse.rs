//! Converts TOML to a [`Site`].

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;
use std::str;

use sha2::{Digest, Sha256};
use toml::de::DeTable;

use super::error::{SiteError, Source};
use super::named::NamedFile;
use super::names::{Names, named};
use super::places::SiteModel;
use super::reader::{Key, Node, Table};
use super::syntax::syntax;
use super::table_keys::TableKeys;
use super::task::task;
use super::{
    Navigation, Planner, Remark, Site, SiteCamera, SiteTag, camera, candidate, chain, controller,
    import, keys, places, planner, poses, tags,
};
use posegate::shape::{ErrorModel as FormulaModel, PoseDeg, Wall};
use posegate_files::input::{self, Limit};
use posegate_learn::ErrorModel;

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

/// The sections of a site file.
const SECTIONS: [&Key; 17] = [
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
    &keys::FRAMES,
    &keys::ORIGIN,
    &keys::IMPORTS,
];

pub(super) fn site(text: &str, file: &str) -> Result<Site, SiteError> {
    let source = Source { file, text };
    let document = DeTable::parse(text).map_err(|fault| syntax(source, &fault))?;
    let root = &Table::root(source, &document);
    root.refuse_unknown(&SECTIONS)?;

    let origin = section(root, &keys::ORIGIN, poses::point)?.unwrap_or_default();
    let parts = NamedParts::read(root, origin)?;
    let names = parts.names(origin);
    let defaults = section(root, &keys::TABLE, TableKeys::read)?.unwrap_or_default();
    let tasks = entries(root, &keys::TASKS, &keys::TASK, |_, node| {
        task(node, &names, &defaults)
    })?;
    let goals = tasks.values().map(|task| task.success.goal);
    let goals: Vec<[f64; 2]> = goals.map(|goal| [goal.x, goal.y]).collect();
    let candidates = candidate::candidates(root, origin, &parts.tags, &parts.walls, &goals)?;
    let epsilon = section(root, &keys::CONFIDENCE, |node| {
        node.table(&[&keys::EPSILON])?.number(&keys::EPSILON)
    })?;
    let epsilon = epsilon.unwrap_or(Site::DEFAULT_EPSILON);
    let controller = section(root, &keys::SITE_CONTROLLER, controller::controller)?;
    let navigation: Navigation =
        section(root, &keys::NAVIGATION, chain::navigation)?.unwrap_or_default();
    let planner: Option<Planner> = section(root, &keys::PLANNER, |node| {
        planner::planner(node, &names, &candidates)
    })?;
    let chains = entries(root, &keys::CHAINS, &keys::CHAIN, |_, node| {
        let chain = chain::chain(node, &tasks, &navigation, epsilon)?;
        Ok(chain.less(origin))
    })?;
    entries(root, &keys::TASKS, &keys::TASK, |_, node| {
        match node.any_table()?.optional(&keys::TASK_FROM) {
            Some(from) => named(&from, "chain", &chains).map(|_| ()),
            None => Ok(()),
        }
    })?;
    let frames = entries(root, &keys::FRAMES, &keys::FRAME, |_, node| {
        poses::pose3(node)
    })?;
    let (error_formulas, error_models) = split_models(parts.error_models);
    Ok(Site {
        digest: digest(
            Sha256::digest(text.as_bytes()).into(),
            parts.files.iter().map(|file| &file.digest),
        ),
        files: parts.files.into_iter().map(|file| file.path).collect(),
        cameras: parts.cameras,
        remarks: parts.remarks,
        map_origin: origin,
        tags: parts.tags,
        candidates,
        tasks,
        walls: parts.walls.into_values().collect(),
        goals: parts.goals,
        frames,
        chains,
        navigation,
        planner: planner.unwrap_or_default(),
        table: defaults.complete(),
        epsilon,
        controller,
        error_formulas,
        error_models,
    })
}

/// Reads a section; `None` if the file does not have it.
fn section<T>(
    root: &Table<'_>,
    key: &'static Key,
    read: impl FnOnce(&Node<'_>) -> Result<T, SiteError>,
) -> Result<Option<T>, SiteError> {
    root.optional(key).map(|node| read(&node)).transpose()
}

/// Reads every table of a section of named tables, in the file's order. `read` gets the name and the table.
fn entries<T>(
    root: &Table<'_>,
    key: &'static Key,
    entry: &'static Key,
    read: impl Fn(&str, &Node<'_>) -> Result<T, SiteError>,
) -> Result<BTreeMap<String, T>, SiteError> {
    let mut found = BTreeMap::new();
    if let Some(node) = root.optional(key) {
        for (name, node) in node.any_table()?.named(entry)? {
            found.insert(name.to_owned(), read(name, &node)?);
        }
    }
    Ok(found)
}

/// The parts of a site that tasks refer to by name, and the files that they name.
struct NamedParts {
    cameras: BTreeMap<String, SiteCamera>,
    tags: BTreeMap<String, SiteTag>,
    walls: BTreeMap<String, Wall>,
    error_models: BTreeMap<String, SiteModel>,
    goals: BTreeMap<String, PoseDeg>,
    /// Calibrations in the order of the cameras' names, then imports, then learnt error models.
    files: Vec<NamedFile>,
    /// What the files do not say.
    remarks: Vec<Remark>,
}

impl NamedParts {
    /// Reads the sections without tasks, and the imports.
    fn read(root: &Table<'_>, origin: [f64; 2]) -> Result<Self, SiteError> {
        let mut remarks = Vec::new();
        let noted = RefCell::new(&mut remarks);
        let cameras = entries(root, &keys::CAMERAS, &keys::CAMERA, |name, node| {
            let mut notes = Vec::new();
            let camera = camera::camera(node, &mut notes)?;
            noted
                .borrow_mut()
                .extend(notes.into_iter().map(|note| Remark {
                    about: ["camera", name].map(str::to_owned),
                    note,
                }));
            Ok(camera)
        })?;
        let (cameras, calibrations) = split_files(cameras);
        let mut tags = entries(root, &keys::TAGS, &keys::TAG, |_, node| tags::tag(node))?;
        let mut goals = entries(root, &keys::GOALS, &keys::ONE_GOAL, |_, node| {
            poses::pose2(node)
        })?;
        let imports = import::imports(root, &mut tags, &mut goals, &mut remarks)?;
        let mut walls = entries(root, &keys::WALLS, &keys::WALL, places::wall)?;
        let [east, north] = origin;
        for tag in tags.values_mut() {
            let pose = &mut tag.tag.pose;
            (pose.x, pose.y) = (pose.x - east, pose.y - north);
        }
        for goal in goals.values_mut() {
            (goal.x, goal.y) = (goal.x - east, goal.y - north);
        }
        for [x, y] in walls.values_mut().flat_map(|wall| &mut wall.corners) {
            (*x, *y) = (*x - east, *y - north);
        }
        let reach = reach(&cameras);
        let models = entries(
            root,
            &keys::ERROR_MODELS,
            &keys::ONE_ERROR_MODEL,
            |_, node| places::error_model(node, reach),
        )?;
        let (error_models, learnt) = split_files(models);
        let files = calibrations.into_iter().chain(imports.into_values());
        Ok(Self {
            cameras,
            tags,
            walls,
            error_models,
            goals,
            remarks,
            files: files.chain(learnt).collect(),
        })
    }

    /// Returns the entries that success sets refer to.
    const fn names(&self, origin: [f64; 2]) -> Names<'_> {
        Names {
            origin,
            cameras: &self.cameras,
            tags: &self.tags,
            walls: &self.walls,
            error_models: &self.error_models,
            goals: &self.goals,
        }
    }
}

/// Separates the error models that are formulas from the learnt ones.
fn split_models(
    models: BTreeMap<String, SiteModel>,
) -> (BTreeMap<String, FormulaModel>, BTreeMap<String, ErrorModel>) {
    let (mut formulas, mut learnt) = (BTreeMap::new(), BTreeMap::new());
    for (name, model) in models {
        match model {
            SiteModel::Formula(model) => drop(formulas.insert(name, model)),
            SiteModel::Learnt(model) => drop(learnt.insert(name, model)),
        }
    }
    (formulas, learnt)
}

/// Separates entries from the files that they name. The files are in the order of the entries' names.
fn split_files<T>(
    entries: BTreeMap<String, (T, Option<NamedFile>)>,
) -> (BTreeMap<String, T>, Vec<NamedFile>) {
    let mut files = Vec::new();
    let entries = entries.into_iter().map(|(name, (entry, file))| {
        files.extend(file);
        (name, entry)
    });
    (entries.collect(), files)
}

/// Returns the largest distance of a camera from the robot's vertical axis, and from the floor, metres.
fn reach(cameras: &BTreeMap<String, SiteCamera>) -> [f64; 2] {
    let levers = cameras.values().map(|camera| {
        libm::hypot(camera.mount.x, camera.mount.y) + camera.mount_tolerance.translation
    });
    let heights = cameras
        .values()
        .map(|camera| libm::fabs(camera.mount.z) + camera.mount_tolerance.translation);
    [levers.fold(0.0, f64::max), heights.fold(0.0, f64::max)]
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
