//! The results of a piece.

use serde_json::{Value, json};

use super::error::PieceError;
use super::piece::{Piece, PlanOptions, Recipe};
use super::piece_file::Files;
use super::proof;
use crate::{PlanError, Prepared};
use posegate::bake::BakeInput;
use posegate::verify::{BuildError, VerifyError, build};
use posegate_site::Site;

/// Returns a task's table, as `posegate table build` makes it, and the result of its proof. An unproven table is an
/// error.
pub(super) fn table(site: &Site, recipe: &Recipe, name: &str) -> Result<Files, PieceError> {
    // The inventory is of this site, so the site has the task.
    let Some(task) = site.tasks.get(name) else {
        return Ok(Vec::new());
    };
    let input = BakeInput {
        task: name,
        success: &task.success,
        spec: site.chosen_table(task).ok_or(PieceError::NoExtent)?,
        epsilon: site.epsilon,
    };
    let (bytes, proof) = build(&input, &|| ())?;
    let record = proof::encode(name, &bytes, proof.into(), recipe)
        .map_err(|error| BuildError::Verify(VerifyError::Table(error)))?;
    Ok(vec![
        (Piece::table_path(name), bytes),
        (Piece::proof_path(name), record),
    ])
}

/// Returns a plan, as `posegate plan --json` prints it. If the site has no view of a tag, the result states that
/// there is no plan.
pub(super) fn plan(
    site: &Site,
    prepared: Option<&mut Prepared<'_>>,
    options: &PlanOptions,
    from: &str,
    to: &str,
) -> Result<Files, PieceError> {
    let path = Piece::plan_path(from, to);
    let Some(chain) = site.chains.get(from) else {
        return Ok(Vec::new());
    };
    let plan = match prepared {
        Some(prepared) => prepared
            .plan(&chain.start, to, &options.options())?
            .to_json(),
        None => json!({
            "success": false, "steps": [], "cost": null, "risk": null, "status": "infeasible",
            "reason": format!("{}", PlanError::NoLooks(site.tags.len())),
        }),
    };
    Ok(vec![(path, line(&plan))])
}

fn line(value: &Value) -> Vec<u8> {
    format!("{value}\n").into_bytes()
}
