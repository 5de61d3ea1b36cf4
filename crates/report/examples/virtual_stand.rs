//! Draws a map and a picture of every kind of artefact from a virtual stand and its truth.
//!
//!     cargo run --release -p timberline-report --example virtual_stand -- FOLDER [POINTS]

#![allow(clippy::print_stdout, reason = "an example")]

use std::path::PathBuf;
use timberline_artefact::kinds::{CrownModel, CrownStatus, Treetop};
use timberline_artefact::{Crs, tree_id};
use timberline_pointcloud::{PointCloud, Rect, Window, gridding};
use timberline_report::map::{MapContents, MapTree, draw};
use timberline_report::pictures::{Heading, PointColour, crown_models, points, raster, treetops};
use timberline_report::{Canvas, Grid};
use timberline_synth::{Scene, Tree, benchmark};

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("give a folder for the pictures")?);
    let size = arguments.next().map_or(Ok(200_000), |points| points.parse())?;
    std::fs::create_dir_all(&folder)?;
    let scene = Scene::new(benchmark::stand(size, 7))?;
    let area = scene.params().area;
    let cloud = scene.points_in(&area);
    let crs = Crs { epsg: Some(32610), name: "WGS 84 / UTM zone 10N".to_owned(), ..Crs::default() };
    let subtitle = format!("{} points", cloud.len());
    let heading = Heading { title: "A virtual stand", subtitle: &subtitle, crs: &crs };
    let save = |name: &str, canvas: Canvas| -> Result<()> {
        println!("{name}: {} x {}", canvas.width(), canvas.height());
        Ok(canvas.write_png(&folder.join(name))?)
    };
    let (terrain, heights) = (terrain(&scene, &area), heights(&scene, &cloud));
    let canopy = canopy(&cloud, &heights);
    let trees: Vec<&Tree> = scene.forest().trees.iter().filter(|t| is_seen(t, &scene)).collect();
    let on_map: Vec<MapTree> = trees.iter().map(|tree| on_map(tree, &scene)).collect();
    save(
        "map.png",
        draw(&MapContents {
            title: heading.title,
            subtitle: heading.subtitle,
            extent: area,
            crs: &crs,
            terrain: &terrain,
            canopy: &canopy,
            trees: &on_map,
        })?,
    )?;
    save("terrain.png", raster(&heading, &terrain, "Elevation [m]")?)?;
    let by_height = PointColour::Value(&heights, "Above ground [m]");
    save("points-height.png", points(&heading, &cloud, by_height)?)?;
    save("points-class.png", points(&heading, &cloud, PointColour::Class)?)?;
    let tops: Vec<Treetop> = trees.iter().map(|tree| treetop(tree, &scene)).collect();
    save("treetops.png", treetops(&heading, &tops)?)?;
    let models: Vec<CrownModel> = trees.iter().map(|tree| model(tree, &scene)).collect();
    save("crown-models.png", crown_models(&heading, &models)?)
}

fn is_seen(tree: &Tree, scene: &Scene) -> bool {
    let [x, y, _] = scene.frame().world_from_local(tree.crown.top_m);
    tree.visible && scene.params().area.contains(x, y)
}

fn terrain(scene: &Scene, area: &Rect) -> Grid {
    let mut grid = Grid::empty(Window::touching(area, 1.0), 1.0);
    let window = grid.window;
    for row in window.row0..window.end_row() {
        for column in window.column0..window.end_column() {
            let z = scene.terrain().elevation_m(column as f64 + 0.5, row as f64 + 0.5);
            grid.values[window.index(column, row)] = z as f32;
        }
    }
    grid
}

fn heights(scene: &Scene, cloud: &PointCloud) -> Vec<f32> {
    let above = |index: usize| {
        let [x, y, z] = cloud.world(index);
        (z - scene.terrain().elevation_m(x, y)) as f32
    };
    (0..cloud.len()).map(above).collect()
}

fn canopy(cloud: &PointCloud, heights: &[f32]) -> Grid {
    let (window, values) = gridding::highest(cloud, heights, 0.5);
    let mut around = Grid::empty(window.grown(2), 0.5);
    around.raise(window, &values);
    Grid { cell_m: 0.5, window, values: gridding::fill_gaps(&around.values, window, 2) }
}

fn on_map(tree: &Tree, scene: &Scene) -> MapTree {
    let [x, y, _] = scene.frame().world_from_local(tree.crown.top_m);
    let corner = |i: u32| {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 24.0);
        let [x, y, _] = scene.frame().world_from_local(tree.crown.on_surface_m(cosine, sine));
        [x, y]
    };
    MapTree { top_m: [x, y], crown_m: (0..24).map(corner).collect() }
}

fn treetop(tree: &Tree, scene: &Scene) -> Treetop {
    let apex_m = scene.frame().world_from_local(tree.crown.top_m);
    let id = tree_id(apex_m[0], apex_m[1]);
    Treetop { id, apex_m, height_m: tree.top_above_ground_m(), ..Treetop::default() }
}

fn model(tree: &Tree, scene: &Scene) -> CrownModel {
    let top = treetop(tree, scene);
    let seen = if tree.exposed < 0.3 { CrownStatus::TooFewPoints } else { CrownStatus::Accepted };
    CrownModel {
        id: top.id,
        apex_m: top.apex_m,
        height_m: top.height_m,
        radius_m: tree.crown.radius_m(),
        status: seen,
        ..CrownModel::default()
    }
}
