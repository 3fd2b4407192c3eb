//! Estimates with true poses: their errors relative to their own covariance.

use super::LearnError;
use nalgebra::{Matrix3, Vector3};
use posegate_files::sheet::{Column, Line, Sheet, SheetError, each};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

const COVARIANCE: [&str; 6] = [
    "cov_xx",
    "cov_xy",
    "cov_xyaw",
    "cov_yy",
    "cov_yyaw",
    "cov_yawyaw",
];
const POSES: [&str; 6] = [
    "x_m",
    "y_m",
    "yaw_rad",
    "true_x_m",
    "true_y_m",
    "true_yaw_rad",
];

/// One estimate, and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// `e' P^-1 e`, e being the estimate minus the truth with the yaw wrapped.
    pub squared_distance: f64,
    /// A number that may separate good estimates from bad ones: the time since the last fix, or the size of P.
    pub condition: f64,
    /// The run of the row, of one robot or source. Rows of a run are consecutive in time.
    pub run: u32,
    /// The index of the row's group in [`ScoredEstimates::groups`].
    pub group: u32,
}

/// The rows of a file of estimates with truth.
#[derive(Clone, Debug, PartialEq)]
pub struct ScoredEstimates {
    /// Rows with a possible covariance: run by run, each in order of time, or of the file if it has no times.
    pub rows: Vec<Scored>,
    /// The lines of rows with an impossible covariance, or with a condition that is not finite.
    pub impossible: Vec<u64>,
    /// The number of rows without a true pose (three empty fields), which are left out.
    pub without_truth: u64,
    /// The column of the condition; `log_det` for the logarithm of the covariance's determinant.
    pub condition: String,
    /// `true` if the file has times, `t_s`.
    pub timed: bool,
    /// The names in the column `robot`, or else in `run`. Empty without such a column.
    pub groups: Vec<String>,
    /// The column of the groups.
    pub grouped_by: &'static str,
    /// SHA-256 of the file.
    pub sha256: [u8; 32],
}

/// The condition if the file has no column for one.
pub(super) const LOG_DET: &str = "log_det";

impl ScoredEstimates {
    /// Reads `x_m, y_m, yaw_rad, cov_xx, cov_xy, cov_xyaw, cov_yy, cov_yyaw, cov_yawyaw, true_x_m, true_y_m,
    /// true_yaw_rad`. The condition is the named column, else the first one with a name `since_..._s`, else the
    /// covariance's size. Rows without a true pose are left out. Rows with the same names in the columns `robot`, `source` and `run` are a run, in the order of
    /// `t_s`. The groups are the robots, or else the runs.
    ///
    /// # Errors
    /// A missing column; the first invalid field, with its line and column; a file without rows.
    pub fn read(bytes: &[u8], file: &str, condition: Option<&str>) -> Result<Self, LearnError> {
        let mut sheet = Sheet::new(bytes, file)?;
        let all: Vec<&str> = POSES.iter().chain(&COVARIANCE).copied().collect();
        let needed = |name| sheet.needed(name, &all);
        let (poses, covariance) = (each(POSES, needed)?, each(COVARIANCE, needed)?);
        let since = |name: &&String| name.starts_with("since_") && name.ends_with("_s");
        let condition = condition
            .map(ToOwned::to_owned)
            .or_else(|| sheet.names().iter().find(since).cloned())
            .unwrap_or_else(|| LOG_DET.to_owned());
        let place = condition_place(&sheet, &condition)?;
        let time = sheet.optional("t_s")?;
        let [robot, source, run] = ["robot", "source", "run"].map(|name| sheet.first(name));
        let (grouping, grouped_by) = match (robot, run) {
            (Some(robot), _) => (Some(robot), "robot"),
            (None, run) => (run, "run"),
        };
        let mut found = Self {
            rows: Vec::new(),
            impossible: Vec::new(),
            without_truth: 0,
            condition,
            timed: time.is_some(),
            groups: Vec::new(),
            grouped_by,
            sha256: Sha256::digest(bytes).into(),
        };
        let mut scored: Vec<([String; 3], f64, Scored)> = Vec::new();
        let mut groups: BTreeMap<String, u32> = BTreeMap::new();
        while let Some(line) = sheet.line()? {
            let [_, _, _, truth @ ..] = poses;
            if truth.iter().all(|column| line.text(*column).is_empty()) {
                found.without_truth += 1;
                continue;
            }
            let what = "a number in metres or radians";
            let at = each(poses, |column| line.number(column, |_| true, what))?;
            let matrix = covariance_of(&line, covariance)?;
            let condition = condition_of(&line, place, &matrix)?;
            let now = match time {
                Some(column) => line.number(column, |_| true, "a time in seconds")?,
                None => 0.0,
            };
            let text = |place: Option<Column>| place.map_or("", |at| line.text(at)).to_owned();
            let who = [robot, source, run].map(text);
            let [x, y, yaw, true_x, true_y, true_yaw] = at;
            let e = Vector3::new(x - true_x, y - true_y, wrapped(yaw - true_yaw));
            match matrix.cholesky() {
                Some(factor) if condition.is_finite() => {
                    let squared_distance = e.dot(&factor.solve(&e));
                    if grouping.is_some() {
                        groups.entry(text(grouping)).or_default();
                    }
                    let row = Scored {
                        squared_distance,
                        condition,
                        run: 0,
                        group: 0,
                    };
                    scored.push((who, now, row));
                }
                _ => found.impossible.push(line.number),
            }
        }
        // Restores each run's own order: the file may interleave sources and have rows in any order.
        scored.sort_by(|a, b| a.0.cmp(&b.0).then_with(|| a.1.total_cmp(&b.1)));
        for (index, group) in groups.values_mut().enumerate() {
            *group = index as u32;
        }
        found.groups = groups.keys().cloned().collect();
        let mut number = 0u32;
        for index in 0..scored.len() {
            number += u32::from(index > 0 && scored[index].0 != scored[index - 1].0);
            let group = match grouped_by {
                "robot" => &scored[index].0[0],
                _ => &scored[index].0[2],
            };
            found.rows.push(Scored {
                run: number,
                group: groups.get(group).copied().unwrap_or(0),
                ..scored[index].2
            });
        }
        if found.rows.is_empty() && found.impossible.is_empty() && found.without_truth == 0 {
            return Err(LearnError::Empty {
                file: file.to_owned(),
            });
        }
        Ok(found)
    }
}

/// Returns the conditions of estimates without truth, in the file's order: NaN for an impossible covariance; `None` if
/// the file has no column for it.
///
/// # Errors
/// A missing column; the first invalid field, with its line and column.
pub fn conditions(
    bytes: &[u8],
    file: &str,
    condition: &str,
) -> Result<Vec<Option<f64>>, LearnError> {
    let mut sheet = Sheet::new(bytes, file)?;
    let covariance = each(COVARIANCE, |name| sheet.needed(name, &COVARIANCE))?;
    let place = condition_place(&sheet, condition).ok();
    let mut rows = Vec::new();
    while let Some(line) = sheet.line()? {
        let matrix = covariance_of(&line, covariance)?;
        let value = match place {
            Some(place) => Some(condition_of(&line, place, &matrix)?),
            None => None,
        };
        let possible = matrix.cholesky().is_some();
        rows.push(if possible { value } else { Some(f64::NAN) });
    }
    Ok(rows)
}

/// Returns the condition's column; `None` for the covariance's size.
fn condition_place(sheet: &Sheet<&[u8]>, condition: &str) -> Result<Option<Column>, SheetError> {
    if condition == LOG_DET {
        return Ok(None);
    }
    let missing = || sheet.missing(condition, &[condition]);
    sheet.first(condition).map(Some).ok_or_else(missing)
}

fn covariance_of(line: &Line<'_>, columns: [Column; 6]) -> Result<Matrix3<f64>, SheetError> {
    let [xx, xy, xt, yy, yt, tt] =
        each(columns, |column| line.number(column, |_| true, "a number"))?;
    Ok(Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt))
}

fn condition_of(
    line: &Line<'_>,
    place: Option<Column>,
    covariance: &Matrix3<f64>,
) -> Result<f64, SheetError> {
    match place {
        Some(column) => line.number(column, |_| true, "a number"),
        None => Ok(libm::log(covariance.determinant())),
    }
}

/// Returns an angle in [-pi, pi).
fn wrapped(angle: f64) -> f64 {
    const TURN: f64 = core::f64::consts::TAU;
    angle - TURN * libm::floor((angle + 0.5 * TURN) / TURN)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad,since_fix_s\n";

    fn read(text: &str) -> Result<ScoredEstimates, String> {
        ScoredEstimates::read(text.as_bytes(), "e.csv", None).map_err(|error| format!("{error}"))
    }

    #[test]
    fn squared_distance_is_the_mahalanobis_distance() {
        let found = read(&format!(
            "robot,{HEADER}a,1,1,2,3.1,4,0,0,1,0,0.01,0,0,-3.1,0.5\na,2,0,0,0,1,2,0,1,0,1,0,0,0,1\nb,1,0,0,0,1,0,0,1,0,1,0,0,0,2\n"
        ))
        .unwrap();
        // 1/4 + 4 + (2 pi - 6.2)^2 / 0.01.
        let yaw = core::f64::consts::TAU - 6.2;
        let expected = 0.25 + 4.0 + yaw * yaw / 0.01;
        assert!((found.rows[0].squared_distance - expected).abs() < 1e-9);
        assert_eq!((found.rows[0].condition, found.rows[1].run), (0.5, 1));
        assert_eq!(found.impossible, [3]);
        assert_eq!(found.condition, "since_fix_s");
    }

    /// Each interleaved source is a run, in any order of the rows.
    #[test]
    fn each_source_is_a_run_in_order_of_time() {
        let row = |source: &str, t: u32| format!("{source},{t},0,0,0,1,0,0,1,0,1,0,0,0,{t}\n");
        let rows = [("b", 2), ("a", 1), ("b", 1), ("a", 3), ("a", 2)];
        let text: String = rows.iter().map(|(source, t)| row(source, *t)).collect();
        let found = read(&format!("source,{HEADER}{text}")).unwrap();
        let order: Vec<(u32, f64)> = found.rows.iter().map(|r| (r.run, r.condition)).collect();
        assert_eq!(order, [(0, 1.0), (0, 2.0), (0, 3.0), (1, 1.0), (1, 2.0)]);
        assert!(found.timed);
    }

    #[test]
    fn errors_state_file_line_and_column() {
        let error = read(&format!("{HEADER}1,1,2,3.1,4,0,0,1,0,nan,0,0,0,0.5\n")).unwrap_err();
        assert!(
            error.starts_with("e.csv:2:10: `nan` in `cov_yawyaw`"),
            "{error}"
        );
        let error = read(&format!("{HEADER}1,1,2,3.1,4,0,0,1,0,1,0,0,0,x\n")).unwrap_err();
        assert!(
            error.starts_with("e.csv:2:14: `x` in `since_fix_s`"),
            "{error}"
        );
        let error = read(&HEADER.replace("true_x_m", "x")).unwrap_err();
        assert!(error.contains("no column `true_x_m`"), "{error}");
    }
}
