use super::*;

fn branch(order: u16, from: [f64; 3], to: [f64; 3], radius_m: f64) -> Branch {
    Branch { order, cylinders: vec![Cylinder { start_m: from, end_m: to, radius_m }] }
}

/// A stem and two branches.
fn truth() -> Vec<Branch> {
    vec![
        branch(0, [0.0; 3], [0.0, 0.0, 10.0], 0.2),
        branch(1, [0.0, 0.0, 5.0], [2.0, 0.0, 6.0], 0.04),
        branch(1, [0.0, 0.0, 7.0], [0.0, 2.0, 8.0], 0.008),
    ]
}

fn assess(model: &[Branch]) -> BranchAccuracy {
    assess_branches(&truth(), model, &BranchParams::default()).unwrap()
}

#[test]
fn the_truth_against_itself_is_perfect() {
    let found = assess(&truth());
    assert_eq!((found.all.reference, found.all.found, found.all.false_branches), (3, 3, 0));
    assert!((found.all.found_m - found.all.reference_m).abs() < 1e-9);
    assert!(found.all.false_m < 1e-9);
    let by_order: Vec<u32> = found.by_order.iter().map(|counts| counts.found).collect();
    assert_eq!(by_order, [1, 2]);
    let by_class: Vec<u32> = found.by_class.iter().map(|counts| counts.reference).collect();
    assert_eq!(by_class, [1, 0, 1, 1]);
}

#[test]
fn missing_and_false_branches_are_counted_by_group() {
    let mut model = truth();
    model.pop();
    model.push(branch(2, [1.0, 0.0, 5.5], [1.0, 3.0, 6.0], 0.03));
    let found = assess(&model);
    assert_eq!((found.all.missing(), found.all.false_branches), (1, 1));
    assert_eq!((found.by_class[0].missing(), found.by_class[2].false_branches), (1, 1));
    assert_eq!((found.by_order[2].model, found.by_order[2].false_branches), (1, 1));
    assert_eq!(found.by_order[2].reference, 0);
}

#[test]
fn half_a_branch_is_found_and_less_is_not() {
    let reach = |share: f64| {
        let mut model = truth();
        model[1].cylinders[0].end_m = [2.0 * share, 0.0, 5.0 + share];
        assess(&model).all
    };
    assert_eq!(reach(0.6).missing(), 0);
    assert_eq!(reach(0.3).missing(), 1);
    let length = truth()[1].length_m();
    assert!((reach(0.3).reference_m - reach(0.3).found_m - 0.7 * length).abs() < 0.15);
}

#[test]
fn an_axis_inside_the_wood_is_on_it() {
    let aside = |x: f64| assess(&[branch(0, [x, 0.0, 0.0], [x, 0.0, 10.0], 0.2)]).all;
    assert_eq!((aside(0.24).found, aside(0.24).false_branches), (1, 0));
    assert_eq!((aside(0.26).found, aside(0.26).false_branches), (0, 1));
}

#[test]
fn odd_input() {
    let nothing = assess(&[]);
    assert_eq!((nothing.all.found, nothing.all.model), (0, 0));
    let lost = branch(0, [f64::NAN; 3], [0.0; 3], 0.1);
    assert_eq!(assess(&[lost]).all.false_branches, 1);
    let point = branch(3, [9.0; 3], [9.0; 3], 0.1);
    assert_eq!(assess(&[point]).all.false_branches, 1);
    for params in [
        BranchParams { step_m: 0.0, ..BranchParams::default() },
        BranchParams { tolerance_m: -1.0, ..BranchParams::default() },
        BranchParams { share: 1.5, ..BranchParams::default() },
        BranchParams { tolerance_radii: f64::NAN, ..BranchParams::default() },
    ] {
        assert!(matches!(assess_branches(&[], &[], &params), Err(Error::Parameter { .. })));
    }
}

#[test]
fn volumes_are_split_by_stem_and_diameter() {
    let truth = Volumes::of(&truth());
    assert!((truth.stem_m3 - std::f64::consts::PI * 0.04 * 10.0).abs() < 1e-12);
    assert!(truth.thick_m3 > 0.01 && truth.thin_m3 < 0.001);
    let found = Volumes { stem_m3: truth.stem_m3 * 1.05, thick_m3: 0.0, ..truth };
    let [stem, thick, thin, total] = found.relative_errors(&truth);
    assert!((stem - 0.05).abs() < 1e-12 && thick == -1.0 && thin == 0.0);
    assert!((total - (0.05 * truth.stem_m3 - truth.thick_m3) / truth.total_m3()).abs() < 1e-12);
    assert!(found.relative_errors(&Volumes::default())[0].is_nan());
}
