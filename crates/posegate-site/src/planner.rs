//! The planner's settings, from TOML.

use std::collections::BTreeMap;

use toml::de::DeTable;

use super::error::{SiteError, Source};
use super::names::Names;
use super::reader::{Node, Table};
use super::syntax::syntax;
use super::{Candidate, ErrorBound, SiteCamera, SiteTag, keys, learnt, success};
use posegate::shape::{PoseDeg, Shape, SuccessSet, Tolerance, Wall};

/// The planner's settings. All costs have one unit of any kind, such as seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Planner {
    /// The cost of a metre of driving.
    pub metre: f64,
    /// The cost of a look, in the unit of `metre`.
    pub look_cost: f64,
    /// The number of places from which each tag may be observed, 1 to 64.
    pub views: u32,
    /// The longest drive, metres.
    pub range: f64,
    /// The smallest margin of each step of a plan, 1 to 8: each pose-set, as many times as large, must be inside.
    pub least_margin: f64,
    /// The localization tasks generated from the site's tags, by name.
    pub looks: BTreeMap<String, GeneratedLook>,
    /// The localization tasks generated from the candidates, by name. Plans do not use them.
    pub offers: BTreeMap<String, GeneratedLook>,
}

impl Planner {
    /// Returns the smallest margin of each step of a plan, rounded up to the unit of proven margins, 2^-16.
    #[must_use]
    pub fn least_margin(&self) -> f64 {
        libm::ceil(self.least_margin * 65_536.0) / 65_536.0
    }
}

/// A localization task generated from a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct GeneratedLook {
    /// The tag's name.
    pub tag: String,
    /// The poses from which the tag is seen well enough. The goal frame is the world frame moved to the tag's place.
    pub success: SuccessSet,
    /// The largest error of the pose that such a look gives.
    pub bound: ErrorBound,
}

impl Default for Planner {
    fn default() -> Self {
        Self {
            metre: 1.0,
            look_cost: 1.0,
            views: 6,
            range: 20.0,
            least_margin: 1.0,
            looks: BTreeMap::new(),
            offers: BTreeMap::new(),
        }
    }
}

pub(super) fn planner(
    node: &Node<'_>,
    names: &Names<'_>,
    candidates: &BTreeMap<String, Candidate>,
) -> Result<Planner, SiteError> {
    let table = node.table(&[
        &keys::PLANNER_LOOK,
        &keys::PLANNER_R,
        &keys::PLANNER_METRE,
        &keys::PLANNER_LOOK_COST,
        &keys::PLANNER_VIEWS,
        &keys::PLANNER_RANGE,
        &keys::PLANNER_LEAST_MARGIN,
    ])?;
    let mut planner = Planner::default();
    let number = |key| match table.optional(key) {
        Some(node) => node.number().map(Some),
        None => Ok(None),
    };
    planner.metre = number(&keys::PLANNER_METRE)?.unwrap_or(planner.metre);
    planner.look_cost = number(&keys::PLANNER_LOOK_COST)?.unwrap_or(planner.look_cost);
    planner.range = number(&keys::PLANNER_RANGE)?.unwrap_or(planner.range);
    planner.least_margin = number(&keys::PLANNER_LEAST_MARGIN)?.unwrap_or(planner.least_margin);
    if let Some(node) = table.optional(&keys::PLANNER_VIEWS) {
        planner.views = node.whole(1..=64)?;
    }
    if let Some(look) = table.optional(&keys::PLANNER_LOOK) {
        let errors = table.required(&keys::PLANNER_R)?;
        planner.looks = looks(&look, &errors, names, true)?;
        let mounted =
            |(name, candidate): (&String, &Candidate)| (name.clone(), candidate.tag.clone());
        let tags: BTreeMap<String, SiteTag> = candidates.iter().map(mounted).collect();
        planner.offers = looks(
            &look,
            &errors,
            &Names {
                tags: &tags,
                ..*names
            },
            false,
        )?;
    }
    Ok(planner)
}

/// Makes one localization task per tag and error bound. Bounds that only the tolerances of tag and camera make
/// impossible are skipped. If all bounds are skipped, an existing tag (`are_there`) gives an error, and a candidate
/// gets no look.
fn looks(
    look: &Node<'_>,
    errors: &Node<'_>,
    names: &Names<'_>,
    are_there: bool,
) -> Result<BTreeMap<String, GeneratedLook>, SiteError> {
    let template = LookTemplate::read(look, errors)?;
    let mut looks = BTreeMap::new();
    for (tag, of) in names.tags {
        let reach = template.far + of.tag.size + of.tolerance.translation;
        let near =
            |(_, wall): &(&String, &Wall)| wall.distance([of.tag.pose.x, of.tag.pose.y]) <= reach;
        let walls: BTreeMap<String, Wall> = names
            .walls
            .iter()
            .filter(near)
            .map(|(name, wall)| (name.clone(), wall.clone()))
            .collect();
        let names = &Names {
            walls: &walls,
            ..*names
        };
        let (mut has_look, mut too_poor) = (false, None);
        for error in &template.errors {
            match template.look((tag, of), *error, names)? {
                LookResult::Look(made) => {
                    has_look = true;
                    looks.insert(template.name(tag, *error), *made);
                }
                LookResult::NotWithTolerance(fault) => {
                    too_poor.get_or_insert(fault);
                }
            }
        }
        if let Some(fault) = too_poor.filter(|_| are_there && !has_look) {
            return Err(fault.help("give `planner.r` an error that is large enough for this tag too, or survey it better"));
        }
    }
    Ok(looks)
}

/// The part of a look that is the same for all tags, and the errors.
struct LookTemplate<'n, 'a> {
    look: &'n Node<'a>,
    /// The largest errors, each `[metres, degrees]`.
    errors: Vec<[f64; 2]>,
    /// `true` if the look names an error model.
    modelled: bool,
    /// The keys of the look as written in the file.
    body: String,
    /// The largest distance of a tag from walls that may hide it, metres. Each look gets only the walls near its tag,
    /// unless the file names the walls.
    far: f64,
}

/// A look, or the reason why there is none.
enum LookResult {
    Look(Box<GeneratedLook>),
    /// With the tag's tolerance no pose is good enough; another error may be possible.
    NotWithTolerance(SiteError),
}

impl<'n, 'a> LookTemplate<'n, 'a> {
    /// Reads `look` and `r` of `[planner]`.
    fn read(look: &'n Node<'a>, errors: &Node<'_>) -> Result<Self, SiteError> {
        let table = look.any_table()?;
        for name in ["tag", "shape", "r"] {
            if table.has(name) {
                return Err(table
                    .error_at_key(name, format!("`{name}` in {}", table.title()))
                    .help(
                        "remove it: the planner looks at every tag, with the errors of its own `r`",
                    ));
            }
        }
        let errors: Vec<[f64; 2]> = errors
            .array()?
            .iter()
            .map(Node::pair)
            .collect::<Result<_, _>>()?;
        if errors.iter().any(|[m, deg]| !(*m > 0.0 && *deg > 0.0)) || errors.is_empty() {
            return Err(look.error("`planner.r` has errors that are not above 0"));
        }
        let modelled = table.has(keys::ERROR_MODEL.name);
        if !modelled && errors.len() > 1 {
            return Err(look
                .error("without an `error_model` a look has one largest error")
                .help("give `r` one entry, or `look` an `error_model`"));
        }
        let body = look.written();
        let body = body
            .trim()
            .trim_start_matches('{')
            .trim_end_matches('}')
            .trim()
            .trim_end_matches(',')
            .to_owned();
        let far = if table.has(keys::WALLS_SEEN.name) {
            f64::INFINITY
        } else {
            table.number(&keys::D_MAX)?
        };
        Ok(Self {
            look,
            errors,
            modelled,
            body,
            far,
        })
    }

    /// Returns the name of a look at a tag: the tag's, and the error if there are several.
    fn name(&self, tag: &str, [translation, _]: [f64; 2]) -> String {
        if self.errors.len() == 1 {
            tag.to_owned()
        } else {
            format!("{tag}@{translation}")
        }
    }

    /// Makes the look at a tag with an error.
    fn look(
        &self,
        (tag, of): (&str, &SiteTag),
        [translation, yaw_deg]: [f64; 2],
        names: &Names<'_>,
    ) -> Result<LookResult, SiteError> {
        let Self { look, body, .. } = self;
        let limit = if self.modelled {
            format!(", r = {{ translation = {translation:?}, yaw_deg = {yaw_deg:?} }}")
        } else {
            String::new()
        };
        let text =
            format!("success = {{ shape = \"visibility\", tag = {tag:?}, {body}{limit} }}\n");
        let wrong = |fault: SiteError| look.error(format!("a look at `{tag}`: {}", fault.message));
        let source = Source {
            file: look.file(),
            text: &text,
        };
        let document = DeTable::parse(&text).map_err(|fault| wrong(syntax(source, &fault)))?;
        let root = Table::root(source, &document);
        let set = root.required(&keys::SUCCESS).map_err(wrong)?;
        let shape = match made(&set, names, of).map_err(wrong)? {
            SetResult::Set(shape) => *shape,
            SetResult::NotWithTolerance(fault) => {
                return Ok(LookResult::NotWithTolerance(wrong(fault)));
            }
        };
        let learnt = learnt::limit(&set, names).map_err(wrong)?;
        let goal = PoseDeg {
            x: of.tag.pose.x,
            y: of.tag.pose.y,
            yaw_deg: 0.0,
        };
        Ok(LookResult::Look(Box::new(GeneratedLook {
            tag: tag.to_owned(),
            success: SuccessSet { goal, shape },
            bound: ErrorBound {
                coverage: learnt.map_or(1.0, |learnt| learnt.bound.coverage),
                translation,
                yaw_deg,
            },
        })))
    }
}

/// The success set of a look.
enum SetResult {
    Set(Box<Shape>),
    /// With the tolerances of tag and camera the set is empty; without them it is not.
    NotWithTolerance(SiteError),
}

fn made(set: &Node<'_>, names: &Names<'_>, tag: &SiteTag) -> Result<SetResult, SiteError> {
    let has_views = |shape: &Result<Shape, SiteError>| {
        shape
            .as_ref()
            .is_ok_and(|shape| !shape.never_within_error())
    };
    let shape = success::shape(set, names);
    if has_views(&shape) {
        return shape.map(|shape| SetResult::Set(Box::new(shape)));
    }
    // A look observes one tag, so making all tags exact affects only that one.
    let exact = SiteTag {
        tolerance: Tolerance::NONE,
        ..tag.clone()
    };
    let tags = names.tags.keys().map(|name| (name.clone(), exact.clone()));
    let cameras = names.cameras.iter().map(|(name, camera)| {
        let exact = SiteCamera {
            mount_tolerance: Tolerance::NONE,
            ..*camera
        };
        (name.clone(), exact)
    });
    let (tags, cameras) = (tags.collect(), cameras.collect());
    let exactly = Names {
        tags: &tags,
        cameras: &cameras,
        ..*names
    };
    if !has_views(&success::shape(set, &exactly)) {
        return shape.map(|shape| SetResult::Set(Box::new(shape)));
    }
    Ok(SetResult::NotWithTolerance(match shape {
        Err(fault) => fault,
        Ok(_) => set.error(
            "nowhere in the set is the bound of the error model within `r`, with the error from the tolerances of tag and camera added",
        ),
    }))
}
