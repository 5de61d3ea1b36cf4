//! Virtual trees with exact truth, scanned by a virtual terrestrial scanner: diameters, volumes and the
//! honesty of standard errors, given the true axes without small twigs, shaken, with wrong radii.
//!
//! `cargo test -p timberline-qsm --test synthetic -- --nocapture` prints the table.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]
#![allow(clippy::print_stdout, reason = "the table is what the test is for")]

use timberline_qsm::{ModelledTree, Params, RadiusSource, SkeletonNode, TreePoints, model_tree};
use timberline_synth::terrestrial::{
    LabelledPoints, ScanParams, TreeModel, TreeSize, TreeSpecies, VolumeClass, grow, scan_tree,
};

/// Thinnest pieces of wood that the skeleton knows, radius, m.
const LEAST_RADIUS_M: f64 = 0.005;

/// The true axes, of which every third position is kept, off by up to 1 cm, with radii that are wrong
/// by half.
fn skeleton(tree: &TreeModel, base_m: [f64; 3]) -> Vec<SkeletonNode> {
    let local = |world: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| world[k] - base_m[k]) };
    // Van der Corput's sequence: between 0 and 1, the same every time.
    let shake = |place: usize, axis: usize| {
        let turn = (place as f64 + 0.5) * [0.819_172_5, 0.671_043_6, 0.549_700_5][axis];
        0.02 * (turn - turn.floor() - 0.5)
    };
    let mut nodes = vec![SkeletonNode {
        position_m: local(tree.cylinders[0].start_m),
        parent: None,
        radius_m: 1.5 * tree.cylinders[0].start_radius_m,
    }];
    let mut node_at_end: Vec<Option<u32>> = vec![None; tree.cylinders.len()];
    let mut since = 0;
    for (place, piece) in tree.cylinders.iter().enumerate() {
        let before = match piece.parent {
            None => Some(0),
            Some(parent) => node_at_end[parent as usize],
        };
        let Some(before) = before.filter(|_| piece.start_radius_m >= LEAST_RADIUS_M) else {
            continue;
        };
        let next = tree.cylinders.get(place + 1);
        let goes_on =
            next.is_some_and(|next| next.parent == Some(piece.id) && next.branch == piece.branch);
        let bears = tree.cylinders.iter().any(|other| {
            other.parent == Some(piece.id)
                && other.branch != piece.branch
                && other.start_radius_m >= LEAST_RADIUS_M
        });
        since += 1;
        if goes_on && !bears && since % 3 != 0 {
            node_at_end[place] = Some(before);
            continue;
        }
        let end = local(piece.end_m);
        nodes.push(SkeletonNode {
            position_m: std::array::from_fn(|k| end[k] + shake(place, k)),
            parent: Some(before),
            radius_m: 1.5 * piece.end_radius_m,
        });
        node_at_end[place] = Some(nodes.len() as u32 - 1);
    }
    nodes
}

/// A tree, its points, and what was made of them.
struct Case {
    name: String,
    tree: TreeModel,
    found: ModelledTree,
}

fn case(species: TreeSpecies, dbh_m: f64, leaves: bool, scan: &ScanParams, seed: u64) -> Case {
    let size = TreeSize::of_dbh(species, dbh_m);
    let size = if leaves { size } else { size.leafless() };
    let tree = grow(species, &size, seed).unwrap().at([500_000.0, 5_000_000.0, 812.0]);
    let LabelledPoints { cloud, .. } = scan_tree(&tree, scan, seed).unwrap();
    let origin = tree.base_m;
    let points: Vec<[f64; 3]> = (0..cloud.len())
        .map(|index| {
            let world = cloud.world(index);
            std::array::from_fn(|k| world[k] - origin[k])
        })
        .collect();
    let given = TreePoints { points_m: &points, wood: None, base_m: [0.0; 3], dbh_m: None };
    let found = model_tree(&given, &skeleton(&tree, origin), &Params::default()).unwrap();
    let leafy = if leaves { "leaves" } else { "bare" };
    let name = format!("{} {dbh_m} {leafy}, {} points", species.code(), points.len());
    Case { name, tree, found }
}

impl Case {
    fn dbh_error_m(&self) -> f64 {
        self.found.metrics.dbh.unwrap().diameter_m - self.tree.dbh_m()
    }

    /// Volume over truth of stem, thick and thin branches.
    fn volumes(&self) -> [f64; 3] {
        let metrics = &self.found.metrics;
        let pairs = [
            (metrics.stem_volume_m3, VolumeClass::Stem),
            (metrics.thick_volume_m3, VolumeClass::ThickBranches),
            (metrics.thin_volume_m3, VolumeClass::ThinBranches),
        ];
        pairs.map(|(volume, class)| volume / self.tree.volume_m3(class))
    }

    fn print(&self) {
        let [stem, thick, thin] = self.volumes();
        let dbh = self.found.metrics.dbh.unwrap();
        let model = &self.found.model;
        let from = |source| model.cylinders.iter().filter(|c| c.source == source).count();
        println!(
            "{}: DBH {:+.1} mm (sd {:.1}, arc {:.2}, {:?}), volume stem {stem:.3} thick {thick:.2} thin {thin:.2}, \
             thick of all {:.2}, mean {:.1} mm, measured {} of {}, pipe {:?}",
            self.name,
            self.dbh_error_m() * 1e3,
            dbh.sd_m * 1e3,
            dbh.arc_coverage,
            dbh.source,
            self.tree.volume_m3(VolumeClass::ThickBranches)
                / self.tree.volume_m3(VolumeClass::Stem),
            self.found.cloud_to_model.mean_m * 1e3,
            from(RadiusSource::Measured),
            model.cylinders.len(),
            self.found.pipe.map(|p| (p.factor, p.exponent, p.log_scatter)),
        );
    }
}

fn cases(leaves: bool, scan: &ScanParams) -> Vec<Case> {
    let mut cases = Vec::new();
    for species in TreeSpecies::ALL {
        for (dbh_m, seed) in [(0.18, 1), (0.35, 2)] {
            cases.push(case(species, dbh_m, leaves, scan, seed));
        }
    }
    cases.iter().for_each(Case::print);
    cases
}

fn rmse(errors: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = errors.clone().count() as f64;
    (errors.map(|error| error * error).sum::<f64>() / count).sqrt()
}

/// Sums over all trees: volume over truth.
fn total(cases: &[Case], class: VolumeClass) -> f64 {
    let truth: f64 = cases.iter().map(|case| case.tree.volume_m3(class)).sum();
    let found = |case: &Case| match class {
        VolumeClass::Stem => case.found.metrics.stem_volume_m3,
        VolumeClass::ThickBranches => case.found.metrics.thick_volume_m3,
        VolumeClass::ThinBranches => case.found.metrics.thin_volume_m3,
    };
    cases.iter().map(found).sum::<f64>() / truth
}

/// DBH within a limit of RMSE and three standard errors, the stem within 5 %, thick branches within a
/// limit over all trees.
fn hold(cases: &[Case], dbh_m: f64, thick: f64) {
    let dbh = rmse(cases.iter().map(Case::dbh_error_m));
    let stem = rmse(cases.iter().map(|case| case.volumes()[0] - 1.0));
    let thick_total = total(cases, VolumeClass::ThickBranches);
    println!(
        "DBH RMSE {:.1} mm, stem volume RMSE {:.1} %, of all trees: stem {:.3}, thick branches {thick_total:.2}",
        dbh * 1e3,
        stem * 100.0,
        total(cases, VolumeClass::Stem),
    );
    assert!(dbh <= dbh_m, "DBH RMSE {dbh}");
    assert!((thick_total - 1.0).abs() <= thick, "thick branches {thick_total}");
    for case in cases {
        let sd = case.found.metrics.dbh.unwrap().sd_m;
        assert!(case.dbh_error_m().abs() <= 3.0 * sd, "{}: {}", case.name, case.dbh_error_m());
        assert!((case.volumes()[0] - 1.0).abs() <= 0.05, "{}: {:?}", case.name, case.volumes());
    }
}

#[test]
fn bare_trees_scanned_from_all_around() {
    hold(&cases(false, &ScanParams::tls().with_step(0.12)), 0.003, 0.15);
}

#[test]
fn trees_in_leaf_scanned_from_one_side() {
    hold(&cases(true, &ScanParams::one_sided().with_step(0.12)), 0.005, 0.25);
}
