//! The tree file of raycloudtools and treetools (Lowe and Stepanas 2021; format in the README of
//! csiro-robotics/treetools): comment lines, a line with the fields, then one line a tree with its
//! segments separated by a comma and a space. The first segment is the root without a parent; every other
//! one is a capsule from its parent's position to its own.

use super::Model;
use std::fmt::Write as _;

/// One tree, positions in metres in the world. Where a branch does not begin at the end of its parent,
/// the format leaves no gap: its first capsule begins at the parent's end.
#[must_use]
pub fn write(model: &Model<'_>) -> String {
    let mut text = format!(
        "# tree {} in metres, {}\n# source: 0 measured, 1 interpolated, 2 inferred; sd: standard error \
         of the radius, m, -1 for none\nx,y,z,radius,parent_id,branch,order,source,sd\n",
        model.qsm.tree_id,
        model.crs.name.replace(['\n', '\r'], " ")
    );
    let Some(root) = model.qsm.cylinders.first() else { return text };
    segment(
        &mut text,
        model,
        root.start_m,
        root.radius_m,
        -1,
        [0, 0, root.source as i64],
        f64::NAN,
    );
    for cylinder in &model.qsm.cylinders {
        let parent = cylinder.parent.map_or(0, |parent| i64::from(parent) + 1);
        let order = model.qsm.branches.get(cylinder.branch as usize).map_or(0, |b| b.order);
        text += ", ";
        let numbers = [i64::from(cylinder.branch), i64::from(order), cylinder.source as i64];
        let sd_m = cylinder.radius_sd_m;
        segment(&mut text, model, cylinder.end_m, cylinder.radius_m, parent, numbers, sd_m);
    }
    text.push('\n');
    text
}

fn segment(
    text: &mut String,
    model: &Model<'_>,
    local_m: [f64; 3],
    radius_m: f64,
    parent: i64,
    [branch, order, source]: [i64; 3],
    sd_m: f64,
) {
    let [x, y, z] = model.frame.world_from_local(local_m);
    let sd_m = if sd_m.is_finite() { sd_m } else { -1.0 };
    // Writing into a string cannot fail.
    write!(text, "{x:.6},{y:.6},{z:.6},{radius_m:.6},{parent},{branch},{order},{source},{sd_m:.6}")
        .unwrap_or_default();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{FRAME, fork};
    use timberline_artefact::Crs;

    #[test]
    fn segments_name_their_parents() {
        let (qsm, crs) = (fork(7), Crs::default());
        let text = write(&Model { qsm: &qsm, frame: FRAME, crs: &crs });
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4);
        let segments: Vec<&str> = lines[3].split(", ").collect();
        assert_eq!(segments.len(), qsm.cylinders.len() + 1);
        assert_eq!(
            segments[0],
            "500000.500000,5000000.500000,1000.000000,0.200000,-1,0,0,0,-1.000000"
        );
        let parents: Vec<&str> = segments.iter().map(|s| s.split(',').nth(4).unwrap()).collect();
        assert_eq!(parents, ["-1", "0", "1", "2", "2"]);
    }
}
