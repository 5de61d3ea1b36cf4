//! The stage `crown-fit` with every method, on crowns that are known and on some that are hopeless.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::*;
use timberline_artefact::stage::Campaign;
use timberline_artefact::{UnitId, read, read_header, tree_id};
use timberline_crowns::CrownFitParams;
use timberline_crowns::params::{BoundsRule, FitMethod, PriorRule, SolverChoice};
use timberline_crowns::stage::CrownFitStage;
use timberline_crowns::surface::{Paraboloid, Shape};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Point, PointCloud, TileGrid};

/// South-west corner of the tile in the world, m.
const CORNER: [f64; 2] = [499_968.0, 4_199_936.0];

/// A tree's points in the world, and how sure they are to be on its surface.
struct Given {
    points: Vec<[f64; 3]>,
    score: f32,
}

impl Given {
    fn apex(&self) -> [f64; 3] {
        *self.points.iter().max_by(|a, b| a[2].total_cmp(&b[2])).unwrap()
    }

    fn id(&self) -> u64 {
        let [x, y, _] = self.apex();
        tree_id(x, y)
    }
}

/// Points relative to a place in the tile, 120 m up.
fn given(at: [f64; 2], score: f32, points: impl IntoIterator<Item = [f64; 3]>) -> Given {
    let world = |p: [f64; 3]| {
        [CORNER[0] + at[0] + p[0], CORNER[1] + at[1] + p[1], 120.0 + p[2]].map(quantise)
    };
    Given { points: points.into_iter().map(world).collect(), score }
}

/// Positions every 0.12 m within 2.2 m.
fn disc() -> impl Iterator<Item = [f64; 2]> {
    (0..1600)
        .map(|i| [f64::from(i % 40) * 0.12 - 2.34, f64::from(i / 40) * 0.12 - 2.34])
        .filter(|[x, y]| x * x + y * y < 2.2 * 2.2)
}

/// The crown that is known: its larger semiaxis points 30 degrees to the left of east.
fn truth() -> Shape {
    let azimuth = std::f64::consts::FRAC_PI_6;
    Shape { centre: [0.25, -0.15], apex_z_m: 0.0, semiaxes_m: [1.6, 1.1], azimuth }
}

const WHERE: [f64; 2] = [10.0, 10.0];

/// The known crown with a bump on one side, which is its highest point.
fn whole() -> Given {
    let surface = Paraboloid::from_shape(&truth());
    let on_surface = |[x, y]: [f64; 2]| [x, y, surface.z(x, y)];
    let bump = [[0.55, 0.2, 0.3], [0.6, 0.25, 0.28], [0.5, 0.25, 0.26]];
    given(WHERE, 0.9, disc().map(on_surface).chain(bump))
}

fn plane() -> Given {
    given([20.0, 10.0], 0.9, disc().map(|[x, y]| [x, y, 0.7 * x]))
}

/// Trees about which no surface can say anything.
fn hopeless() -> Vec<Given> {
    let line = (0..30).map(|i| [0.1 * f64::from(i), 0.0, -0.1 * f64::from(i)]);
    vec![
        given([30.0, 10.0], 0.9, [[0.0; 3]]),
        given([40.0, 10.0], 0.9, line),
        given([50.0, 10.0], 0.1, disc().map(|[x, y]| [x, y, -x * x - y * y])),
        given([10.0, 30.0], 0.9, [[0.0; 3]; 3]),
    ]
}

/// Runs the stage over all trees of one tile: their rows and what it warned of.
fn run(params: &CrownFitParams) -> (Vec<Tree>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let grid = TileGrid::new(64, [0, 0]).unwrap();
    let campaign = Campaign { grid: Some(grid), ..Campaign::default() };
    let mut store = Alone::new(folder.path(), campaign);
    let trees: Vec<Given> = hopeless().into_iter().chain([whole(), plane()]).collect();
    let mut cloud = PointCloud::default();
    let echo = Point { return_number: 1, number_of_returns: 1, ..Point::default() };
    trees.iter().flat_map(|tree| &tree.points).for_each(|point| cloud.push_world(*point, &echo));
    let (tile, cloud, facts) = store.put_tiles(&cloud, grid).unwrap().remove(0);
    let owner = |at: [f64; 3]| trees.iter().find(|tree| tree.points.contains(&at)).unwrap();
    let world: Vec<[f64; 3]> = (0..cloud.len()).map(|index| cloud.world(index)).collect();
    let (tree_id, score) = world.iter().map(|at| (owner(*at).id(), owner(*at).score)).unzip();
    let height_m = world.iter().map(|at| (at[2] - 100.0) as f32).collect();
    let unit = UnitId::Tile(tile);
    store.put(unit.clone(), &Labels { tree_id, score }, facts.clone()).unwrap();
    store.put(unit.clone(), &Heights { height_m }, facts.clone()).unwrap();
    let detected = |model| Detection { model, score: 1.0, origin: Origin::Surface };
    let trees = models(&trees).into_iter().map(detected).collect();
    store.put(unit.clone(), &Detections { trees }, facts).unwrap();
    let path = store.run::<CrownFitStage>(unit, None, params).unwrap();
    let warnings = read_header(&path).unwrap().warnings;
    let warnings = warnings.into_iter().map(|w| format!("{}: {}", w.subject, w.message));
    (read::<Trees>(&path).unwrap().1.trees, warnings.collect())
}

/// A crown model for each tree, and one for a tree without any point.
fn models(trees: &[Given]) -> Vec<CrownModel> {
    let model = |id: u64, apex_m: [f64; 3]| CrownModel {
        id,
        apex_m,
        height_m: apex_m[2] - 100.0,
        radius_m: 2.2,
        parameters: [0.5, 0.1],
        ..CrownModel::default()
    };
    let mut models: Vec<CrownModel> =
        trees.iter().map(|tree| model(tree.id(), tree.apex())).collect();
    let bare = [CORNER[0] + 30.0, CORNER[1] + 30.0, 110.0];
    models.push(model(tree_id(bare[0], bare[1]), bare));
    models.sort_by_key(|model| model.id);
    models
}

fn row(rows: &[Tree], id: u64) -> &Tree {
    rows.iter().find(|row| row.id == id).unwrap()
}

/// The row of the known crown.
fn known(params: &CrownFitParams) -> Tree {
    row(&run(params).0, whole().id()).clone()
}

/// Distance of a row's position from the true centre, m.
fn error_m(tree: &Tree) -> f64 {
    let [x, y] = truth().centre;
    let off = [
        tree.position_m[0] - CORNER[0] - WHERE[0] - x,
        tree.position_m[1] - CORNER[1] - WHERE[1] - y,
    ];
    libm::hypot(off[0], off[1])
}

fn with(method: FitMethod, omega: f64) -> CrownFitParams {
    CrownFitParams { method, omega, ..CrownFitParams::default() }
}

const METHODS: [(FitMethod, f64, PositionMethod); 7] = [
    (FitMethod::L1, 0.0, PositionMethod::L1),
    (FitMethod::L1, 0.5, PositionMethod::L1),
    (FitMethod::L2, 0.0, PositionMethod::L2),
    (FitMethod::L2, 1.0, PositionMethod::L2),
    (FitMethod::HullCentroid, 0.0, PositionMethod::HullCentroid),
    (FitMethod::HighestPoint, 0.0, PositionMethod::HighestPoint),
    (FitMethod::StarSac, 0.0, PositionMethod::StarSac),
];

#[test]
fn every_method_makes_the_position_it_is_asked_for() {
    for (method, omega, expected) in METHODS {
        let tree = known(&with(method, omega));
        assert_eq!(tree.position_method, expected);
        let bump = error_m(&Tree { position_m: [tree.apex_m[0], tree.apex_m[1]], ..tree.clone() });
        let at_apex = [FitMethod::HighestPoint, FitMethod::StarSac].contains(&method);
        let near = if at_apex { error_m(&tree) == bump } else { error_m(&tree) < 0.7 * bump };
        assert!(near, "{method:?} {omega}: {} m, the bump at {bump} m", error_m(&tree));
        let has_surface = [FitMethod::L1, FitMethod::L2, FitMethod::StarSac].contains(&method);
        assert_eq!(tree.fit_residual_m.is_finite(), has_surface, "{method:?}");
        assert_eq!(tree.surface_apex_m.is_finite(), has_surface, "{method:?}");
        let certified = method == FitMethod::L1;
        assert_eq!(tree.fit_nodes > 0 && tree.fit_gap <= 1e-6, certified, "{method:?}");
        assert_eq!(tree.position_standard_error_m.is_finite(), certified, "{method:?}");
    }
}

#[test]
fn hopeless_trees_keep_their_highest_point_and_harm_no_other() {
    for (method, omega, _) in METHODS {
        let (rows, warnings) = run(&with(method, omega));
        assert_eq!(rows.len(), 7);
        for tree in hopeless() {
            let (row, apex) = (row(&rows, tree.id()), tree.apex());
            assert_eq!(row.position_m, [apex[0], apex[1]], "{method:?}");
            if [FitMethod::HighestPoint, FitMethod::StarSac].contains(&method) {
                continue;
            }
            assert_eq!(row.position_method, PositionMethod::HighestPoint, "{method:?}");
            assert!(TreeFlag::names(row.flags).contains("underdetermined"), "{method:?}: {row:?}");
            let told = warnings.iter().filter(|w| w.starts_with(&format!("tree {}:", tree.id())));
            assert_eq!(told.count(), 1, "{method:?}: {warnings:?}");
        }
    }
}

#[test]
fn two_axes_tell_the_shape_and_its_rotation() {
    for (method, omega) in [(FitMethod::L1, 0.6), (FitMethod::L1, 1.0), (FitMethod::L2, 1.0)] {
        let tree = known(&with(method, omega));
        let [larger, smaller] = tree.semi_axes_m;
        assert!((larger - 1.6).abs() < 0.2 && (smaller - 1.1).abs() < 0.2, "{larger} {smaller}");
        assert!((tree.rotation_deg - 60.0).abs() < 8.0, "{} degrees", tree.rotation_deg);
        assert!((tree.surface_apex_m - 120.0).abs() < 0.4, "{} m", tree.surface_apex_m);
        assert!(
            (tree.fit_objective_m / f64::from(tree.fit_cells) - tree.fit_residual_m).abs() < 1e-12
        );
    }
    let round = known(&with(FitMethod::L1, 0.0));
    assert!(round.rotation_deg.is_nan() && round.semi_axes_m[0] == round.semi_axes_m[1]);
}

#[test]
fn a_small_omega_is_told_to_bind() {
    let tree = known(&with(FitMethod::L1, 0.1));
    assert!(TreeFlag::names(tree.flags).contains("imbalance-active"), "{tree:?}");
}

#[test]
fn the_prior_holds_the_position_in_its_box() {
    let box_of =
        |half: f64| CrownFitParams { prior_half_width_m: half, ..CrownFitParams::default() };
    let fixed = known(&box_of(0.0));
    assert_eq!(fixed.position_m, [fixed.apex_m[0], fixed.apex_m[1]]);
    assert_eq!(fixed.position_extent_m, 0.0);
    let narrow = known(&box_of(0.1));
    assert!(TreeFlag::names(narrow.flags).contains("prior-active"));
    let free = CrownFitParams { prior: PriorRule::None, ..CrownFitParams::default() };
    let free = known(&free);
    assert!(error_m(&free) < error_m(&narrow) && error_m(&narrow) < error_m(&fixed));
    assert!(free.fit_objective_m <= narrow.fit_objective_m);
    assert!(narrow.fit_objective_m <= fixed.fit_objective_m);
}

#[test]
fn a_plane_reaches_the_bounds() {
    for bounds in [BoundsRule::Exact, BoundsRule::Paper] {
        let params = CrownFitParams { bounds, omega: 0.2, ..CrownFitParams::default() };
        let (rows, _) = run(&params);
        let flags = TreeFlag::names(row(&rows, plane().id()).flags);
        assert!(flags.contains("shape-bound-active"), "{bounds:?}: {flags}");
    }
}

#[test]
fn both_solvers_agree() {
    for omega in [0.0, 0.4] {
        let of = |solver| known(&CrownFitParams { solver, ..with(FitMethod::L1, omega) });
        let (own, reference) = (of(SolverChoice::Dedicated), of(SolverChoice::Clarabel));
        let off = (own.fit_objective_m - reference.fit_objective_m).abs();
        assert!(off < 1e-6 * reference.fit_objective_m, "omega {omega}: {off} m");
    }
}

#[test]
fn uncertainty_is_told_unless_it_is_not_wanted() {
    let told = known(&CrownFitParams::default());
    for metres in [told.position_extent_m, told.position_standard_error_m] {
        assert!(metres > 0.0 && metres < 0.5, "{metres} m");
    }
    let quiet = known(&CrownFitParams { uncertainty: false, ..CrownFitParams::default() });
    assert!(quiet.position_extent_m.is_nan() && quiet.position_standard_error_m.is_nan());
    assert_eq!(quiet.position_m, told.position_m);
}
