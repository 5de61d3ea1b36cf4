//! A small experiment as a whole.

#![allow(clippy::unwrap_used, reason = "an experiment that cannot be made fails the test")]

use timberline_experiment::crowns::{
    Assessed, Bounds, Experiment, Family, Setting, assess, plan, text,
};

fn small(threads: usize) -> Vec<Assessed> {
    let experiment = Experiment { trees: 30, repeats: 2, seed: 5, ..Experiment::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let one = |dataset| {
        let clusters = experiment.clusters(dataset).unwrap();
        let (settings, cells) = (plan::sweeps(), &experiment.cells_m);
        assess(&dataset.name, clusters, &settings, cells, &|| ()).unwrap()
    };
    pool.install(|| experiment.datasets.iter().map(one).collect())
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (one, three) = (small(1), small(3));
    assert_eq!(text::trees_csv(&one), text::trees_csv(&three));
    assert_eq!(text::methods_csv(&one), text::methods_csv(&three));
    assert_eq!(text::markdown(&one, &[0.4, 0.5]), text::markdown(&three, &[0.4, 0.5]));
}

#[test]
fn methods_come_in_the_papers_order() {
    let all = small(2);
    let median = |one: &Assessed, setting| one.row(&setting, 0.5).unwrap().median_m;
    let [spruce, fir] = &all[..] else { panic!("two datasets") };
    let l1 = Setting::l1(0.2, Bounds::Exact);
    let order = [
        l1.with_prior(0.1),
        l1,
        Setting::plain(Family::L2Free),
        Setting::plain(Family::HullCentroid),
    ];
    let medians = order.map(|setting| median(fir, setting));
    assert!(medians.windows(2).all(|pair| pair[0] < pair[1]), "{medians:?}");
    assert!(median(spruce, l1) < median(spruce, Setting::plain(Family::HullCentroid)));
    assert!((spruce.facts.height_m - 17.0).abs() < 1.5 && (fir.facts.height_m - 24.0).abs() < 1.5);
    for row in all.iter().flat_map(|one| &one.rows) {
        assert_eq!(row.failures, 0, "{}", row.setting);
        assert!(row.largest_gap.unwrap_or(0.0) < 1e-6, "{}: {:?}", row.setting, row.largest_gap);
    }
}

#[test]
fn tables_are_whole() {
    let all = small(2);
    let csv = text::methods_csv(&all);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert_eq!(csv.lines().count(), 1 + 2 * 2 * plan::sweeps().len());
    assert!(csv.lines().all(|line| line.split(',').count() == columns));
    let trees = text::trees_csv(&all);
    let columns = trees.lines().next().unwrap().split(',').count();
    assert_eq!(trees.lines().count(), 1 + 2 * 2 * 60 * plan::sweeps().len());
    assert!(trees.lines().all(|line| line.split(',').count() == columns));
    let report = text::markdown(&all, &[0.4, 0.5]);
    for heading in
        ["## Data", "## Methods", "## Fits", "## Over ω", "how the generated data differ"]
    {
        assert!(report.to_lowercase().contains(&heading.to_lowercase()), "{heading}");
    }
}
