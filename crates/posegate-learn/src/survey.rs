//! Compares the places of docks and tags in the site file with logs of dockings.

use super::LearnError;
use super::quantiles::fisher_quantile;
use nalgebra::{Cholesky, Const, Matrix3, Vector3};
use posegate_files::sheet::{Sheet, each};
use std::collections::BTreeMap;

/// The fewest dockings from which an offset and its region follow.
const FEWEST: usize = 5;
/// Offsets have no scatter if their deviation is less than this share of their mean and [`SMALL`]: the rest is
/// rounding.
const SCATTER: f64 = 1e-9;
/// A length (m) and an angle (rad) that is small for any mean.
const SMALL: f64 = 1e-3;
/// An offset follows from others if the rest of its variance is less than this share of it.
const LEFT: f64 = 1e-9;

/// The goals of a site's docks, by the name of the task, and the places of its tags.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurveyedSite {
    /// The goal of each dock, by its task's name: x, y (m), yaw (rad), world frame.
    pub docks: BTreeMap<String, [f64; 3]>,
    /// The place of each tag, by its name: x, y (m), world frame.
    pub tags: BTreeMap<String, [f64; 2]>,
}

/// A robot in contact with a dock, localized by one tag.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// The docking, unique at its dock: rows of one docking depend on each other.
    pub run: String,
    /// The name of the dock's task.
    pub dock: String,
    /// The tag's name.
    pub tag: String,
    /// The robot's pose at contact, computed from the surveyed place of the tag: x, y (m), yaw (rad), world frame.
    pub pose: [f64; 3],
}

/// A dock or a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Surveyed {
    /// A dock: the goal of a task.
    Dock,
    /// A tag.
    Tag,
}

/// The offset of a dock or a tag from its place in the site file.
#[derive(Clone, Debug, PartialEq)]
pub struct OffsetReport {
    /// The kind of object.
    pub kind: Surveyed,
    /// The object's name.
    pub name: String,
    /// Number of dockings with the object.
    pub dockings: u64,
    /// The true place minus that of the site file: x, y (m, world axes), yaw (rad). `None` if there are too few dockings.
    pub offset: Option<[f64; 3]>,
    /// Half the extent of the confidence region of the offset along each of x, y (m, world axes) and yaw (rad). `None`
    /// if there are too few dockings, or if their offsets do not scatter independently in x, y and yaw: such numbers are
    /// not measurements, and the offset is not tested.
    pub region: Option<[f64; 3]>,
    /// Hotelling's statistic of the offset over the limit beyond which the offset is significant: significant above 1.
    pub significance: f64,
    /// `true` if the object must be surveyed again: its offset is significant, and explains the looks better than any
    /// other.
    pub stale: bool,
    /// Other objects whose offset explains the looks equally well, because the objects were only seen together.
    pub or: Vec<(Surveyed, String)>,
}

/// Reads looks. Columns: `run` (the docking; dockings at different docks are different, even with equal names),
/// `dock` (the name of its task), `tag`, and `x_m, y_m, yaw_rad`, the robot's pose at contact that follows from a
/// look at that tag.
///
/// # Errors
/// A missing column; the first invalid field, with its line and column; a dock or a tag that the site does not have; a file without rows.
pub fn looks(bytes: &[u8], file: &str, site: &SurveyedSite) -> Result<Vec<Look>, LearnError> {
    const ALL: [&str; 6] = ["run", "dock", "tag", "x_m", "y_m", "yaw_rad"];
    let mut sheet = Sheet::new(bytes, file)?;
    let [run, dock, tag, pose @ ..] = each(ALL, |name| sheet.needed(name, &ALL))?;
    let mut rows = Vec::new();
    while let Some(line) = sheet.line()? {
        let known = |column, names: &mut dyn Iterator<Item = &String>, what: &str| {
            let name = line.name(column, what)?;
            let mut others = Vec::new();
            for known in names {
                if known == name {
                    return Ok(name.to_owned());
                }
                others.push(known.as_str());
            }
            let has = others.join(", ");
            let what = format!("`{name}` is not a {what} of the site; it has: {has}");
            Err(line.wrong_at(column, what))
        };
        let what = "a number in metres or radians";
        let pose = each(pose, |column| line.number(column, |_| true, what))?;
        rows.push(Look {
            run: line.name(run, "the name of the docking")?.to_owned(),
            dock: known(dock, &mut site.docks.keys(), "work task")?,
            tag: known(tag, &mut site.tags.keys(), "tag")?,
            pose,
        });
    }
    if rows.is_empty() {
        return Err(LearnError::Empty {
            file: file.to_owned(),
        });
    }
    Ok(rows)
}

/// Returns the offsets of docks and tags. The significant ones are found one after the other: the one that leaves
/// least to explain is removed from the looks, and the others are tested again. If all places agree with the site
/// file, any object is stale with a probability of at most 1 - `confidence`.
///
/// A dock's offset in a docking is the mean over its looks of the localized pose minus the goal. A tag's offset is
/// the displacement of the tag, in world axes, that explains the difference. Each is tested by Hotelling's
/// T-squared test over dockings, with the error divided by the number of docks and tags. This assumes independent
/// dockings, whose errors are normal and have no mean: neither a bias of the camera, nor play on one side of the
/// dock.
///
/// # Errors
/// [`LearnError::Share`] if the confidence is not in (0, 1).
pub fn survey(
    looks: &[Look],
    site: &SurveyedSite,
    confidence: f64,
) -> Result<Vec<OffsetReport>, LearnError> {
    if !(confidence > 0.0 && confidence < 1.0) {
        return Err(LearnError::Share {
            name: "confidence",
            value: confidence,
        });
    }
    let mut residuals: Vec<Residual> = looks.iter().filter_map(|look| of(look, site)).collect();
    let mut objects: Vec<(Surveyed, String)> = Vec::new();
    for look in looks {
        objects.push((Surveyed::Dock, look.dock.clone()));
        objects.push((Surveyed::Tag, look.tag.clone()));
    }
    objects.sort();
    objects.dedup();
    let level = 1.0 - (1.0 - confidence) / objects.len().max(1) as f64;
    let mut found: BTreeMap<(Surveyed, String), OffsetReport> = BTreeMap::new();
    while found.len() < objects.len() {
        let left = objects.iter().filter(|object| !found.contains_key(*object));
        let reports: Vec<OffsetReport> = left
            .map(|(kind, name)| report(&residuals, *kind, name, level))
            .collect();
        let Some(best) = best(&residuals, &objects, &reports, level) else {
            for report in reports {
                found.insert((report.kind, report.name.clone()), report);
            }
            break;
        };
        // Docks and tags of the same looks have the same statistic and cannot be distinguished.
        let same = |report: &&OffsetReport| {
            (report.kind, &report.name) != (best.kind, &best.name)
                && mates(
                    &residuals,
                    (best.kind, &best.name),
                    (report.kind, &report.name),
                )
        };
        let or = reports.iter().filter(same);
        let best = OffsetReport {
            stale: true,
            or: or
                .map(|report| (report.kind, report.name.clone()))
                .collect(),
            ..best.clone()
        };
        take_off(&mut residuals, &best);
        found.insert((best.kind, best.name.clone()), best);
    }
    Ok(found.into_values().collect())
}

/// Returns the significant offset after whose removal the sum of the significant statistics is least. If several are
/// equal (only seen together), the first: a dock before a tag.
fn best<'a>(
    residuals: &[Residual],
    objects: &[(Surveyed, String)],
    reports: &'a [OffsetReport],
    level: f64,
) -> Option<&'a OffsetReport> {
    let mut best: Option<(f64, &OffsetReport)> = None;
    for candidate in reports.iter().filter(|report| report.significance > 1.0) {
        let mut rest = residuals.to_vec();
        take_off(&mut rest, candidate);
        let others = objects
            .iter()
            .map(|(kind, name)| report(&rest, *kind, name, level));
        let left: f64 = others.map(|report| report.significance).sum();
        if best.is_none_or(|(least, _)| left < least * (1.0 - 1e-6) - 1e-9) {
            best = Some((left, candidate));
        }
    }
    best.map(|(_, report)| report)
}

/// The localized pose at contact minus the goal, and the lever that converts it into a displacement of the tag.
#[derive(Clone)]
struct Residual {
    run: String,
    dock: String,
    tag: String,
    difference: Vector3<f64>,
    /// From the tag to the dock's goal, metres.
    lever: [f64; 2],
}

fn of(look: &Look, site: &SurveyedSite) -> Option<Residual> {
    let goal = site.docks.get(&look.dock)?;
    let tag = site.tags.get(&look.tag)?;
    let turn = look.pose[2] - goal[2];
    Some(Residual {
        run: look.run.clone(),
        dock: look.dock.clone(),
        tag: look.tag.clone(),
        difference: Vector3::new(
            look.pose[0] - goal[0],
            look.pose[1] - goal[1],
            libm::atan2(libm::sin(turn), libm::cos(turn)),
        ),
        lever: [goal[0] - tag[0], goal[1] - tag[1]],
    })
}

impl Residual {
    /// Returns the displacement of the tag that explains the difference. A tag that is displaced by t and turned by a
    /// changes the localized pose by -t - a J lever, and -a, J being a quarter turn to the left.
    fn of_tag(&self) -> Vector3<f64> {
        let turn = -self.difference.z;
        let [x, y] = self.lever;
        Vector3::new(
            -self.difference.x + turn * y,
            -self.difference.y - turn * x,
            turn,
        )
    }

    /// Returns the change of the localized pose by a displacement of the tag.
    fn by_tag(&self, tag: Vector3<f64>) -> Vector3<f64> {
        let [x, y] = self.lever;
        Vector3::new(-tag.x + tag.z * y, -tag.y - tag.z * x, -tag.z)
    }

    fn is_of(&self, kind: Surveyed, name: &str) -> bool {
        name == match kind {
            Surveyed::Dock => &self.dock,
            Surveyed::Tag => &self.tag,
        }
    }
}

/// Returns `true` if every look at one is a look at the other.
fn mates(residuals: &[Residual], a: (Surveyed, &str), b: (Surveyed, &str)) -> bool {
    residuals
        .iter()
        .all(|residual| residual.is_of(a.0, a.1) == residual.is_of(b.0, b.1))
}

fn report(residuals: &[Residual], kind: Surveyed, name: &str, level: f64) -> OffsetReport {
    // One observation per docking.
    let mut runs: BTreeMap<(&str, &str), (Vector3<f64>, f64)> = BTreeMap::new();
    for residual in residuals
        .iter()
        .filter(|residual| residual.is_of(kind, name))
    {
        let offset = match kind {
            Surveyed::Dock => residual.difference,
            Surveyed::Tag => residual.of_tag(),
        };
        let sum = runs.entry((&residual.dock, &residual.run)).or_default();
        *sum = (sum.0 + offset, sum.1 + 1.0);
    }
    let offsets: Vec<Vector3<f64>> = runs.values().map(|(sum, count)| sum / *count).collect();
    let count = offsets.len();
    let mut report = OffsetReport {
        kind,
        name: name.to_owned(),
        dockings: count as u64,
        offset: None,
        region: None,
        significance: 0.0,
        stale: false,
        or: Vec::new(),
    };
    if count < FEWEST {
        return report;
    }
    let n = count as f64;
    let mean = offsets.iter().sum::<Vector3<f64>>() / n;
    let scatter: Matrix3<f64> = offsets
        .iter()
        .map(|offset| (offset - mean) * (offset - mean).transpose())
        .sum();
    let covariance = scatter / (n - 1.0);
    let limit = 3.0 * (n - 1.0) / (n - 3.0) * fisher_quantile(level, 3.0, n - 3.0);
    report.offset = Some([mean.x, mean.y, mean.z]);
    // Looks without scatter are not a sample and give no result.
    if let Some(factor) = scattered(mean, covariance) {
        report.region = Some([0, 1, 2].map(|k| libm::sqrt(limit * covariance[(k, k)] / n)));
        report.significance = n * mean.dot(&factor.solve(&mean)) / limit;
    }
    report
}

/// Returns the Cholesky factor of a covariance. `None` if a coordinate does not scatter, or follows from the ones
/// before it.
fn scattered(mean: Vector3<f64>, covariance: Matrix3<f64>) -> Option<Cholesky<f64, Const<3>>> {
    let factor = covariance.cholesky()?;
    let lower = factor.l_dirty();
    let scatters = |k: usize| {
        let (variance, pivot) = (covariance[(k, k)], lower[(k, k)] * lower[(k, k)]);
        let least = SCATTER * (mean[k].abs() + SMALL);
        variance >= least * least && pivot >= LEFT * variance
    };
    (0..3).all(scatters).then_some(factor)
}

/// Subtracts the effect of an offset from the looks.
fn take_off(residuals: &mut [Residual], report: &OffsetReport) {
    let Some([x, y, yaw]) = report.offset else {
        return;
    };
    let offset = Vector3::new(x, y, yaw);
    for residual in residuals {
        if residual.is_of(report.kind, &report.name) {
            residual.difference -= match report.kind {
                Surveyed::Dock => offset,
                Surveyed::Tag => residual.by_tag(offset),
            };
        }
    }
}

#[cfg(test)]
mod tests;
