//! The terrestrial chain with a program in place of the built-in `tree-labels`.

#![cfg(unix)]

use crate::scenes::{BASES_M, two_trees, xyz};
use crate::support::{Campaign, number};

/// A program of shell: the points of a tile to the two trees that it is told of, as `share` says.
fn program(share: &str) -> String {
    format!(
        r#"
        points=$(od -An -tu8 -j247 -N8 "$2")
        echo "$(head -1 "$4"), $TIMBERLINE_UNIT" >&2
        one=$(sed -n 2p "$4" | cut -d, -f1)
        two=$(sed -n 3p "$4" | cut -d, -f1)
        awk -v n="$points" -v one="$one" -v two="$two" 'BEGIN {{
            print "point,tree_id"
            for (i = 0; i < n; i++) print i "," ({share} ? one : two)
        }}' > "$6.csv"
        "#
    )
}

/// Two trees whose points a program gives to them; the steps of the chain up to tables.
fn campaign(share: &str) -> Campaign {
    let campaign = Campaign::of_bytes("cloud.xyz", xyz(&two_trees(false)))
        .with("tree-labels", "command = [\"/bin/sh\", \"program.sh\"]")
        .with("consolidation", "method = \"none\"");
    campaign.write("program.sh", program(share));
    campaign
}

#[test]
fn a_program_says_which_tree_every_point_is_of() {
    let built_in = Campaign::of_bytes("cloud.xyz", xyz(&two_trees(false)))
        .with("consolidation", "method = \"none\"");
    built_in.run(&[]);
    let points = |campaign: &Campaign| {
        let trees = campaign.table("trees.csv");
        trees.iter().map(|tree| number(tree, "cloud_points")).collect::<Vec<_>>()
    };
    assert_eq!(points(&built_in).len(), BASES_M.len());

    let campaign = campaign("1");
    campaign.run(&[]);
    let trees = campaign.table("trees.csv");
    assert_eq!(trees.len(), 1, "the tree that was given nothing has no model: {trees:?}");
    assert!(points(&campaign)[0] > points(&built_in).iter().sum::<f64>() * 0.99, "{trees:?}");

    // The other script is another answer: labels and what follows them are made again.
    campaign.write("program.sh", program("i % 2 == 0"));
    campaign.run(&[]);
    let halves = points(&campaign);
    assert!(halves.len() == 2 && (halves[0] - halves[1]).abs() <= 2.0, "{halves:?}");
}

#[test]
fn a_tree_that_fails_costs_no_other() {
    let campaign = campaign("i >= 10");
    let ran = campaign.try_run(&[]);
    assert_eq!(ran.code, 3, "{}", ran.said);
    assert!(ran.said.contains("failed: 10 points: a tree takes at least 50"), "{}", ran.said);
    let trees = campaign.table("trees.csv");
    assert_eq!(trees.len(), 1, "the other has a model: {trees:?}");
    let files = campaign.files(&["outputs/trees"]);
    assert!(files.keys().any(|path| path.ends_with("tree.glb")), "{:?}", files.keys());
}
