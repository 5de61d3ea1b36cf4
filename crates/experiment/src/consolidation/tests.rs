use super::*;

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn uniform(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A trunk of 24 cm in diameter with noise across its surface.
fn trunk(name: &str, count: u64, noise_m: f64) -> Case {
    let at = |i: u64| {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * uniform(9 * i));
        let r = 0.12 + noise_m * (2.0 * uniform(9 * i + 1) - 1.0);
        [r * cos, r * sin, 3.0 * uniform(9 * i + 2)]
    };
    Case {
        name: name.to_owned(),
        points_m: (0..count).map(at).collect(),
        wood: None,
        base_m: [0.0; 3],
        dbh_m: Some(0.24),
    }
}

#[test]
fn a_noisy_trunk_has_all_models() {
    let tree = assess(&trunk("noisy", 20_000, 0.01)).unwrap();
    assert_eq!(tree.rows.len(), 7);
    for row in &tree.rows {
        let figures = row.figures.as_ref().unwrap_or_else(|| panic!("{row:?}"));
        assert_eq!(figures.cloud_to_model.count, 20_000, "distances are of the points as scanned");
        let dbh_m = figures.dbh_m.unwrap_or(0.0);
        // AdTree's is what its first edge makes of it.
        let right = (dbh_m - 0.24).abs() < 0.004;
        assert!(right || row.mode == Mode::Adtree && dbh_m > 0.0, "{row:?}");
    }
    let [_, by_default] = tree.thinned.map(Option::unwrap);
    assert!(by_default.thickness_after_m < 0.8 * by_default.thickness_before_m, "{by_default:?}");
    assert!(by_default.points < 20_000);
    // What is kept is never farther from the points.
    let mean_m = |source| tree.figures(Mode::Default, source).unwrap().cloud_to_model.mean_m;
    assert_eq!(mean_m(Source::Kept), mean_m(Source::Scanned).min(mean_m(Source::Default)));
    let changes = changes(&[tree]);
    assert_eq!(changes.len(), 5);
    assert!(changes[4].worst <= 0.0 && changes[4].source == Source::Kept, "{:?}", changes[4]);
}

#[test]
fn what_was_skipped_is_said_everywhere() {
    let all = [assess(&trunk("smooth", 20_000, 0.0002)).unwrap()];
    let row = all[0].rows.iter().find(|row| row.source == Source::Default).unwrap();
    assert!(row.figures.is_none() && row.remark.contains("thin already"), "{row:?}");
    let kept = all[0].rows.last().unwrap();
    assert!(
        kept.figures.is_some() && kept.remark.starts_with("scanned: skipped: thin"),
        "{kept:?}"
    );
    let csv = text::models_csv(&all);
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 8);
    let columns = lines[0].split(',').count();
    for line in &lines[1..] {
        let before_remark = line.split('"').next().unwrap();
        assert_eq!(before_remark.split(',').count(), columns, "{line}");
    }
    let text = text::markdown(&all);
    assert!(text.contains("| smooth | 20000 |") && text.contains("| skipped |"), "{text}");
    assert!(text.contains("-30.74 %"), "{text}");
}
