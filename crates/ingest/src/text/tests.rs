use crate::{Scan, UnitChoice, scan};
use proptest::prelude::*;
use std::io::Cursor;
use timberline_pointcloud::{Column, PointCloud};

fn open(text: &str) -> Box<dyn Scan> {
    let source = Box::new(Cursor::new(text.as_bytes().to_vec()));
    scan::from_source(source, UnitChoice::default(), None).unwrap()
}

fn read(text: &str) -> (PointCloud, Vec<String>, Option<String>) {
    let mut file = open(text);
    let mut cloud = PointCloud::default();
    while let Some(batch) = file.next_batch().unwrap() {
        cloud.append(&batch).unwrap();
    }
    let notes = file.notes().messages().to_vec();
    (cloud, notes, file.damage().map(|error| error.to_string()))
}

fn clean(text: &str) -> PointCloud {
    let (cloud, notes, damage) = read(text);
    assert_eq!((notes, damage), (Vec::new(), None), "{text}");
    cloud.validate().unwrap();
    cloud
}

#[test]
fn columns_without_a_header_are_known_by_their_number() {
    assert_eq!(clean("-0.5 2 3\n1 2 3.25\n").world(0), [-0.5, 2.0, 3.0]);
    assert_eq!(clean("1,2,3,400\n1,2,3,500\n").intensity, [400, 500]);
    let coloured = clean("1 2 3 255 0 7\n");
    assert_eq!(coloured.extra["red"], Column::U16(vec![65_535]));
    assert_eq!(coloured.extra["blue"], Column::U16(vec![7 * 257]));
    let both = clean("1;2;3;60000;1000;2000;3000\n");
    assert_eq!((both.intensity[0], both.extra["green"].value(0)), (60_000, 2000.0));
    let (more, notes, _) = read("1 2 3 0.5 9\n");
    assert_eq!((more.extra["column_4"].value(0), more.extra["column_5"].value(0)), (0.5, 9.0));
    assert!(notes[0].contains("column_4"), "{notes:?}");
}

#[test]
fn columns_are_named_by_the_header() {
    let text = "id;X;Y;Z;Intensity;Return Number;Number of Returns;Classification;GpsTime;Species\n\
                7;500000,25;5400000,5;312,125;77;2;3;5;1000,5;Oak\n\
                8;500001,25;5400000,5;313,125;78;1;1;2;1001,5;Fir\n";
    let (cloud, notes, damage) = read(text);
    assert_eq!(cloud.world(1), [500_001.25, 5_400_000.5, 313.125]);
    let point = cloud.point(0);
    assert_eq!((point.intensity, point.return_number, point.number_of_returns), (77, 2, 3));
    assert_eq!((point.classification, point.gps_time), (5, 1000.5));
    assert_eq!(cloud.extra["id"], Column::F64(vec![7.0, 8.0]));
    assert_eq!(
        (notes.as_slice(), damage),
        (&["column `Species` holds text and is left out".to_owned()][..], None)
    );
}

#[test]
fn attributes_that_a_text_has_not_are_zero_or_nan() {
    let mut file = open("1 2 3\n");
    assert!(!file.has_returns() && file.container() == "text");
    let point = file.next_batch().unwrap().unwrap().point(0);
    assert!(point.gps_time.is_nan());
    assert_eq!((point.return_number, point.classification, point.source_id), (0, 0, 0));
    assert!(file.crs().is_unknown() && file.notes().messages().is_empty());
}

#[test]
fn intensities_of_pts_are_shifted_and_kept_as_given() {
    let (cloud, notes, damage) = read("2\n0 0 0 -2048 1 2 3\n1 1 1 2047 4 5 6\n");
    assert_eq!((cloud.intensity.as_slice(), damage), (&[0, 65_535][..], None));
    assert_eq!(cloud.extra[super::AS_GIVEN], Column::F64(vec![-2048.0, 2047.0]));
    assert!(notes[0].contains("from -2048 to 2047"), "{notes:?}");
}

#[test]
fn counts_that_do_not_fit_are_damage() {
    let (cloud, _, damage) = read("3\n0 0 0\n1 1 1\n");
    let damage = damage.unwrap();
    assert_eq!(cloud.len(), 2);
    assert!(
        damage.contains("line 1: it counts 3 points, the file has 2; 2 of 3 points"),
        "{damage}"
    );
    let (cloud, notes, damage) = read("2\n0 0 0\n1 1 1\n2 2 2\n");
    assert_eq!((cloud.len(), damage), (3, None));
    assert!(notes[0].contains("line 1 counts 2 points, the file has 3"), "{notes:?}");
    let (cloud, _, damage) = read("2\n0 0 0\n1 1 1\n1\n2 2 2\n");
    assert_eq!((cloud.len(), damage), (3, None));
}

#[test]
fn rows_that_cannot_be_used_are_named() {
    let mut text: String = (0..20).map(|i| format!("{i} 2 3\n")).collect();
    text.push_str("1 2\n1 2 here\nnan 2 3\n");
    let (cloud, _, damage) = read(&text);
    let damage = damage.unwrap();
    assert_eq!(cloud.len(), 20);
    assert!(damage.contains("line 21: 2 columns, expected 3: `1 2`; 21 of 23 points"), "{damage}");
    let mut file = open(&text);
    while file.next_batch().unwrap().is_some() {}
    assert_eq!(file.first_outside(), Some("line 23: x is NaN"));
    assert_eq!(file.damages()[1].problem, "`here` is no number");
}

#[test]
fn feet_become_metres() {
    let units = UnitChoice {
        horizontal: crate::LengthUnit::InternationalFoot,
        vertical: crate::LengthUnit::Metre,
    };
    let source = Box::new(Cursor::new(b"1000 0 1000\n".to_vec()));
    let mut file = scan::from_source(source, units, None).unwrap();
    assert_eq!(file.next_batch().unwrap().unwrap().world(0), [304.8, 0.0, 1000.0]);
}

/// A byte order mark, a comment, and lines of Windows.
#[test]
fn what_stands_before_the_rows_is_stepped_over() {
    let cloud = clean(
        "\u{feff}// made by hand\r\n// x\ty\tz\tintensity\r\n1\t2\t3\t4\r\n\r\n5\t6\t7\t8\r\n",
    );
    assert_eq!((cloud.len(), cloud.intensity[1]), (2, 8));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Coordinates at georeferenced size come back to the last digit, in any way of writing.
    #[test]
    fn positions_come_back_exactly(
        points in prop::collection::vec((4_000_000_000i64..6_000_000_000, 50_000_000_000i64..55_000_000_000, -9_000_000i64..9_000_000), 1..50),
        way in 0usize..4,
    ) {
        let (mark, comma) = [(" ", false), (",", false), (";", true), ("\t", true)][way];
        let number = |ticks: i64| {
            let sign = if ticks < 0 { "-" } else { "" };
            let point = if comma { "," } else { "." };
            format!("{sign}{}{point}{:04}", ticks.abs() / 10_000, ticks.abs() % 10_000)
        };
        let row = |p: &(i64, i64, i64)| [p.0, p.1, p.2].map(number).join(mark);
        let text: Vec<String> = points.iter().map(row).collect();
        let cloud = clean(&text.join("\n"));
        for (index, p) in points.iter().enumerate() {
            let ticks = cloud.world(index).map(timberline_pointcloud::frame::ticks_from_world);
            prop_assert_eq!(ticks, [p.0, p.1, p.2]);
        }
    }

    #[test]
    fn any_text_is_read_or_refused(text in "[0-9 .,;\t\nxyzXYZ#/e-]{0,200}") {
        let source = Box::new(Cursor::new(text.into_bytes()));
        if let Ok(mut file) = scan::from_source(source, UnitChoice::default(), None) {
            while let Ok(Some(cloud)) = file.next_batch() {
                cloud.validate().unwrap();
            }
        }
    }
}
