//! Truth and field data as text: CSV tables with units in their headers, and an ASCII raster.

use crate::{FieldPlot, PlotKind, Scene, Terrain, Tree};
use std::fmt::Write as _;
use timberline_pointcloud::Rect;

/// A table under construction.
pub(crate) struct Table {
    pub(crate) text: String,
}

impl Table {
    pub(crate) fn new(header: &str) -> Self {
        Self { text: format!("{header}\n") }
    }

    pub(crate) fn row(&mut self, cells: &[String]) {
        self.text.push_str(&cells.join(","));
        self.text.push('\n');
    }
}

pub(crate) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // A rounded -0.00 would differ from 0.00 for no reason.
    if text.bytes().all(|b| matches!(b, b'-' | b'0' | b'.')) { text.replace('-', "") } else { text }
}

/// All trees whose top lies in a world rectangle, one line each.
#[must_use]
pub fn truth_trees(scene: &Scene, rect: &Rect) -> String {
    let mut table = Table::new(concat!(
        "tree_id,stand,species,dbh_cm,height_m,base_x_m,base_y_m,base_z_m,top_x_m,top_y_m,top_z_m,",
        "top_above_ground_m,crown_base_height_m,crown_radius_m,crown_area_m2,crown_x_m,crown_y_m,",
        "crown_semi_axis_a_m,crown_semi_axis_b_m,crown_azimuth_deg,layer,exposed_share,visible"
    ));
    for tree in &scene.forest().trees {
        let [x, y, _] = scene.frame().world_from_local(tree.crown.top_m);
        if rect.contains(x, y) {
            table.row(&truth_row(scene, tree));
        }
    }
    table.text
}

fn truth_row(scene: &Scene, tree: &Tree) -> Vec<String> {
    let frame = scene.frame();
    let base = frame.world_from_local(tree.base_m);
    let top = frame.world_from_local(tree.crown.top_m);
    let [cx, cy] = tree.crown.widest_centre_m();
    let centre = frame.world_from_local([cx, cy, 0.0]);
    let mut row = vec![
        tree.id.to_string(),
        scene.params().stands[usize::from(tree.stand)].name.clone(),
        tree.species.code().to_owned(),
        number(tree.dbh_cm, 2),
    ];
    row.push(number(tree.height_m, 3));
    row.extend(base.iter().chain(&top).map(|&value| number(value, 3)));
    let sizes = [
        tree.top_above_ground_m(),
        tree.crown_base_height_m(),
        tree.crown.radius_m(),
        tree.crown.area_m2(),
        centre[0],
        centre[1],
        tree.crown.semi_axes_m[0],
        tree.crown.semi_axes_m[1],
    ];
    row.extend(sizes.iter().map(|&value| number(value, 3)));
    row.push(number(tree.crown.azimuth_deg(), 1));
    row.push(tree.layer.name().to_owned());
    row.push(number(tree.exposed, 3));
    row.push(u8::from(tree.visible).to_string());
    row
}

/// The plots as recorded: centre with the receiver's error.
#[must_use]
pub fn plots(plots: &[FieldPlot]) -> String {
    let mut table = Table::new("plot,kind,x_m,y_m,radius_m,baf_m2_per_ha,min_dbh_cm,stand");
    for plot in plots {
        let (radius, baf) = match plot.site.kind {
            PlotKind::Fixed { radius_m } => (number(radius_m, 2), String::new()),
            PlotKind::Variable { baf_m2_per_ha } => (String::new(), number(baf_m2_per_ha, 2)),
        };
        let [x, y] = plot.recorded_centre_m;
        table.row(&[
            plot.site.name.clone(),
            plot.site.kind.name().to_owned(),
            number(x, 2),
            number(y, 2),
            radius,
            baf,
            number(plot.min_dbh_cm, 1),
            plot.stand.clone(),
        ]);
    }
    table.text
}

/// The trees measured in the plots; the height is empty where it was not measured.
#[must_use]
pub fn field_trees(plots: &[FieldPlot]) -> String {
    let mut table =
        Table::new("plot,tree,species,dbh_cm,height_m,crown_class,distance_m,bearing_deg");
    for plot in plots {
        for tree in &plot.trees {
            table.row(&[
                plot.site.name.clone(),
                tree.number.to_string(),
                tree.species.code().to_owned(),
                number(tree.dbh_cm, 1),
                tree.height_m.map(|height| number(height, 1)).unwrap_or_default(),
                tree.crown_class.name().to_owned(),
                number(tree.distance_m, 2),
                number(tree.bearing_deg, 1),
            ]);
        }
    }
    table.text
}

/// Where the plots really are, and how far that is from what was recorded.
#[must_use]
pub fn truth_plots(plots: &[FieldPlot]) -> String {
    let mut table = Table::new("plot,true_x_m,true_y_m,position_error_m");
    for plot in plots {
        let ([x, y], [rx, ry]) = (plot.site.centre_m, plot.recorded_centre_m);
        let error = libm::hypot(rx - x, ry - y);
        table.row(&[plot.site.name.clone(), number(x, 3), number(y, 3), number(error, 3)]);
    }
    table.text
}

/// Which true tree each measured tree is.
#[must_use]
pub fn truth_plot_trees(plots: &[FieldPlot]) -> String {
    let mut table = Table::new("plot,tree,tree_id");
    for plot in plots {
        for tree in &plot.trees {
            let ids = [tree.number.to_string(), tree.tree_id.to_string()];
            table.row(&[plot.site.name.clone(), ids[0].clone(), ids[1].clone()]);
        }
    }
    table.text
}

/// The stands: name, area and boundary as well-known text, clipped to nothing.
#[must_use]
pub fn stands(scene: &Scene) -> String {
    let mut table = Table::new("stand,area_ha,boundary_wkt");
    for stand in &scene.params().stands {
        let corners = stand.boundary_m.iter().chain(stand.boundary_m.first());
        let mut ring = String::new();
        for [x, y] in corners {
            let separator = if ring.is_empty() { "" } else { ", " };
            // Writing to a String cannot fail.
            let _ = write!(ring, "{separator}{} {}", number(*x, 2), number(*y, 2));
        }
        table.row(&[
            stand.name.clone(),
            number(stand.area_ha(), 4),
            format!("\"POLYGON (({ring}))\""),
        ]);
    }
    table.text
}

/// The true ground at the centres of square cells, as an ESRI ASCII raster.
///
/// The lower left corner of the raster is that of the rectangle; cells that reach beyond its upper
/// edges are left out.
#[must_use]
pub fn truth_dtm(scene: &Scene, rect: &Rect, cell_m: f64) -> String {
    dtm(scene.terrain(), rect, cell_m)
}

/// See [`truth_dtm`].
pub(crate) fn dtm(terrain: &Terrain, rect: &Rect, cell_m: f64) -> String {
    let [columns, rows] = rect.size().map(|edge| (edge / cell_m + 1e-9).floor() as usize);
    let mut text = format!(
        "ncols {columns}\nnrows {rows}\nxllcorner {}\nyllcorner {}\ncellsize {cell_m}\nNODATA_value -9999\n",
        rect.min[0], rect.min[1]
    );
    for row in (0..rows).rev() {
        let y = rect.min[1] + (row as f64 + 0.5) * cell_m;
        let cells: Vec<String> = (0..columns)
            .map(|column| rect.min[0] + (column as f64 + 0.5) * cell_m)
            .map(|x| number(terrain.elevation_m(x, y), 3))
            .collect();
        text.push_str(&cells.join(" "));
        text.push('\n');
    }
    text
}
