//! A learnt error model: bounds on the error of an observation of a tag, by distance and angles.

use super::LearnError;
use super::axis::PARTS;
use super::binomial::clopper_pearson;
use super::cells::{Cells, flat, numbered};
use super::document::{self, Document};
use super::family::Family;
use super::smooth::{Lattice, between};
use posegate_files::printable::hex;

mod scaled;

/// Bounds on the errors of an observation, and the share of detected views.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorModel {
    document: Document,
    cells: Cells,
    /// The logarithms of the two bounds at the corners of each fine cell; `None` for a cell without bounds.
    bounds: Vec<Option<[[f64; 8]; 2]>>,
    views: Option<(Cells, Vec<f64>)>,
    /// `true` if the model was scaled to tags of another size than those of the data.
    is_scaled: bool,
}

/// The share of detected views at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detectability {
    /// The smoothed share.
    pub share: f64,
    /// Clopper-Pearson limits, 95 %, of the share in the cell around the place.
    pub limits: [f64; 2],
}

/// A region whose cells were calibrated together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionReport {
    /// The ends of d (m), phi and psi (degrees): see [`Detection::at`](super::Detection::at).
    pub ends: [[f64; 2]; 3],
    /// Detections on which the region was calibrated.
    pub detections: u64,
    /// The number of independent detections with the same information.
    pub independent: u64,
    /// The rank of the score used as the factor; 0 if there were too few.
    pub rank: u64,
}

/// A part of (d, phi, psi) without bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct CellReport {
    /// The ends of d (m), phi and psi (degrees): see [`Detection::at`](super::Detection::at).
    pub ends: [[f64; 2]; 3],
    /// Detections in this part.
    pub detections: u64,
    /// The reason why there are no bounds.
    pub why: String,
}

impl ErrorModel {
    /// Reads a model from the text of its file; errors name it `file`.
    ///
    /// # Errors
    /// The text is not a model of this kind: another version, an unknown or a missing key, or parts that do not
    /// match.
    pub fn parse(text: &str, file: &str) -> Result<Self, LearnError> {
        let document = super::model_file::parse::<Document>(text, file)?;
        Self::new(document, file)
    }

    /// Returns the camera and the tags of the detections, if the model states them.
    #[must_use]
    pub const fn taken_with(&self) -> Option<&super::TakenWith> {
        self.document.taken_with.as_ref()
    }

    /// Returns the text of the model's file.
    ///
    /// # Errors
    /// [`LearnError::Unwritten`] for a model that was scaled to other tags. It does not happen for a model that was learnt
    /// or read.
    pub fn write(&self) -> Result<String, LearnError> {
        if self.is_scaled {
            return Err(LearnError::Unwritten(
                "it is scaled to other tags than those of its data".to_owned(),
            ));
        }
        super::model_file::write(&self.document)
    }

    pub(super) fn new(document: Document, file: &str) -> Result<Self, LearnError> {
        let wrong = |what: &str| LearnError::Model {
            file: file.to_owned(),
            what: what.to_owned(),
        };
        if document.posegate_model != document::VERSION || document.kind != "bounds" {
            return Err(wrong("it is not an error model of version 1"));
        }
        if let Some(what) = document
            .taken_with
            .as_ref()
            .and_then(super::TakenWith::fault)
        {
            return Err(wrong(what));
        }
        for share in [document.quantile, document.confidence] {
            if !(share > 0.0 && share < 1.0) {
                return Err(wrong("`quantile` and `confidence` are above 0 and below 1"));
            }
        }
        let cells = Cells::of(&document.edges, document.parts.unwrap_or(PARTS))
            .ok_or_else(|| wrong("`edges` do not ascend"))?;
        let families = families(&document, &cells).map_err(&wrong)?;
        let steps = steps(&document, &cells, &families).map_err(|what| wrong(&what))?;
        let bounds = bounds(&cells, &families, &steps);
        let share = &document.p_detect;
        let views = if share.share.is_empty() {
            None
        } else {
            let views = Cells::of(&share.edges, PARTS)
                .and_then(|cells| {
                    let values = flat(&cells, &share.share, |p| p > 0.0 && p < 1.0)?;
                    let count: usize = cells.coarse().iter().product();
                    let independent = [0, count].contains(&share.independent.len());
                    let counted = share.views.len() == count && share.detected.len() == count;
                    let counted = counted && independent;
                    let fit = share.views.iter().zip(&share.detected).all(|(n, k)| k <= n);
                    (counted && fit).then(|| (cells, values.into_iter().map(logit).collect()))
                })
                .ok_or_else(|| wrong("the parts of `p_detect` do not fit together"))?;
            Some(views)
        };
        Ok(Self {
            document,
            cells,
            bounds,
            views,
            is_scaled: false,
        })
    }

    /// Returns the share Q of the detections for which each of the two bounds is valid.
    #[must_use]
    pub fn quantile(&self) -> f64 {
        self.document.quantile
    }

    /// Returns the share of the detections for which both bounds are valid, for any dependence between them: `2 Q -
    /// 1`, at least 0.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        (2.0 * self.document.quantile - 1.0).max(0.0)
    }

    /// Returns bounds on the errors of a detection at d (m), phi and psi (rad), as in
    /// [`Detection::at`](super::Detection::at): metres and radians. `None` if the model has no bounds there. On the
    /// border between cells, the larger bounds. Takes some 150 ns.
    #[must_use]
    pub fn bounds(&self, d: f64, phi: f64, psi: f64) -> Option<(f64, f64)> {
        self.bounds_deg([d, phi.to_degrees(), psi.to_degrees()])
    }

    /// Like [`ErrorModel::bounds`], with angles in degrees: metres and radians.
    #[must_use]
    pub fn bounds_deg(&self, at: [f64; 3]) -> Option<(f64, f64)> {
        let axes = &self.cells.axes;
        let [d, phi, psi] = [
            axes[0].touched(at[0])?,
            axes[1].touched(at[1])?,
            axes[2].touched(at[2])?,
        ];
        let mut worst = [f64::NEG_INFINITY; 2];
        for i in d[0]..=d[1] {
            for j in phi[0]..=phi[1] {
                for k in psi[0]..=psi[1] {
                    let logs = self.logs_in([i, j, k], self.cells.through([i, j, k], at))?;
                    worst = [worst[0].max(logs[0]), worst[1].max(logs[1])];
                }
            }
        }
        Some((libm::exp(worst[0]), libm::exp(worst[1])))
    }

    /// Returns the logarithms of the bounds in a fine cell.
    pub(super) fn logs_in(&self, cell: [usize; 3], through: [f64; 3]) -> Option<[f64; 2]> {
        let corners = self.bounds[numbered(self.cells.fine(), cell)].as_ref()?;
        Some([between(&corners[0], through), between(&corners[1], through)])
    }

    pub(super) fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Returns the share of detected views at a distance (m) and angles (degrees); `None` if there are too few
    /// views.
    #[must_use]
    pub fn detectability_deg(&self, at: [f64; 3]) -> Option<Detectability> {
        let (cells, logits) = self.views.as_ref()?;
        let cell = cells.cell(at)?;
        let number = cells.number(cells.coarse_of(cell));
        let share = &self.document.p_detect;
        let (views, detected) = (share.views[number], share.detected[number]);
        let lattice = Lattice::over(&cells.axes);
        let logit = lattice.spot(cell, cells.through(cell, at)).value(logits);
        (views >= FEWEST_VIEWS).then(|| Detectability {
            share: super::smooth::share_of(logit),
            limits: limits(
                detected,
                views,
                share.independent.get(number).copied(),
                0.95,
            ),
        })
    }

    /// Returns lower limits of the shares of detected views, cell by cell, all of which are valid with a probability of
    /// 1 - `alpha`; 0 for a cell with too few views.
    pub(super) fn detection_limits(&self, alpha: f64) -> Vec<f64> {
        let share = &self.document.p_detect;
        let enough = |views: &u64| *views >= FEWEST_VIEWS;
        let cells = share.views.iter().filter(|views| enough(views)).count();
        let confidence = 1.0 - 2.0 * alpha / cells.max(1) as f64;
        let each = share.views.iter().zip(&share.detected).enumerate();
        each.map(|(number, (views, detected))| {
            let independent = share.independent.get(number).copied();
            if enough(views) {
                limits(*detected, *views, independent, confidence)[0]
            } else {
                0.0
            }
        })
        .collect()
    }

    /// Returns the share of detected views at a distance (m) and angles (degrees), and its limit among `limits`; `None`
    /// if there is no limit above 0.
    pub(super) fn expected_share(&self, at: [f64; 3], limits: &[f64]) -> Option<(f64, f64)> {
        let (cells, _) = self.views.as_ref()?;
        let least = *limits.get(cells.number(cells.coarse_of(cells.cell(at)?)))?;
        let share = self.detectability_deg(at)?.share;
        (least > 0.0).then_some((share, least))
    }

    /// Returns the numbers of views and detections in the data, and the share of flips: detections with psi of 10
    /// degrees or more whose yaw error is larger than psi.
    #[must_use]
    pub fn counts(&self) -> (u64, u64, f64) {
        let data = &self.document.data;
        (data.views, data.detections, data.flip_share)
    }

    /// Returns `true` if the model was learnt from the file with this SHA-256.
    #[must_use]
    pub fn is_of(&self, sha256: &[u8; 32]) -> bool {
        self.document.data.sha256 == hex(sha256)
    }

    /// Returns `true` if the bounds are for the better one of the two poses that fit a tag's image, instead of the
    /// pose that a detector chose. Such bounds are for a gate that uses both poses as hypotheses.
    #[must_use]
    pub fn is_of_better_pose(&self) -> bool {
        self.document.data.of_better_pose
    }

    /// Returns the number of rows in the file; `None` if no rows were left out by drawing.
    #[must_use]
    pub fn drawn_of(&self) -> Option<u64> {
        self.document.data.drawn_of
    }

    /// Returns the number of views in the data, and the number of independent views with the same information.
    #[must_use]
    pub fn independent(&self) -> (u64, u64) {
        let data = &self.document.data;
        (data.views, data.independent.unwrap_or(data.views))
    }

    /// Returns the number of runs (drives, videos, approaches) in the data; `None` if rows were taken as independent.
    #[must_use]
    pub fn runs(&self) -> Option<u64> {
        self.document.data.runs
    }

    /// Returns the regions.
    pub fn regions(&self) -> impl Iterator<Item = RegionReport> {
        self.document.region.iter().map(|region| RegionReport {
            ends: [region.d_m, region.phi_deg, region.psi_deg],
            detections: region.detections,
            independent: region.independent.unwrap_or(region.detections),
            rank: region.rank,
        })
    }

    /// Returns the index of the region at a distance (m) and angles (degrees); `None` if it is in no region.
    #[must_use]
    pub fn region_deg(&self, at: [f64; 3]) -> Option<usize> {
        let coarse = self.cells.coarse_of(self.cells.cell(at)?);
        self.document.cell[self.cells.number(coarse)].region
    }

    /// Returns the cells without bounds. There are no bounds outside of all cells either.
    pub fn refused(&self) -> impl Iterator<Item = CellReport> {
        self.document.cell.iter().filter_map(|cell| {
            Some(CellReport {
                ends: [cell.d_m, cell.phi_deg, cell.psi_deg],
                detections: cell.detections,
                why: cell.refused.clone()?,
            })
        })
    }

    /// Returns the ends of d (m), phi and psi (degrees) between which there are cells.
    #[must_use]
    pub fn reach(&self) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|i| {
            let edges = &self.cells.axes[i].edges;
            [edges[0], edges[edges.len() - 1]]
        })
    }
}

/// The fewest views of a cell whose share of detected ones is stated.
const FEWEST_VIEWS: u64 = 10;

/// Returns the limits of a share. If the views depend on each other, they count as `independent` views; the number of
/// detected ones is rounded outwards.
fn limits(detected: u64, views: u64, independent: Option<u64>, confidence: f64) -> [f64; 2] {
    match independent {
        None => clopper_pearson(detected, views, confidence),
        Some(0) => [0.0, 1.0],
        Some(n) => {
            let hits = detected as f64 / views.max(1) as f64 * n as f64;
            let low = clopper_pearson(libm::floor(hits) as u64, n, confidence);
            let high = clopper_pearson(libm::ceil(hits) as u64, n, confidence);
            [low[0], high[1]]
        }
    }
}

fn logit(share: f64) -> f64 {
    libm::log(share / (1.0 - share))
}

/// Returns the nested shapes of both bounds.
fn families(document: &Document, cells: &Cells) -> Result<[Family; 2], &'static str> {
    let shapes: Vec<&document::Shape> = match (&document.narrower, &document.wider) {
        (Some(narrower), Some(wider)) => std::vec![narrower, &document.shape, wider],
        (None, None) => std::vec![&document.shape],
        _ => return Err("of `narrower` and `wider` there is only one"),
    };
    let family = |of: fn(&document::Shape) -> &document::Corners| {
        let values: Option<Vec<Vec<f64>>> = shapes
            .iter()
            .map(|shape| flat(cells, of(shape), |value| value > 0.0))
            .collect();
        let values = values.ok_or("`shape` has no number above 0 at each corner")?;
        Family::new(&values).ok_or("`narrower`, `shape` and `wider` do not ascend at each corner")
    };
    Ok([
        family(|shape| &shape.translation_m)?,
        family(|shape| &shape.yaw_rad)?,
    ])
}

/// Returns the steps of each coarse cell. A file with one shape has factors instead: a step doubles.
fn steps(
    document: &Document,
    cells: &Cells,
    families: &[Family; 2],
) -> Result<Vec<Option<[f64; 2]>>, String> {
    let count = cells.each_coarse().count();
    if document.cell.len() != count {
        return Err(format!(
            "{} cells; the edges make {count}",
            document.cell.len()
        ));
    }
    let mut steps = Vec::new();
    for (coarse, cell) in cells.each_coarse().zip(&document.cell) {
        let number = steps.len();
        if cells.ends(coarse) != [cell.d_m, cell.phi_deg, cell.psi_deg] {
            return Err(format!("cell {number} does not lie between the edges"));
        }
        let of = match (cell.region, &cell.refused) {
            (None, Some(_)) if cell.own.is_none() => None,
            (Some(region), None) => {
                let region = document
                    .region
                    .get(region)
                    .filter(|region| region.rank > 0)
                    .ok_or_else(|| format!("cell {number} names no calibrated region"))?;
                let regional = [region.translation, region.yaw];
                let own = cell.own.unwrap_or(regional);
                let larger = [0, 1].map(|i| own[i].max(regional[i]));
                let [translation, yaw] = [0, 1].map(|i| families[i].step_of(larger[i]));
                let (Some(translation), Some(yaw)) = (translation, yaw) else {
                    return Err(format!(
                        "a factor or step of cell {number} is not a number, or a factor is not above 0"
                    ));
                };
                Some([translation, yaw])
            }
            _ => {
                return Err(format!(
                    "cell {number} needs either a `region` or a reason in `refused`"
                ));
            }
        };
        steps.push(of);
    }
    Ok(steps)
}

/// Returns the logarithms of the bounds at each fine cell's corners: shape times factor, not decreasing with distance
/// at the same angles.
fn bounds(
    cells: &Cells,
    families: &[Family; 2],
    steps: &[Option<[f64; 2]>],
) -> Vec<Option<[[f64; 8]; 2]>> {
    let lattice = Lattice::over(&cells.axes);
    let fine = cells.fine();
    let mut bounds = std::vec![None; fine.iter().product()];
    for j in 0..fine[1] {
        for k in 0..fine[2] {
            let mut nearer = [[f64::NEG_INFINITY; 4]; 2];
            for i in 0..fine[0] {
                let cell = [i, j, k];
                let Some(step) = steps[cells.number(cells.coarse_of(cell))] else {
                    continue;
                };
                let corners = lattice.corners(cell);
                let mut here = [[0.0; 8]; 2];
                for which in [0, 1] {
                    for n in 0..4 {
                        let at = |n: usize| families[which].log(corners[n], step[which]);
                        let near = at(n).max(nearer[which][n]);
                        here[which][n] = near;
                        here[which][n + 4] = at(n + 4).max(near);
                        nearer[which][n] = here[which][n + 4];
                    }
                }
                bounds[numbered(fine, cell)] = Some(here);
            }
        }
    }
    bounds
}
