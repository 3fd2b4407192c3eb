//! Checks that the controller has enough time for a step of the gate on each task's table.

use super::Warning;
use super::warning::warn;
use posegate::bake::{self, BakeError, BakeInput};
use posegate::table::Table;
use posegate_site::controller_cost;
use posegate_site::{Core, Site};

/// Returns a warning for each task on whose table a step of a gate in C may take more cycles than the site's controller has, both evaluations and the
/// checks of the gate included ([`controller_cost`]); no warning if the site has no controller. Bakes each table, without the proof.
///
/// The proof may omit pieces of a table, which makes a step cheaper: the bound here is that of the complete table.
///
/// # Errors
/// The name of the first task whose table cannot be baked, and the error.
pub fn decision_costs(site: &Site) -> Result<Vec<Warning>, (String, BakeError)> {
    let Some(controller) = &site.controller else {
        return Ok(Vec::new());
    };
    let mut all = Vec::new();
    for (name, task) in &site.tasks {
        let Some(spec) = site.chosen_table(task) else {
            continue;
        };
        let input = BakeInput {
            task: name,
            success: &task.success,
            spec,
            epsilon: site.epsilon,
        };
        let bytes = match bake::table(&input, &|| ()) {
            Ok(bytes) => bytes,
            // Another warning of `doctor` reports this.
            Err(BakeError::Empty { .. }) => continue,
            Err(error) => return Err((name.clone(), error)),
        };
        let Ok(table) = Table::parse(&bytes) else {
            continue;
        };
        let (level, has_tracker) = (controller.level, controller.has_tracker);
        let cost = controller_cost::cost(&table, controller.core, level, has_tracker);
        let cycles = controller.cycles(cost.with_fix);
        let core = match controller.core {
            Core::CortexM4F => "Cortex-M4F",
            Core::CortexM0Plus => "Cortex-M0+",
            Core::Rv32Imc => "RV32IMC",
        };
        if cycles > f64::from(controller.cycles_per_decision) {
            // What the file says already is no advice.
            let mut advice = Vec::new();
            if table.grid().is_some() {
                advice.push("use `layout = \"facets\"` instead of cells");
            }
            advice.extend([
                "make the success set simpler",
                "lengthen the control cycle and `cycles_per_decision`",
            ]);
            if controller.cycles_per_instruction.is_none() {
                advice.push("state `cycles_per_instruction` as measured (it counts as 2)");
            }
            all.push(warn(
                "decision_too_long",
                ["task", name],
                format!(
                    "{} on its table may take {cycles:.0} cycles of a {core}; the controller has {} for it",
                    if has_tracker {
                        "a cycle of the gate and its tracker with a late fix"
                    } else {
                        "a step of the gate"
                    },
                    controller.cycles_per_decision
                ),
                &advice.join("; or "),
            ));
        }
    }
    Ok(all)
}
