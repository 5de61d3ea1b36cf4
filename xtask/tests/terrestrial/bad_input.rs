//! What becomes of scans that hold no tree, a broken one, or several.

use crate::scenes::{BASES_M, TREE, beech, positions, scanned, two_trees, xyz};
use crate::support::{Campaign, Ran, number};
use timberline_artefact::kinds::Stems;

/// Runs a cloud of text through the chain.
fn ran(text: &str) -> (Campaign, Ran) {
    let campaign = Campaign::of_bytes("cloud.xyz", text);
    let ran = campaign.try_run(&["--jobs", "2"]);
    assert!(!ran.said.contains("internal error") && !ran.said.contains("panicked"), "{}", ran.said);
    (campaign, ran)
}

/// Whether a cloud ends the command with a reason, and which.
fn is_refused(what: &str, text: &str, reason: &str) {
    let (campaign, ran) = ran(text);
    assert!(ran.code == 1 && ran.said.contains(reason), "{what}: {}\n{}", ran.code, ran.said);
    assert!(campaign.files(&["outputs"]).is_empty(), "{what}: {}", ran.said);
}

/// A regular grid of points in a plane through three corners, with some roughness across it.
fn plane(count: [u32; 2], step_m: f64, rough_m: f64) -> Vec<[f64; 3]> {
    let rough = |i: u32, j: u32| {
        let mixed = (i.wrapping_mul(7919) ^ j.wrapping_mul(104_729)).wrapping_mul(2_654_435_761);
        rough_m * (f64::from(mixed >> 8) / f64::from(1 << 24) - 0.5)
    };
    let at =
        |i, j| [100.0 + step_m * f64::from(i), 50.0 + rough(i, j), 7.0 + step_m * f64::from(j)];
    (0..count[0]).flat_map(|i| (0..count[1]).map(move |j| at(i, j))).collect()
}

#[test]
fn clouds_that_are_no_tree_are_refused_with_the_reason() {
    const FEW: &str = "with points: a tree takes at least 20";
    let ten: Vec<[f64; 3]> =
        positions(&TREE).into_iter().step_by(TREE.len() / 9).take(10).collect();
    is_refused("ten points", &xyz(&ten), &format!("10 voxels {FEW}"));
    is_refused("one point", &"3 4 5\n".repeat(5000), &format!("1 voxels {FEW}"));

    const FLAT: &str = "m of a plane: this is no tree (a wall, a single slice?)";
    let line = |along: [f64; 3]| -> Vec<[f64; 3]> {
        (0..3000).map(|i| along.map(|by| 7.0 + by * f64::from(i))).collect()
    };
    is_refused("a line", &xyz(&line([0.002, 0.004, 0.006])), FLAT);
    is_refused("an upright line", &xyz(&line([0.0, 0.0, 0.004])), FLAT);
    is_refused("a wall", &xyz(&plane([250, 200], 0.02, 0.01)), FLAT);

    is_refused("no byte", "", "cloud.xyz: this is an empty file, not a point cloud");
    is_refused("a heading", "x y z\n", "cloud.xyz: this is a text file without rows of numbers");
    let nan = "none of 100 points has coordinates that can be used (line 1: x is NaN";
    is_refused("NaN", &"nan nan nan\n".repeat(100), nan);
}

/// An empty E57 file ended the command without a word, where only warnings are shown.
#[test]
fn a_scan_without_points_says_so() {
    let ply = "ply\nformat ascii 1.0\nelement vertex 0\nproperty double x\nproperty double y\n\
               property double z\nend_header\n";
    let ran = Campaign::of_bytes("cloud.ply", ply).try_run(&["--quiet"]);
    let reason = "nothing to do in `tiles`: the scans hold no point that can be used";
    assert!(ran.code == 1 && ran.said.contains(reason), "{}: {}", ran.code, ran.said);
}

#[test]
fn points_without_a_position_are_left_out_and_said() {
    let whole = ran(&xyz(&positions(&TREE))).0;
    let expected = whole.files(&["outputs"]);
    let mut text = xyz(&positions(&TREE));
    text.push_str(&"nan nan nan\n10.1 NaN 6.0\n10.2 20.1 inf\n".repeat(5));
    let (campaign, ran) = ran(&text);
    assert_eq!(ran.code, 0, "{}", ran.said);
    let said = "15 points lie outside of what coordinates can be and are left out";
    assert!(ran.said.contains(said) && ran.said.contains("x is NaN"), "{}", ran.said);
    assert!(campaign.files(&["outputs"]) == expected, "other outputs than without them");
}

#[test]
fn a_ply_with_nan_has_the_stem_of_one_without() {
    let positions = positions(&TREE);
    let nowhere = [[f64::NAN, 0.0, f64::NAN], [10.0, f64::NAN, 7.0]];
    let stems = |nowhere: &[[f64; 3]]| {
        let count = positions.len() + nowhere.len();
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty double x\n\
             property double y\nproperty double z\nend_header\n",
        )
        .into_bytes();
        for value in nowhere.iter().chain(&positions).flatten() {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
        let campaign = Campaign::of_bytes("cloud.ply", bytes);
        let ran = campaign.run(&["--until", "stems"]);
        assert_eq!(ran.said.contains("2 points lie outside"), !nowhere.is_empty(), "{}", ran.said);
        let files = campaign.files(&["store/stems"]);
        let folder = campaign.path(".timberline");
        let stems: Vec<_> = files.keys().map(|path| folder.join(path)).collect();
        assert_eq!(stems.len(), 1, "{stems:?}");
        timberline_artefact::read::<Stems>(&stems[0]).unwrap().1
    };
    assert_eq!(stems(&nowhere), stems(&[]));
}

#[test]
fn duplicated_points_give_the_tree_that_single_ones_give() {
    let once = positions(&TREE);
    let (single, _) = ran(&xyz(&once));
    let (twice, ran) = ran(&xyz(&[&once[..], &once, &once].concat()));
    assert_eq!(ran.code, 0, "{}", ran.said);
    let dbh = |campaign: &Campaign| number(&campaign.table("trees.csv")[0], "dbh_cm");
    assert!((dbh(&single) - dbh(&twice)).abs() < 0.1, "{} {}", dbh(&single), dbh(&twice));
}

/// Two trees whose crowns touch, without and with ground.
#[test]
fn two_trees_in_one_cloud_have_two_models() {
    for ground in [false, true] {
        let (campaign, ran) = ran(&xyz(&two_trees(ground)));
        assert_eq!(ran.code, 0, "{}", ran.said);
        let mut trees = campaign.table("trees.csv");
        trees.sort_by(|a, b| number(a, "x").total_cmp(&number(b, "x")));
        assert_eq!(trees.len(), 2, "{trees:?}");
        for (tree, [x, y, z]) in trees.iter().zip(BASES_M) {
            let off = [("x", x), ("y", y), ("z", z)].map(|(axis, at)| number(tree, axis) - at);
            assert!(off.iter().all(|off| off.abs() < 0.12), "{off:?}");
            assert!((number(tree, "dbh_cm") - 12.0).abs() < 1.0, "{tree:?}");
            assert_eq!(tree["base_source"], if ground { "ground" } else { "lowest-points" });
        }
    }
}

/// The lower side of the crown is not taken for ground, and no diameter is invented.
#[test]
fn a_tree_without_its_lower_stem_says_what_it_counts_from() {
    let [_, _, base] = BASES_M[0];
    let seen = |ground: bool| {
        let mut points = positions(&scanned(&beech(BASES_M[0], 3), ground));
        points.retain(|[_, _, z]| *z > base + 4.0 || (ground && *z < base + 0.1));
        let (campaign, ran) = ran(&xyz(&points));
        assert_eq!(ran.code, 0, "{}", ran.said);
        let trees = campaign.table("trees.csv");
        assert_eq!(trees.len(), 1, "{trees:?}");
        trees[0].clone()
    };
    let (on_ground, high) = (seen(true), seen(false));
    assert_eq!([&on_ground["base_source"], &high["base_source"]], ["ground", "lowest-points"]);
    assert!((number(&on_ground, "z") - base).abs() < 0.1, "{on_ground:?}");
    assert!((number(&high, "z") - base - 4.0).abs() < 0.1, "{high:?}");
    let higher_m = number(&on_ground, "height_m") - number(&high, "height_m");
    assert!((higher_m - 4.0).abs() < 0.1, "{higher_m}");
    assert_eq!(on_ground["dbh_cm"], "", "nothing was seen near breast height");
}
