//! Costs of drives and looks.

use std::collections::BTreeMap;

use super::PlanError;
use posegate_files::sheet::{Sheet, SheetError, SheetFault, each, settings};

/// Costs of drives and looks.
#[derive(Clone, Debug, Default)]
pub(super) struct Costs {
    /// Cost of one metre.
    pub metre: f64,
    /// Cost of one look.
    pub look: f64,
    /// Drives between places with costs that the user gave, by the places' numbers.
    pub drives: BTreeMap<(usize, usize), f64>,
}

impl Costs {
    /// Returns the cost of a drive between two places, by number.
    pub fn drive(&self, from: usize, to: usize, places: &[[f64; 3]]) -> f64 {
        match self.drives.get(&(from, to)) {
            Some(cost) => *cost,
            None => self.metre * distance(places[from], places[to]),
        }
    }
}

/// Reads lines of `from,to,cost` with names of places. A look's name means all of its places.
///
/// # Errors
/// [`PlanError::Costs`] with file and line if the header or a cost is wrong, or a pair of names has two costs.
pub fn costs(text: &[u8], file: &str) -> Result<BTreeMap<(String, String), f64>, PlanError> {
    const HEADER: [&str; 3] = ["from", "to", "cost"];
    let wrong = |error: SheetError| PlanError::Costs(error.to_string());
    let mut sheet = Sheet::with(settings().quoting(true), text, file).map_err(wrong)?;
    if sheet.names() != HEADER {
        let what = SheetFault::Other("expected the header `from,to,cost`".into());
        return Err(wrong(sheet.wrong_header(None, what)));
    }
    let [from, to, cost] = each(HEADER, |name| sheet.needed(name, &HEADER)).map_err(wrong)?;
    let mut costs = BTreeMap::new();
    while let Some(line) = sheet.line().map_err(wrong)? {
        let cost = line.number(cost, |cost| cost >= 0.0, "a number, at least 0");
        let [from, to] = [from, to].map(|column| line.text(column));
        let before = costs.insert((from.into(), to.into()), cost.map_err(wrong)?);
        if before.is_some() {
            let what = format!("the drive from `{from}` to `{to}` has a cost already");
            return Err(wrong(line.wrong_row(what)));
        }
    }
    Ok(costs)
}

/// Returns the straight distance between two places, in metres.
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_cost_of_a_drive_is_refused() {
        let found = costs(b"from,to,cost\na,b,1\nb,a,2\n", "costs.csv").unwrap();
        assert_eq!(found.len(), 2);
        let twice = costs(b"from,to,cost\na,b,1\na,b,2\n", "costs.csv");
        let words = "costs.csv:3: the drive from `a` to `b` has a cost already";
        assert_eq!(twice, Err(PlanError::Costs(words.into())));
    }
}
