//! The counts of a campaign, and the line that it prints.

#[derive(Default)]
pub struct Tally {
    pub cases: usize,
    pub permits: usize,
    /// Decisions within one cell of a border, the table's or the true one.
    pub near_border: usize,
    pub false_permits: usize,
    /// Reported margins that are above s*.
    pub false_margins: usize,
    pub escapes: usize,
    /// Tables in use that are not proven when proven again (one in 16 is proven again).
    pub unproven: usize,
    /// Tables that were baked but not proven, and therefore withheld.
    pub withheld: usize,
    pub impossible: usize,
    /// Estimates with a pose-set whose borders were computed for bursts.
    pub bases: usize,
    pub bursts: usize,
    /// Decisions of bursts.
    pub burst_cases: usize,
    /// Pose-sets that turn by more than 0.05 rad, on visibility sets.
    pub bend_cases: usize,
    pub bend_permits: usize,
    /// Permits of sets that a tracker carried.
    pub carried: usize,
    /// Pose-sets about gaps and notches, and permits of them.
    pub gaps: (usize, usize),
    /// Denials whose worst pose was checked; those without one; those whose worst pose is in the success set; and wrong worst poses.
    pub denials: usize,
    pub unnamed: usize,
    pub worst_inside: usize,
    pub wrong_poses: usize,
    pub ratios: Vec<f64>,
    pub cell_ratios: Vec<f64>,
}

impl Tally {
    pub fn add(&mut self, other: Self) {
        self.cases += other.cases;
        self.permits += other.permits;
        self.near_border += other.near_border;
        self.false_permits += other.false_permits;
        self.false_margins += other.false_margins;
        self.escapes += other.escapes;
        self.unproven += other.unproven;
        self.withheld += other.withheld;
        self.impossible += other.impossible;
        self.bases += other.bases;
        self.bursts += other.bursts;
        self.burst_cases += other.burst_cases;
        self.bend_cases += other.bend_cases;
        self.bend_permits += other.bend_permits;
        self.carried += other.carried;
        self.denials += other.denials;
        self.unnamed += other.unnamed;
        self.worst_inside += other.worst_inside;
        self.wrong_poses += other.wrong_poses;
        self.ratios.extend(other.ratios);
        self.cell_ratios.extend(other.cell_ratios);
    }

    /// Returns the line of results.
    pub fn line(&mut self, seed: u64, layout: &str) -> String {
        self.ratios.sort_by(f64::total_cmp);
        let p10 = self.ratios.get(self.ratios.len() / 10).copied();
        let numbers = [
            ("mean_ratio", mean(&self.ratios)),
            ("p10_ratio", p10),
            // Facets have no cells.
            ("mean_cell_ratio", mean(&self.cell_ratios)),
        ]
        .map(|(name, value)| {
            let value = value.map_or("null".to_string(), |v| format!("{v:.4}"));
            format!("\"{name}\": {value}")
        })
        .join(", ");
        let counts = [
            ("ratios", self.ratios.len()),
            ("false_margins", self.false_margins),
            ("escapes", self.escapes),
            ("near_border", self.near_border),
            ("unproven_tables", self.unproven),
            ("withheld_tables", self.withheld),
            ("bases", self.bases),
            ("bursts", self.bursts),
            ("burst_cases", self.burst_cases),
            ("bend_cases", self.bend_cases),
            ("bend_permits", self.bend_permits),
            ("carried_permits", self.carried),
            ("denials", self.denials),
            ("unnamed", self.unnamed),
            ("worst_inside", self.worst_inside),
            ("wrong_poses", self.wrong_poses),
            ("gap_cases", self.gaps.0),
            ("gap_permits", self.gaps.1),
        ]
        .map(|(name, count)| format!("\"{name}\": {count}"))
        .join(", ");
        format!(
            "{{\"cases\": {}, \"permits\": {}, \"false_permits\": {}, {numbers}, {counts}, \"seed\": {seed}, \"layout\": \"{layout}\"}}",
            self.cases, self.permits, self.false_permits
        )
    }

    /// Returns `true` if there is no false permit and no false margin.
    pub fn is_sound(&self) -> bool {
        self.false_permits == 0
            && self.false_margins == 0
            && self.escapes == 0
            && self.unproven == 0
            && self.wrong_poses == 0
    }

    /// Returns `true` if the campaign has enough permits and enough cases near a border to be meaningful.
    pub fn is_meaningful(&self) -> bool {
        let share = self.permits as f64 / self.cases as f64;
        let telling = (0.3..=0.7).contains(&share)
            && 2 * self.near_border >= self.cases
            && self.impossible == 0;
        if !telling {
            eprintln!(
                "not telling: {share:.3} permits, {} of {} near a border, {} impossible",
                self.near_border, self.cases, self.impossible
            );
        }
        telling
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
