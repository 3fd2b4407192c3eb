//! Costs of drives and looks.

use std::collections::BTreeMap;

use super::PlanError;

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
    let wrong = |line: u64, what: &str| PlanError::Costs(format!("{file}:{line}: {what}"));
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(text);
    let header = reader
        .headers()
        .map_err(|error| wrong(1, &format!("{error}")))?;
    if header.iter().ne(["from", "to", "cost"]) {
        return Err(wrong(1, "expected the header `from,to,cost`"));
    }
    let mut costs = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, csv::Position::line);
            wrong(line, &format!("{error}"))
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let cost: f64 = record[2]
            .parse()
            .ok()
            .filter(|cost: &f64| *cost >= 0.0 && cost.is_finite())
            .ok_or_else(|| {
                wrong(
                    line,
                    &format!("`{}` is not a cost; write a number, at least 0", &record[2]),
                )
            })?;
        if costs
            .insert((record[0].into(), record[1].into()), cost)
            .is_some()
        {
            let [from, to] = [0, 1].map(|at| &record[at]);
            let what = format!("the drive from `{from}` to `{to}` has a cost already");
            return Err(wrong(line, &what));
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
