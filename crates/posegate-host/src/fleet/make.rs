//! How a piece is made.

use serde_json::{Value, json};

use super::error::PieceError;
use super::finished::Files;
use super::piece::{Asked, Piece, Recipe};
use super::proof;
use crate::plan::{PlanError, Prepared};
use crate::site::Site;
use posegate::bake::BakeInput;
use posegate::verify::{BuildError, VerifyError, build};

/// A task's table, as `posegate table build` makes it, and the result of its proof. Nothing unproven comes of it.
pub(super) fn table(site: &Site, recipe: &Recipe, name: &str) -> Result<Files, PieceError> {
    // An inventory is of its site: it has the task.
    let Some(task) = site.tasks.get(name) else {
        return Ok(Vec::new());
    };
    let order = BakeInput {
        task: name,
        success: &task.success,
        spec: site.chosen_table(task).ok_or(PieceError::NoExtent)?,
        epsilon: site.epsilon,
        site_digest: site.digest,
    };
    let (bytes, proof) = build(&order, &|| ())?;
    let told = proof::told(name, &bytes, proof.into(), recipe)
        .map_err(|error| BuildError::Verify(VerifyError::Table(error)))?;
    Ok(vec![
        (Piece::table_path(name), bytes),
        (Piece::proof_path(name), told),
    ])
}

/// A plan, as `posegate plan --json` prints it. A site with nothing to look at has no plan, and the piece says so.
pub(super) fn plan(
    site: &Site,
    prepared: Option<&mut Prepared<'_>>,
    asked: &Asked,
    from: &str,
    to: &str,
) -> Result<Files, PieceError> {
    let path = Piece::plan_path(from, to);
    let Some(chain) = site.chains.get(from) else {
        return Ok(Vec::new());
    };
    let told = match prepared {
        Some(prepared) => prepared.plan(&chain.start, to, &asked.options())?.to_json(),
        None => json!({
            "success": false, "steps": [], "cost": null, "risk": null, "status": "infeasible",
            "reason": format!("{}", PlanError::NoLooks(site.tags.len())),
        }),
    };
    Ok(vec![(path, line(&told))])
}

fn line(value: &Value) -> Vec<u8> {
    format!("{value}\n").into_bytes()
}
