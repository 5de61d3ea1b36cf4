//! The layers of `trees.gpkg`.

use crate::gpkg::{Geometry, Layer};
use crate::tree_columns::TREE_COLUMNS;

/// The highest point of every tree.
pub const TREETOPS: Layer<'static> = Layer {
    name: "treetops",
    description: "Highest point of every tree, with the whole tree table",
    geometry_type: "POINT",
    has_z: true,
    columns: TREE_COLUMNS,
    geometry: |tree, crs| Some(Geometry::Point(crs.crs_from_world(tree.apex_m))),
};

/// The crown outline of every tree that has one.
pub const CROWNS: Layer<'static> = Layer {
    name: "crowns",
    description: "Crown outline of every tree that has one, with the whole tree table",
    geometry_type: "POLYGON",
    has_z: false,
    columns: TREE_COLUMNS,
    geometry: |tree, crs| {
        let corner = |[x, y]: [f64; 2]| {
            let [x, y, _] = crs.crs_from_world([x, y, 0.0]);
            [x, y]
        };
        let ring: Vec<[f64; 2]> = tree.crown_m.iter().copied().map(corner).collect();
        (ring.len() >= 3).then_some(Geometry::Polygon(ring))
    },
};
