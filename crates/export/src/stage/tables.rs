//! Trees as CSV and GeoPackage.

use super::survey::Survey;
use crate::gpkg::GeoPackage;
use crate::layers::{CROWNS, TREETOPS};
use crate::{Error, csv_table};
use std::fs::File;
use std::io::BufWriter;
use timberline_artefact::stage::{Context, StageError};
use timberline_artefact::{Crs, OutputFolder};

/// Writes the tables.
pub(super) fn write(
    survey: &Survey,
    context: &Context<'_>,
    folder: &mut OutputFolder,
) -> Result<(), StageError> {
    let crs = survey.crs.clone().unwrap_or_default();
    let path = folder.file("trees.csv");
    let out = BufWriter::new(File::create(&path).map_err(Error::io(&path, "create"))?);
    survey.trees.visit(|trees| csv_table::write_trees(out, &path, &crs, trees))?;
    let path = folder.file("trees.dictionary.csv");
    let out = BufWriter::new(File::create(&path).map_err(Error::io(&path, "create"))?);
    csv_table::write_dictionary(out, &path, &crs)?;
    context.check_cancelled()?;
    let mut package = GeoPackage::create(&folder.file("trees.gpkg"), &crs)?;
    for layer in [&TREETOPS, &CROWNS] {
        survey.trees.visit(|trees| package.add_layer(layer, trees))?;
        context.check_cancelled()?;
    }
    let about = "How these layers were made: program, campaign, stages with their parameters";
    package.add_attributes("run", about, &run_rows(survey, context, &crs))?;
    package.finish()?;
    Ok(())
}

/// Names and values that say where the trees come from.
fn run_rows(survey: &Survey, context: &Context<'_>, crs: &Crs) -> Vec<(String, String)> {
    let program = concat!("Timberline ", env!("CARGO_PKG_VERSION"));
    let mut rows = vec![
        ("program".to_owned(), program.to_owned()),
        ("campaign".to_owned(), context.campaign().name.clone()),
        ("crs".to_owned(), crs.name.clone()),
        ("metres per unit of x and y".to_owned(), crs.horizontal_m_per_unit.to_string()),
        ("metres per unit of z".to_owned(), crs.vertical_m_per_unit.to_string()),
    ];
    // How the campaign was cut into tiles is no property of the result.
    let totals = survey.totals().into_iter().filter(|(name, _)| name != "tiles");
    rows.extend(totals.map(|(name, value)| (name, value.to_string())));
    for (stage, (version, params)) in &survey.stages {
        rows.push((format!("stage {stage} version"), version.to_string()));
        rows.push((format!("stage {stage} parameters"), params.clone()));
    }
    rows
}
