//! Terrain and canopy height models of every site.

use super::Params;
use super::survey::Survey;
use crate::crs::unit_name;
use crate::geotiff::{RasterSpec, Source, write_raster};
use crate::{Error, Mosaic, Window, vrt};
use std::fs::File;
use std::io::BufWriter;
use timberline_artefact::stage::{Context, StageError};
use timberline_artefact::{Crs, OutputFolder};
use timberline_pointcloud::sites::file_name;
use timberline_pointcloud::{closing, gridding};

/// Writes both rasters.
pub(super) fn write(
    survey: &mut Survey,
    params: &Params,
    context: &Context<'_>,
    folder: &mut OutputFolder,
) -> Result<(), StageError> {
    let crs = survey.crs.clone().unwrap_or_default();
    let sites = survey.footprint.sites();
    let windows = |cell_m| sites.iter().map(|site| Window::touching(site, cell_m)).collect();
    let pool = pool(params, survey.density_per_m2());
    let chm_cell_m = params.chm_cell_m * f64::from(pool);
    let canopy = Product {
        stem: "chm",
        cell_m: chm_cell_m,
        windows: windows(chm_cell_m),
        description: "Highest point of the cell above ground",
        unit: "metre",
        elevation: false,
    };
    let terrain = Product {
        stem: "dtm",
        cell_m: survey.dtm_cell_m,
        windows: windows(survey.dtm_cell_m),
        description: "Terrain elevation at the centre of the cell",
        unit: unit_name(crs.vertical_m_per_unit),
        elevation: true,
    };
    let Survey { chm, dtm, .. } = survey;
    let cancelled = || context.check_cancelled().map_err(StageError::from);
    canopy
        .write(&crs, folder, &cancelled, &mut |window| canopy_values(chm, window, pool, params))?;
    let dtm_cell_m = terrain.cell_m;
    let mut values = |window| terrain_values(dtm, chm, window, dtm_cell_m, params);
    terrain.write(&crs, folder, &cancelled, &mut values)
}

/// One raster product of all sites.
struct Product {
    stem: &'static str,
    cell_m: f64,
    windows: Vec<Window>,
    description: &'static str,
    unit: &'static str,
    elevation: bool,
}

impl Product {
    fn write(
        &self,
        crs: &Crs,
        folder: &mut OutputFolder,
        cancelled: &dyn Fn() -> Result<(), StageError>,
        source: &mut Source<'_>,
    ) -> Result<(), StageError> {
        let Self { stem, cell_m, windows, description, unit, elevation } = self;
        let mut written = Vec::new();
        for (site, window) in windows.iter().enumerate() {
            cancelled()?;
            let spec = RasterSpec {
                cell_m: *cell_m,
                window: *window,
                crs,
                description,
                unit,
                elevation: *elevation,
            };
            let name = file_name(stem, "tif", site, windows.len());
            let path = folder.file(&name);
            let out = BufWriter::new(File::create(&path).map_err(Error::io(&path, "create"))?);
            write_raster(out, &path, &spec, source)?;
            written.push((name, spec));
        }
        if written.len() > 1
            && let Some(xml) = vrt::mosaic_xml(&written)
        {
            let path = folder.file(&format!("{stem}.vrt"));
            std::fs::write(&path, xml).map_err(Error::io(&path, "write"))?;
        }
        Ok(())
    }
}

/// How many cells of `chm_cell_m` along an edge make one of the raster: a power of two.
fn pool(params: &Params, density_per_m2: f64) -> u32 {
    const MOST: u32 = 64;
    let points = |pool: u32| {
        let edge = params.chm_cell_m * f64::from(pool);
        edge * edge * density_per_m2
    };
    let mut pool = 1;
    while points(pool) < params.chm_points_a_cell && pool < MOST {
        pool *= 2;
    }
    pool
}

fn canopy_values(
    canopy: &mut Mosaic,
    window: Window,
    pool: u32,
    params: &Params,
) -> Result<Vec<f32>, Error> {
    let reach = params.chm_fill_cells;
    let around = window.grown(reach);
    let fine = Window {
        column0: around.column0 * i64::from(pool),
        row0: around.row0 * i64::from(pool),
        columns: around.columns * pool,
        rows: around.rows * pool,
    };
    let mut values = vec![f32::NAN; around.len()];
    for (place, value) in canopy.read(fine)?.iter().enumerate() {
        let (row, column) = (place / fine.columns as usize, place % fine.columns as usize);
        let cell = row / pool as usize * around.columns as usize + column / pool as usize;
        values[cell] = values[cell].max(*value);
    }
    Ok(gridding::fill_gaps(&values, window, reach))
}

/// The terrain where there are points, and across gaps between them.
fn terrain_values(
    terrain: &mut Mosaic,
    canopy: &mut Mosaic,
    window: Window,
    cell_m: f64,
    params: &Params,
) -> Result<Vec<f32>, Error> {
    let mut values = terrain.read(window)?;
    if values.iter().all(|value| value.is_nan()) {
        return Ok(values);
    }
    let canopy_cell = params.chm_cell_m;
    let centre = |index: i64| (index as f64 + 0.5) * cell_m;
    let cell_at = |index: i64| (centre(index) / canopy_cell).floor() as i64;
    let (column0, row0) = (cell_at(window.column0), cell_at(window.row0));
    let mask_window = Window {
        column0,
        row0,
        columns: (cell_at(window.end_column() - 1) - column0 + 1) as u32,
        rows: (cell_at(window.end_row() - 1) - row0 + 1) as u32,
    };
    let reach = (params.dtm_gap_m / 2.0 / canopy_cell).ceil() as u32;
    let around = canopy.read(mask_window.grown(2 * reach))?;
    let occupied: Vec<bool> = around.iter().map(|value| !value.is_nan()).collect();
    let mask = closing::closed(&occupied, mask_window, reach);
    for row in window.row0..window.end_row() {
        for column in window.column0..window.end_column() {
            if !mask[mask_window.index(cell_at(column), cell_at(row))] {
                values[window.index(column, row)] = f32::NAN;
            }
        }
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sparse_points_get_larger_cells() {
        let params = Params::default();
        let found = [12.0, 2.0, 1.6, 0.3, 0.0].map(|density| pool(&params, density));
        assert_eq!(found, [1, 1, 2, 4, 64]);
        assert_eq!(pool(&Params { chm_points_a_cell: 0.0, ..params }, 0.1), 1);
    }

    #[test]
    fn pooled_cells_keep_the_highest() {
        let folder = tempfile::tempdir().unwrap();
        let mut canopy = Mosaic::new(folder.path()).unwrap();
        let fine = Window { column0: -4, row0: 2, columns: 4, rows: 2 };
        canopy.push(fine, &[1.0, f32::NAN, 5.0, 2.0, 3.0, 0.0, f32::NAN, 4.0]).unwrap();
        let params = Params { chm_fill_cells: 0, ..Params::default() };
        let window = Window { column0: -2, row0: 1, columns: 2, rows: 1 };
        assert_eq!(canopy_values(&mut canopy, window, 2, &params).unwrap(), [3.0, 5.0]);
    }
}
