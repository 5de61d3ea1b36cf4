//! What is true of a plot, as text: trees, pieces of wood, ground.

use super::plot::PlotScene;
use super::tree_model::{TreeModel, VolumeClass};
use crate::tables::{Table, dtm, number};

/// Highest order of branches that has a column of its own; higher ones are counted with it.
const ORDERS: usize = 5;

/// All trees, one line each.
#[must_use]
pub fn trees(scene: &PlotScene) -> String {
    let mut table = Table::new(concat!(
        "tree_id,species,leaves,dbh_cm,height_m,base_x_m,base_y_m,base_z_m,top_x_m,top_y_m,top_z_m,",
        "crown_base_height_m,crown_area_m2,crown_diameter_m,stem_m3,branches_from_5cm_m3,",
        "branches_below_5cm_m3,cylinders,branches_1,branches_2,branches_3,branches_4,branches_5"
    ));
    scene.trees.iter().for_each(|tree| table.row(&row(tree)));
    table.text
}

fn row(tree: &TreeModel) -> Vec<String> {
    let code = tree.species.map_or("", super::TreeSpecies::code);
    let mut row = vec![tree.id.to_string(), code.to_owned()];
    row.push(u8::from(!tree.leaves.is_empty()).to_string());
    row.extend([number(100.0 * tree.dbh_m(), 2), number(tree.height_m(), 3)]);
    row.extend(tree.base_m.iter().chain(&tree.top_m()).map(|&value| number(value, 3)));
    let sizes = [tree.crown_base_height_m, tree.crown_area_m2(), tree.crown_diameter_m()];
    row.extend(sizes.map(|value| number(value, 3)));
    let classes = [VolumeClass::Stem, VolumeClass::ThickBranches, VolumeClass::ThinBranches];
    row.extend(classes.map(|class| number(tree.volume_m3(class), 6)));
    row.push(tree.cylinders.len().to_string());
    let mut counts = tree.branches_by_order();
    let above: u32 = counts.iter().skip(ORDERS + 1).sum();
    counts.resize(ORDERS + 1, 0);
    counts[ORDERS] += above;
    row.extend(counts[1..].iter().map(u32::to_string));
    row
}

/// Pieces of wood that are at least somewhere as thick as `least_radius_m`, one line each: ends in
/// metres from the plot's corner (eastings and northings) and absolute elevations, radii in
/// millimetres. Pieces are numbered from 1 within their tree; parent 0 is none. As radii never grow
/// from parent to child, the parent of a listed piece is listed.
#[must_use]
pub fn cylinders(scene: &PlotScene, least_radius_m: f64) -> String {
    let mut table = Table::new(concat!(
        "tree_id,cylinder,parent,branch,order,start_x_m,start_y_m,start_z_m,end_x_m,end_y_m,end_z_m,",
        "start_radius_mm,end_radius_mm"
    ));
    for tree in &scene.trees {
        for piece in &tree.cylinders {
            if piece.start_radius_m < least_radius_m {
                continue;
            }
            let parent = piece.parent.map_or(0, |parent| parent + 1);
            let mut row = [tree.id, piece.id + 1, parent, piece.branch, u32::from(piece.order)]
                .iter()
                .map(u32::to_string)
                .collect::<Vec<_>>();
            let ends = [piece.start_m, piece.end_m].map(|end| scene.frame.local_from_world(end));
            row.extend(ends.iter().flatten().map(|&value| number(value, 3)));
            let radii = [piece.start_radius_m, piece.end_radius_m];
            row.extend(radii.map(|radius| number(1000.0 * radius, 1)));
            table.row(&row);
        }
    }
    table.text
}

/// The true ground at the centres of square cells, as an ESRI ASCII raster.
#[must_use]
pub fn terrain(scene: &PlotScene, cell_m: f64) -> String {
    dtm(&scene.terrain, &scene.rect(), cell_m)
}
