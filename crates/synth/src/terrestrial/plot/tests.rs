use super::super::points::Label;
use super::*;

fn small() -> PlotParams {
    let of = |species, dbh| (species, TreeSize::of_dbh(species, dbh));
    PlotParams {
        edge_m: 10.0,
        trees: vec![
            of(TreeSpecies::NorwaySpruce, 0.2),
            (
                TreeSpecies::EuropeanBeech,
                TreeSize::of_dbh(TreeSpecies::EuropeanBeech, 0.15).leafless(),
            ),
        ],
        positions: 3,
        scan: ScanParams::tls().with_step(0.4),
        understorey: Understorey { shrubs: 2, saplings: 1, herbs_per_m2: 1.0 },
        ..PlotParams::default()
    }
}

#[test]
fn trees_stand_on_the_ground_apart_from_each_other_and_from_instruments() {
    let scene = plot(5, &PlotParams::default()).unwrap();
    assert_eq!(scene.trees.len(), 12);
    for (index, tree) in scene.trees.iter().enumerate() {
        let [x, y, z] = tree.base_m;
        assert_eq!(tree.id as usize, index + 1);
        assert!((scene.terrain.elevation_m(x, y) - z).abs() < 1e-6);
        assert!(scene.rect().contains(x, y));
        for other in &scene.trees[..index] {
            assert!(squared([x, y], [other.base_m[0], other.base_m[1]]).sqrt() > 2.5);
        }
        for station in &scene.stations {
            let [p, q, _] = station.position_m;
            assert!(squared([x, y], [p, q]).sqrt() >= CLEARANCE_M - 1e-9);
        }
    }
}

#[test]
fn labels_tell_what_points_lie_on() {
    let scene = plot(5, &small()).unwrap();
    let points = scene.scan();
    let distances = scene.wood_distances_m(&points);
    let mut off: Vec<f64> = (0..points.len())
        .filter(|&i| points.label[i] == Label::Wood && !points.mixed[i])
        .map(|i| distances[i])
        .collect();
    off.sort_unstable_by(f64::total_cmp);
    assert!(off[off.len() / 2] < 0.004 && off[off.len() * 9 / 10] < 0.01, "{}", off[off.len() / 2]);
    for i in (0..points.len()).filter(|&i| points.label[i] == Label::Ground && !points.mixed[i]) {
        let [x, y, z] = points.cloud.world(i);
        assert!((z - scene.terrain.elevation_m(x, y)).abs() < 0.06);
    }
    for label in [Label::Ground, Label::Wood, Label::Leaf, Label::Understorey] {
        assert!(points.label.iter().filter(|&&l| l == label).count() > 50, "{label:?}");
    }
    let of_tree = |i: usize| matches!(points.label[i], Label::Wood | Label::Leaf);
    assert!((0..points.len()).all(|i| of_tree(i) == (points.tree_id[i] > 0)));
    let stations: std::collections::BTreeSet<u16> =
        points.cloud.source_id.iter().copied().collect();
    assert_eq!(stations.into_iter().collect::<Vec<_>>(), [1, 2, 3]);
}

#[test]
fn thinning_keeps_one_point_of_every_cell() {
    let points = plot(5, &small()).unwrap().scan();
    let thin = points.thinned(0.1);
    let cell = |p: &LabelledPoints, i: usize| p.cloud.world(i).map(|v| (v / 0.1).floor() as i64);
    let cells = |p: &LabelledPoints| -> std::collections::BTreeSet<[i64; 3]> {
        (0..p.len()).map(|i| cell(p, i)).collect()
    };
    assert_eq!(cells(&points), cells(&thin));
    assert_eq!(cells(&thin).len(), thin.len());
    assert!(thin.len() < points.len());
}

#[test]
fn a_plot_too_small_for_its_trees_is_planted_densely() {
    let mut params = small();
    params.trees = vec![params.trees[1]; 30];
    params.edge_m = 6.0;
    params.positions = 1;
    assert_eq!(plot(1, &params).unwrap().trees.len(), 30);
    params.edge_m = 2.0;
    assert!(plot(1, &params).unwrap_err().to_string().contains("edge_m` is 2"));
}
