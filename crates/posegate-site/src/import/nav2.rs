//! Nav2's docks (opennav_docking): a database, or the parameters of the docking server. Poses are those of the robot's base.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use super::place::{tidy, tidy_angle};
use super::{DockDirection, DockTask, Import, Placed};
use crate::error::{SiteError, Source};
use crate::suggest;
use crate::yaml::{Document, FormatMessages, Map, Node};
use posegate::shape::PoseDeg;

const MESSAGES: FormatMessages = FormatMessages {
    what: "a dock database of Nav2, or parameters of its docking server",
    written: "write `docks:` and below it `dock1: {type: \"charging_dock\", frame: map, pose: [1.0, 2.0, 1.57]}`",
    numbers: "write `pose: [x, y, theta]` in metres, metres and radians, as [1.0, 2.0, 1.57]",
    not_finite: "measure the dock's pose again",
    length: "write `pose: [x, y, theta]`: metres, metres, radians; there is no z",
    reads_first: false,
};

/// The frame of a dock without `frame`.
const DEFAULT_FRAME: &str = "map";
/// The largest `docking_threshold`, metres. A larger number has another unit.
const LARGEST_THRESHOLD: f64 = 1.0;
/// The most maps inside one another above `ros__parameters`: namespaces.
const MOST_NAMESPACES: u32 = 8;

/// The contents of a file.
#[derive(Default)]
pub(super) struct Docks {
    pub docks: Vec<(String, Placed<PoseDeg>)>,
    pub tasks: Vec<(String, DockTask)>,
    pub remarks: Vec<String>,
}

/// A dock as written.
struct Dock<'n> {
    name: &'n str,
    at: std::ops::Range<usize>,
    entries: Entries<'n>,
    /// The full name of its keys, for messages.
    path: String,
}

/// The parameters of the docking server, for the docks that are in them.
type Server<'n> = Option<Map<'n>>;

/// Keys of a dock: those of a map, or parameters whose names begin with the dock's.
struct Entries<'n> {
    map: Map<'n>,
    below: Option<&'n str>,
}

/// Reads the docks. Nav2 ignores unknown keys, and so does this.
pub(super) fn read(source: Source<'_>, import: &Import) -> Result<Docks, SiteError> {
    let document = Document::new(source, &MESSAGES)?;
    let root = document.parse()?;
    let file = document.map(&root)?;
    let (mut docks, server) = docks_of(&document, file)?;
    let mut found = Docks::default();
    select_frame(&document, &mut docks, import, &mut found.remarks)?;
    let mut unknown = Vec::new();
    for dock in &docks {
        let key = |key: &str| format!("{}.{key}", dock.path);
        let kind = match dock.entries.get("type") {
            Some(kind) => Some(document.text(kind)?),
            // A server with one plugin needs no type.
            None if server.is_some() => None,
            None => {
                let at = dock.at.clone();
                return Err(document
                    .required(None::<()>, at, &key("type"), MESSAGES.written)
                    .expect_err("nothing"));
            }
        };
        let plugin = Plugin::of(&document, server, kind)?;
        let list = document.required(
            dock.entries.get("pose"),
            dock.at.clone(),
            &key("pose"),
            MESSAGES.written,
        )?;
        let [x, y, theta] = document.numbers(list, &key("pose"))?;
        let name = dock.name;
        if theta.abs() > TAU + 1e-3 {
            return Err(document
                .error(
                    document.place_of(list, 2),
                    format!("the heading of dock `{name}` is {theta} radians"),
                )
                .expected("radians, from -6.2832 to 6.2832")
                .help("90 degrees are 1.5708"));
        }
        if theta.abs() > PI + 1e-3 {
            found.remarks.push(format!(
                "the heading of `{name}` is {theta} radians, {:.1} degrees: if the file has degrees, convert them",
                tidy_angle(theta.to_degrees())
            ));
        }
        plugin.remark(name, [x, y, theta], &mut found.remarks);
        let direction = match (import.dock_direction, &plugin.direction) {
            (Some(said), Some((written, at))) if said != *written => {
                return Err(document
                    .error(
                        at.clone(),
                        format!(
                            "the robot enters the dock `{name}` {}, and the import says {}",
                            written.name(),
                            said.name()
                        ),
                    )
                    .expected("one direction")
                    .help("leave the direction of the import out, or correct the file"));
            }
            (Some(said), _) => said,
            (None, Some((written, _))) => {
                if *written == DockDirection::Backward {
                    found.remarks.push(format!(
                        "the robot enters the dock `{name}` backward, as the file says: the goal's heading is that of the file plus 180 degrees"
                    ));
                }
                *written
            }
            (None, None) => {
                unknown.push(name);
                DockDirection::Forward
            }
        };
        let turn = match direction {
            DockDirection::Forward => 0.0,
            DockDirection::Backward => 180.0,
        };
        let value = PoseDeg {
            x: tidy(x),
            y: tidy(y),
            yaw_deg: tidy_angle(theta.to_degrees() + turn),
        };
        let at = dock.at.clone();
        found.docks.push((name.to_owned(), Placed { at, value }));
        if let Some(radius) = plugin.threshold {
            found.tasks.push((name.to_owned(), DockTask { radius }));
        }
    }
    if !unknown.is_empty() {
        found.remarks.push(format!(
            "the file does not say in which direction the robot enters {}: forward is assumed. If the plugin has dock_direction: \
             \"backward\", or the server dock_backwards: true, the docked robot has the opposite heading: give --dock-direction backward (in a \
             site: dock_direction = \"backward\"), else forward",
            suggest::list(unknown.into_iter())
        ));
    }
    Ok(found)
}

/// Returns the docks of a database, or of the parameters of a docking server.
fn docks_of<'n>(
    document: &Document<'_>,
    file: Map<'n>,
) -> Result<(Vec<Dock<'n>>, Server<'n>), SiteError> {
    if let Some(docks) = file.get("docks")
        && !docks.is_list()
    {
        let docks = document.map(docks)?.sorted().into_iter();
        let docks = docks.map(|(name, node)| {
            Ok(Dock {
                name,
                at: node.at.clone(),
                entries: Entries {
                    map: document.map(node)?,
                    below: None,
                },
                path: format!("docks.{name}"),
            })
        });
        return Ok((docks.collect::<Result<_, SiteError>>()?, None));
    }
    let mut servers = Vec::new();
    if file.get("docks").is_some() {
        servers.push(file);
    }
    parameters(file, MOST_NAMESPACES, &mut servers);
    let [server] = servers.as_slice() else {
        let (message, help) = if servers.is_empty() {
            (
                "the file has no `docks`",
                "name the file of the docking server's parameter `dock_database`, or its parameters, which have `docks: [\"dock1\"]`; write `docks:` above docks \
                 without it, and indent them",
            )
        } else {
            (
                "the file has the docks of several docking servers",
                "cut the file, and import the parameters of each robot by themselves",
            )
        };
        let error = document.error(0..0, message);
        return Err(error.expected(MESSAGES.what).help(help));
    };
    let Some(list) = server.get("docks") else {
        return Ok((Vec::new(), Some(*server)));
    };
    let mut docks = Vec::new();
    for node in document.list(list)? {
        let name = document.text(node)?;
        docks.push(Dock {
            name,
            at: node.at.clone(),
            entries: Entries {
                map: *server,
                below: Some(name),
            },
            path: name.to_owned(),
        });
    }
    docks.sort_unstable_by_key(|dock| dock.name);
    Ok((docks, Some(*server)))
}

/// Collects the parameters of docking servers: the maps `ros__parameters` with a list `docks`, at any namespace.
fn parameters<'n>(map: Map<'n>, deeper: u32, found: &mut Vec<Map<'n>>) {
    let Some(deeper) = deeper.checked_sub(1) else {
        return;
    };
    for (name, node) in map.sorted() {
        let Some(inner) = node.as_map() else {
            continue;
        };
        if name == "ros__parameters" && inner.get("docks").is_some() {
            found.push(inner);
        } else {
            parameters(inner, deeper, found);
        }
    }
}

impl<'n> Entries<'n> {
    fn get(&self, key: &str) -> Option<&'n Node> {
        match self.below {
            Some(name) => parameter(self.map, &[name, key]),
            None => self.map.get(key),
        }
    }
}

/// Returns a parameter by the parts of its name, nested or with dots.
fn parameter<'n>(map: Map<'n>, path: &[&str]) -> Option<&'n Node> {
    (1..=path.len()).find_map(|count| {
        let (first, rest) = path.split_at_checked(count)?;
        let node = map.get(&first.join("."))?;
        if rest.is_empty() {
            return Some(node);
        }
        parameter(node.as_map()?, rest)
    })
}

/// Keeps the docks of one frame. It must be the site's world unless the import gives the frame's pose.
fn select_frame(
    document: &Document<'_>,
    docks: &mut Vec<Dock<'_>>,
    import: &Import,
    remarks: &mut Vec<String>,
) -> Result<(), SiteError> {
    let frame_of = |dock: &Dock<'_>| match dock.entries.get("frame") {
        None => Ok((DEFAULT_FRAME.to_owned(), dock.at.clone())),
        Some(frame) => Ok((
            document.text(frame)?.trim_start_matches('/').to_owned(),
            frame.at.clone(),
        )),
    };
    let frames: Vec<_> = docks
        .iter()
        .map(frame_of)
        .collect::<Result<_, SiteError>>()?;
    let names: BTreeSet<&str> = frames.iter().map(|(frame, _)| frame.as_str()).collect();
    let all = || suggest::list(names.iter().copied());
    let chosen = match (&import.frame, names.len()) {
        (_, 0) => return Ok(()),
        (Some(frame), _) => {
            let frame = frame.trim_start_matches('/');
            if !names.contains(frame) {
                return Err(document
                    .error(0..0, format!("no dock is in the frame `{frame}`"))
                    .expected(format!("one of the file's frames: {}", all()))
                    .help("name one of them"));
            }
            frame
        }
        (None, 1) => names.first().copied().unwrap_or(DEFAULT_FRAME),
        (None, _) => {
            let first = frames.first().map_or("", |(frame, _)| frame.as_str());
            let other = frames
                .iter()
                .zip(docks.iter())
                .find(|((frame, _), _)| frame != first);
            let (at, name, frame) = other.map_or((0..0, "", first), |((frame, at), dock)| {
                (at.clone(), dock.name, frame.as_str())
            });
            return Err(document
                .error(
                    at,
                    format!("the dock `{name}` is in the frame `{frame}`, another one in `{first}`"),
                )
                .expected("one frame for all docks, or the `frame` whose docks are read")
                .help(format!(
                    "import the docks of each frame by themselves: --frame NAME (in a site: frame = \"NAME\") with one of {}",
                    all()
                )));
        }
    };
    let is_world = chosen == DEFAULT_FRAME || import.pose.is_some();
    if !is_world {
        let is_map = chosen.rsplit('/').next() == Some(DEFAULT_FRAME);
        if import.frame.is_none() && !is_map {
            let (name, at) = docks
                .first()
                .zip(frames.first())
                .map_or(("", 0..0), |(dock, (_, at))| (dock.name, at.clone()));
            return Err(document
                .error(at, format!("the dock `{name}` is in the frame `{chosen}`"))
                .expected("the frame `map`, or the `pose` of this frame")
                .help(format!(
                    "add the `pose` of the frame `{chosen}` in the site's world; if that frame is the site's world, give --frame {chosen} (in a \
                     site: frame = \"{chosen}\")"
                )));
        }
        remarks.push(format!(
            "the frame `{chosen}` of the docks is taken as the site's world"
        ));
    }
    let chosen = chosen.to_owned();
    let others = frames.iter().filter(|(frame, _)| *frame != chosen).count();
    if others > 0 {
        remarks.push(format!(
            "{others} docks of other frames are not read: the frames are {}",
            all()
        ));
    }
    let mut keep = frames.iter().map(|(frame, _)| *frame == chosen);
    docks.retain(|_| keep.next().unwrap_or(false));
    Ok(())
}

/// What the parameters of a dock's plugin say.
#[derive(Default)]
struct Plugin {
    direction: Option<(DockDirection, std::ops::Range<usize>)>,
    /// `docking_threshold`, metres.
    threshold: Option<f64>,
    /// `staging_x_offset` (m) and `staging_yaw_offset` (rad).
    staging: [Option<f64>; 2],
    /// The position of the docked base in the frame of a detection, metres, if detections are used.
    detection: Option<[f64; 2]>,
}

impl Plugin {
    fn of(
        document: &Document<'_>,
        server: Server<'_>,
        kind: Option<&str>,
    ) -> Result<Self, SiteError> {
        let Some(server) = server else {
            return Ok(Self::default());
        };
        let kind = match kind {
            Some(kind) => Some(kind),
            None => match server.get("dock_plugins").map(|list| document.list(list)) {
                Some(Ok([only])) => Some(document.text(only)?),
                _ => None,
            },
        };
        let of_plugin = |key: &str| parameter(server, &[kind?, key]);
        let number = |key: &str| match of_plugin(key) {
            Some(node) => document.number(node).map(Some),
            None => Ok(None),
        };
        let truth = |node: Option<&Node>| match node {
            Some(node) => match document.text(node)? {
                "true" | "True" | "TRUE" => Ok(true),
                "false" | "False" | "FALSE" => Ok(false),
                other => Err(document
                    .error(node.at.clone(), format!("found `{other}`"))
                    .expected("true or false")
                    .help("write true or false")),
            },
            None => Ok(false),
        };
        let of_dock = match of_plugin("dock_direction") {
            Some(node) => {
                let word = document.text(node)?;
                // Nav2 reads it in any case.
                let direction =
                    DockDirection::named(&word.to_ascii_lowercase()).ok_or_else(|| {
                        document
                            .error(node.at.clone(), format!("the dock direction is `{word}`"))
                            .expected("\"forward\" or \"backward\"")
                            .help("write one of them")
                    })?;
                Some((direction, node.at.clone()))
            }
            None => None,
        };
        let of_server = match server.get("dock_backwards") {
            Some(node) if truth(Some(node))? => Some((DockDirection::Backward, node.at.clone())),
            Some(node) => Some((DockDirection::Forward, node.at.clone())),
            None => None,
        };
        let direction = match (of_dock, of_server) {
            (Some((of_dock, _)), Some((of_server, at))) if of_dock != of_server => {
                return Err(document
                    .error(
                        at,
                        format!(
                            "dock_backwards says {}, and dock_direction of the plugin says {}",
                            of_server.name(),
                            of_dock.name()
                        ),
                    )
                    .expected("one direction: versions of Nav2 differ in the one that they use")
                    .help("remove dock_backwards, which is the old parameter, or correct it"));
            }
            (of_dock, of_server) => of_dock.or(of_server),
        };
        let threshold = number("docking_threshold")?;
        if let Some(metres) = threshold
            && !(metres > 0.0 && metres <= LARGEST_THRESHOLD)
        {
            let at = of_plugin("docking_threshold").map_or(0..0, |node| node.at.clone());
            return Err(document
                .error(at, format!("docking_threshold is {metres}"))
                .expected(format!("metres, above 0 and at most {LARGEST_THRESHOLD}"))
                .help("write 0.05, Nav2's default, for 50 mm"));
        }
        let detection = if truth(of_plugin("use_external_detection_pose"))? {
            let [x, y] =
                ["x", "y"].map(|axis| number(&format!("external_detection_translation_{axis}")));
            Some([x?.unwrap_or(0.0), y?.unwrap_or(0.0)])
        } else {
            None
        };
        Ok(Self {
            direction,
            threshold,
            staging: [number("staging_x_offset")?, number("staging_yaw_offset")?],
            detection,
        })
    }

    /// Adds what follows for a dock from the offsets.
    fn remark(&self, name: &str, [x, y, theta]: [f64; 3], remarks: &mut Vec<String>) {
        if self.staging != [None; 2] {
            let [ahead, turn] = self.staging.map(|offset| offset.unwrap_or(0.0));
            let (sin, cos) = libm::sincos(theta);
            remarks.push(format!(
                "the staging pose of `{name}` is x = {}, y = {}, yaw_deg = {}",
                tidy(x + ahead * cos),
                tidy(y + ahead * sin),
                tidy_angle((theta + turn).to_degrees())
            ));
        }
        if let Some([x, y]) = self.detection {
            remarks.push(format!(
                "Nav2 docks `{name}` where the dock is detected, with an offset of ({x} m, {y} m): the goal is that of the file, so the dock must \
                 not move"
            ));
        }
        if let Some(metres) = self.threshold {
            remarks.push(format!(
                "the task `{name}` is a disc of docking_threshold, {metres} m, and any heading: Nav2 checks none"
            ));
        }
    }
}
