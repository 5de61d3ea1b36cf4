//! Models against truth, by hand.

use super::*;

const TRUE_M: f64 = 0.15;

fn piece(start_m: [f64; 3], end_m: [f64; 3], radius_m: f64, branch: u32) -> Piece {
    let cylinder = Cylinder { start_m, end_m, radius_m };
    let parent = (branch > 0).then_some(0);
    Piece { cylinder, parent, branch, order: u16::from(branch > 0) }
}

/// A stem of 10 m at `x`, and a branch of 2 m eastwards or westwards at a height of 5 m.
fn tree(id: u64, x: f64, radius_m: f64, branch_m: f64, east: f64) -> TreeModel {
    let away = [x + 2.0 * east, 0.0, 5.0];
    let pieces = vec![
        piece([x, 0.0, 0.0], [x, 0.0, 10.0], radius_m, 0),
        piece([x, 0.0, 5.0], away, branch_m, 1),
    ];
    let stem = Stem { id, at_m: [x, 0.0], dbh_m: 2.0 * radius_m, height_m: 10.0 };
    let mut tree = TreeModel { stem, pieces, volumes: Volumes::default() };
    tree.volumes = Volumes::of(&branches(&tree));
    tree
}

#[test]
fn found_missed_and_false_trees() {
    let truth = [tree(1, 0.0, TRUE_M, 0.03, 1.0), tree(2, 20.0, TRUE_M, 0.03, 1.0)];
    let models = [tree(7, 50.0, 0.1, 0.03, 1.0), tree(8, 0.2, TRUE_M + 0.01, 0.02, -1.0)];
    let plot = assess_models(&truth, &models, &ModelParams::default()).unwrap();
    assert_eq!((plot.stems.reference, plot.stems.matched), (2, 1));
    assert_eq!(plot.missed.iter().map(|tree| tree.id).collect::<Vec<_>>(), [2]);
    assert_eq!(plot.false_trees.iter().map(|tree| tree.id).collect::<Vec<_>>(), [7]);
    let [found] = &plot.trees[..] else { panic!("{:?}", plot.trees) };
    assert_eq!((found.truth.id, found.model.id), (1, 8));
    assert!((found.position_m - 0.2).abs() < 1e-12);
    // The branch on the wrong side is missing and false; the stem is real.
    let counts = found.branches.all;
    assert_eq!((counts.reference, counts.missing(), counts.false_branches), (2, 1, 1));
    let errors = found.volumes.relative_errors();
    assert!((errors[0] - ((0.16f64 / 0.15) * (0.16 / 0.15) - 1.0)).abs() < 1e-9, "{errors:?}");
    // 6 cm is thick, 4 cm is thin.
    assert_eq!(errors[1], -1.0);
    assert!(errors[2].is_nan() && found.volumes.model.thin_m3 > 0.0);
    // The plot counts what was missed and what is false, too.
    assert!(
        (plot.plot_volumes.truth.stem_m3 - 2.0 * plot.found_volumes.truth.stem_m3).abs() < 1e-9
    );
    assert!(plot.plot_volumes.model.stem_m3 > plot.found_volumes.model.stem_m3);
    let errors = plot.errors();
    let dbh = errors.iter().find(|row| row.name == "DBH").unwrap();
    assert!((dbh.errors.bias - 2.0).abs() < 1e-9 && (dbh.errors.rmse - 2.0).abs() < 1e-9);
}

#[test]
fn surfaces_of_a_thicker_tree_are_as_far_as_it_is_thicker() {
    let truth = [tree(1, 0.0, TRUE_M, 0.03, 1.0)];
    let thicker = [tree(9, 0.0, TRUE_M + 0.01, 0.04, 1.0)];
    let plot = assess_models(&truth, &thicker, &ModelParams::default()).unwrap();
    for way in [plot.surfaces.forth, plot.surfaces.back, plot.thick_surfaces.forth] {
        assert!((way.mean_m - 0.01).abs() < 5e-4 && way.max_m < 0.03, "{way:?}");
    }
    assert_eq!(plot.trees[0].surfaces, plot.surfaces);
    assert_eq!((plot.branches.all.missing(), plot.branches.all.false_branches), (0, 0));
    // A thin twig counts among all surfaces only.
    let lost = [tree(9, 0.0, TRUE_M, 0.02, -1.0)];
    let plot = assess_models(&truth, &lost, &ModelParams::default()).unwrap();
    assert!(plot.surfaces.forth.max_m > 1.5 && plot.thick_surfaces.forth.max_m < 1e-9);
    assert!(plot.thick_surfaces.back.max_m > 1.5, "the true branch is thick");
}

#[test]
fn truth_against_itself_has_no_error() {
    let trees = [tree(1, 0.0, TRUE_M, 0.03, 1.0), tree(2, 5.0, 0.1, 0.01, -1.0)];
    let plot = assess_models(&trees, &trees, &ModelParams::default()).unwrap();
    assert_eq!((plot.trees.len(), plot.missed.len(), plot.false_trees.len()), (2, 0, 0));
    assert!(plot.surfaces.forth.max_m < 1e-9 && plot.surfaces.back.max_m < 1e-9);
    assert_eq!((plot.branches.all.found, plot.branches.all.false_branches), (4, 0));
    assert!(plot.errors().iter().all(|row| row.errors.max_abs < 1e-9));
}

#[test]
fn branches_thinner_than_the_truth_lists_have_a_class_of_their_own() {
    let truth = [tree(1, 0.0, TRUE_M, 0.004, 1.0)];
    let models = [tree(2, 0.0, TRUE_M, 0.003, -1.0)];
    let params = ModelParams::default().with_class_below_truth(&truth);
    assert_eq!(params.branches.classes_m, [0.008, 0.02, 0.05, 0.10]);
    let plot = assess_models(&truth, &models, &params).unwrap();
    assert_eq!(plot.branches.by_class[0].false_branches, 1);
    assert_eq!((plot.branches.by_class[1].reference, plot.branches.by_class[1].model), (1, 0));
    assert!(plot.to_string().contains("\nbelow 0.8 cm "), "{plot}");
    let thick = [tree(1, 0.0, TRUE_M, 0.03, 1.0)];
    assert_eq!(ModelParams::default().with_class_below_truth(&thick), ModelParams::default());
}

#[test]
fn nothing_at_all() {
    let plot = assess_models(&[], &[], &ModelParams::default()).unwrap();
    assert_eq!(plot.stems.recall(), None);
    assert!(plot.to_string().contains("0 true, 0 found"));
    let json = serde_json::to_string(&plot).unwrap();
    assert_eq!(serde_json::from_str::<PlotAccuracy>(&json).unwrap(), plot);
}

#[test]
fn prints_trees_volumes_branches_and_distances() {
    let truth = [tree(1, 0.0, TRUE_M, 0.03, 1.0), tree(2, 20.0, TRUE_M, 0.03, 1.0)];
    let models = [tree(8, 0.2, TRUE_M + 0.01, 0.02, -1.0)];
    let text = assess_models(&truth, &models, &ModelParams::default()).unwrap().to_string();
    for part in [
        "stems: 2 true, 1 found, 1 missed, 0 false; recall 0.500, precision 1.000",
        "missed: tree 2 at 20.00 0.00, DBH 30.0 cm, height 10.00 m",
        "30.0/32.0",
        "+13.8",
        "volume of the plot",
        "from 10 cm",
        "truth to model",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}
