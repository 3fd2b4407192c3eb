//! Rows of the error budgets, measured: a search for the largest true error of a row, against exact numbers, must come near its bound and
//! never above. `cargo xtask error_budgets` prints all rows.

mod exact;

pub(crate) use exact::Exact;

/// A small generator.
pub(crate) struct Random(u64);

impl Random {
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + self.unit() * (high - low)
    }

    /// A magnitude, as likely in each octave.
    pub fn log_within(&mut self, low: f64, high: f64) -> f64 {
        (self.within(low.ln(), high.ln())).exp()
    }

    pub fn sign(&mut self) -> f64 {
        if self.unit() < 0.5 { -1.0 } else { 1.0 }
    }
}

/// A row of an error budget.
pub(crate) struct Row<'a> {
    /// The module, and the error.
    pub name: &'a str,
    /// The unit of the bound and of the error.
    pub unit: &'a str,
    /// The reason why the error stays below 0.3 of the bound, if it does.
    pub looseness: Option<&'a str>,
}

/// The largest error of a row that a search has found, relative to the bound that holds for it.
pub(crate) struct Search {
    ratio: f64,
    bound: f64,
    found: f64,
    count: u64,
}

impl Search {
    pub fn new() -> Self {
        Self {
            ratio: f64::NEG_INFINITY,
            bound: 0.0,
            found: 0.0,
            count: 0,
        }
    }

    /// Adds a case: its bound, and its true error.
    pub fn case(&mut self, bound: f64, found: f64) {
        let ratio = found / bound;
        self.count += 1;
        // An error that is not a number is the largest one, and stays so.
        if !self.ratio.is_nan() && !(ratio <= self.ratio) {
            (self.ratio, self.bound, self.found) = (ratio, bound, found);
        }
    }

    /// Prints the row, and checks the largest ratio.
    pub fn report(&self, row: &Row<'_>) {
        let Self {
            ratio,
            bound,
            found,
            count,
        } = self;
        let why = row.looseness.unwrap_or_default();
        std::println!(
            "{{\"name\":\"{}\",\"value\":{ratio:.4},\"unit\":\"of the bound\",\"goal\":1,\"bound\":{bound:e},\"found\":{found:e},\"error_unit\":\"{}\",\"cases\":{count},\"looseness\":\"{why}\"}}",
            row.name,
            row.unit
        );
        assert!(*ratio <= 1.0, "{}: {found} above {bound}", row.name);
        assert!(
            *ratio >= 0.3 || row.looseness.is_some() || cfg!(miri),
            "{}: {found} is far below {bound}: tighten the bound, or state why it is loose",
            row.name
        );
    }
}

/// A case that is not a number fails its row, whatever comes after it.
#[test]
#[should_panic(expected = "above")]
fn case_that_is_not_a_number_stays() {
    let mut search = Search::new();
    search.case(0.0, 0.0);
    search.case(1.0, 0.5);
    search.report(&Row {
        name: "a row",
        unit: "",
        looseness: None,
    });
}
