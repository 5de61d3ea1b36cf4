use super::super::cylinder::TrueCylinder;
use super::super::tree_model::VolumeClass;
use super::super::vector::{dot, length, sub};
use super::*;
use proptest::prelude::*;

fn any_tree() -> impl Strategy<Value = (TreeSpecies, TreeSize, u64)> {
    let species = prop::sample::select(TreeSpecies::ALL.to_vec());
    (species, 0.08f64..0.5, 0f64..12., any::<bool>(), any::<u64>()).prop_map(
        |(species, dbh, lean, fork, seed)| {
            let mut size = TreeSize::of_dbh(species, dbh).leaning(lean, 130.0).leafless();
            if fork {
                size = size.forked_at(2.5);
            }
            (species, size, seed)
        },
    )
}

/// Distance of a position from the axis of a piece, and the radius there.
fn from_axis(piece: &TrueCylinder, at: Vec3) -> (f64, f64) {
    let way = sub(piece.end_m, piece.start_m);
    let share = (dot(sub(at, piece.start_m), way) / dot(way, way)).clamp(0.0, 1.0);
    let radius = piece.start_radius_m + share * (piece.end_radius_m - piece.start_radius_m);
    (length(sub(at, along(piece.start_m, way, share))), radius)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn every_piece_starts_on_its_parent_and_is_not_thicker((species, size, seed) in any_tree()) {
        let tree = grow(species, &size, seed).unwrap();
        for (index, piece) in tree.cylinders.iter().enumerate() {
            prop_assert_eq!(piece.id as usize, index);
            prop_assert!(piece.end_radius_m <= piece.start_radius_m && piece.end_radius_m > 0.0);
            prop_assert!(piece.length_m() > 1e-4);
            let Some(parent) = piece.parent else {
                prop_assert_eq!(index, 0);
                continue;
            };
            prop_assert!((parent as usize) < index);
            let below = &tree.cylinders[parent as usize];
            prop_assert!(piece.start_radius_m <= below.start_radius_m + 1e-12);
            if below.branch == piece.branch {
                prop_assert_eq!(piece.start_m, below.end_m);
                prop_assert_eq!(piece.order, below.order);
            } else {
                let (distance, radius) = from_axis(below, piece.start_m);
                prop_assert!(distance <= radius + 1e-9, "{} {}", distance, radius);
                prop_assert_eq!(piece.order, below.order + 1);
            }
        }
    }

    #[test]
    fn sizes_are_those_asked_for((species, size, seed) in any_tree()) {
        let tree = grow(species, &size, seed).unwrap();
        prop_assert!((tree.dbh_m() - size.dbh_m).abs() < 1e-9);
        let length: f64 = tree.stem().map(TrueCylinder::length_m).sum();
        prop_assert!((length - size.height_m).abs() < 1e-6);
        let upright = libm::cos(size.lean_deg.to_radians());
        let height = tree.height_m() / size.height_m;
        prop_assert!(height < 1.02 && height > upright - 0.02, "{}", height);
        prop_assert!(tree.crown_base_height_m < size.height_m);
        let diameter = tree.crown_diameter_m() / (2.0 * size.crown_radius_m);
        prop_assert!((0.5..1.6).contains(&diameter), "{:?} {}", species, diameter);
    }

    #[test]
    fn volumes_and_branches_add_up((species, size, seed) in any_tree()) {
        let tree = grow(species, &size, seed).unwrap();
        use VolumeClass::{Stem, ThickBranches, ThinBranches};
        let classes = [Stem, ThickBranches, ThinBranches].map(|class| tree.volume_m3(class));
        let all: f64 = tree.cylinders.iter().map(TrueCylinder::volume_m3).sum();
        prop_assert!((classes.iter().sum::<f64>() - all).abs() < 1e-9);
        prop_assert!(classes[0] > classes[1] && classes[0] > classes[2]);
        let counts = tree.branches_by_order();
        let last = tree.cylinders.iter().map(|piece| piece.branch).max().unwrap();
        prop_assert_eq!(counts.iter().sum::<u32>(), last + 1);
        // A second leader adds an order.
        prop_assert!(counts[0] == 1 && counts.len() <= usize::from(species.habit().orders) + 2);
    }
}

/// Without leaves wood is all that there is: what leaves the stem is about what it loses.
#[test]
fn cross_sections_are_kept() {
    for species in TreeSpecies::ALL {
        let tree = grow(species, &TreeSize::of_dbh(species, 0.3).leafless(), 5).unwrap();
        let low = tree.crown_base_height_m;
        let (_, diameter) = tree.stem_at(low).unwrap();
        let leave = |piece: &&TrueCylinder| {
            let on_stem = piece.parent.is_some_and(|p| tree.cylinders[p as usize].order == 0);
            on_stem && piece.order == 1 && piece.start_m[2] >= low
        };
        let radii = tree.cylinders.iter().filter(leave).map(|piece| piece.start_radius_m);
        let share = radii.map(|r| r * r).sum::<f64>() / (0.25 * diameter * diameter);
        assert!((0.7..1.05).contains(&share), "{species:?} {share}");
    }
}

#[test]
fn a_seed_gives_one_tree_and_another_another() {
    let size = TreeSize::of_dbh(TreeSpecies::EuropeanBeech, 0.2);
    let tree = |seed| grow(TreeSpecies::EuropeanBeech, &size, seed).unwrap();
    assert_eq!(tree(3), tree(3));
    assert_ne!(tree(3).cylinders, tree(4).cylinders);
}

#[test]
fn particulars_show() {
    let usual = TreeSize::of_dbh(TreeSpecies::PedunculateOak, 0.3);
    let oak = |size: TreeSize| grow(TreeSpecies::PedunculateOak, &size, 9).unwrap();
    assert!(!oak(usual).leaves.is_empty() && oak(usual.leafless()).leaves.is_empty());
    let [x, y, z] = oak(usual.leaning(8.0, 90.0)).top_m();
    assert!(y / z > 0.08 && y / z < 0.14 && x.abs() < 1.0, "{x} {y} {z}");
    assert!(oak(usual.suppressed()).height_m() < 0.85 * oak(usual).height_m());
    let forked = oak(usual.leafless().forked_at(1.8));
    let leader = forked.cylinders.iter().find(|piece| piece.order == 1).unwrap();
    assert!((leader.start_m[2] - 1.8).abs() < 0.2 && leader.start_radius_m > 0.08);
    let length: f64 = forked
        .cylinders
        .iter()
        .filter(|p| p.branch == leader.branch)
        .map(TrueCylinder::length_m)
        .sum();
    assert!(length > 0.8 * (forked.height_m() - 1.8));
}

#[test]
fn sizes_out_of_range_are_refused() {
    let size = TreeSize::of_dbh(TreeSpecies::ScotsPine, 0.3);
    let told = |size: TreeSize| grow(TreeSpecies::ScotsPine, &size, 1).unwrap_err().to_string();
    assert!(told(TreeSize { dbh_m: f64::NAN, ..size }).contains("dbh_m` is NaN"));
    assert!(told(TreeSize { fork_m: Some(99.0), ..size }).contains("fork_m` is 99"));
    assert!(told(TreeSize { crown_base_m: 30.0, ..size }).contains("crown_base_m"));
}
