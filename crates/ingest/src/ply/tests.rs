use crate::{Scan, UnitChoice, scan};
use proptest::prelude::*;
use std::io::Cursor;
use timberline_pointcloud::{Column, PointCloud};

fn open(bytes: Vec<u8>) -> Result<Box<dyn Scan>, crate::Error> {
    scan::from_source(Box::new(Cursor::new(bytes)), UnitChoice::default(), None)
}

fn read(bytes: Vec<u8>) -> (PointCloud, Box<dyn Scan>) {
    let mut file = open(bytes).unwrap();
    let mut cloud = PointCloud::default();
    while let Some(batch) = file.next_batch().unwrap() {
        cloud.append(&batch).unwrap();
    }
    cloud.validate().unwrap();
    (cloud, file)
}

/// A point with a colour, a list and a further attribute, between elements of other things.
fn file(encoding: &str, points: &[([f64; 3], [u8; 3], f32)]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {encoding} 1.0\ncomment made by hand\nelement camera 2\nproperty list uchar short knots\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty list uchar int faces\nproperty float scalar_Depth\nproperty double z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n",
        points.len()
    );
    let mut bytes = header.into_bytes();
    let big = encoding == "binary_big_endian";
    let ascii = encoding == "ascii";
    macro_rules! put {
        ($value:expr) => {{
            let value = $value;
            if ascii {
                bytes.extend(format!("{value} ").bytes());
            } else if big {
                bytes.extend(value.to_be_bytes());
            } else {
                bytes.extend(value.to_le_bytes());
            }
        }};
    }
    macro_rules! end {
        () => {
            if ascii {
                bytes.push(b'\n')
            }
        };
    }
    put!(1u8);
    put!(-7i16);
    end!();
    put!(0u8);
    end!();
    for (index, ([x, y, z], colour, depth)) in points.iter().enumerate() {
        put!(*x);
        put!(*y);
        colour.iter().for_each(|value| put!(*value));
        put!((index % 3) as u8);
        (0..index % 3).for_each(|item| put!(item as i32));
        put!(*depth);
        put!(*z);
        end!();
    }
    put!(3u8);
    [0, 1, 2].into_iter().for_each(|vertex: i32| put!(vertex));
    end!();
    bytes
}

const ENCODINGS: [&str; 3] = ["ascii", "binary_little_endian", "binary_big_endian"];

#[test]
fn lists_and_other_elements_are_stepped_over() {
    let points: Vec<_> = (0..7)
        .map(|i| {
            let f = f64::from(i);
            ([500_000.25 + f, 5_400_000.5 - f, f * 0.125], [i as u8, 255, 0], i as f32 * 0.5)
        })
        .collect();
    for encoding in ENCODINGS {
        let (cloud, scan) = read(file(encoding, &points));
        assert_eq!((scan.container(), scan.damages().len()), ("PLY", 0), "{encoding}");
        assert_eq!(cloud.world(6), [500_006.25, 5_399_994.5, 0.75], "{encoding}");
        assert_eq!(cloud.extra["green"], Column::U16(vec![65_535; 7]), "{encoding}");
        assert_eq!(cloud.extra["scalar_Depth"].value(3), 1.5, "{encoding}");
    }
}

#[test]
fn a_file_cut_off_gives_its_whole_records() {
    let points = vec![([1.0, 2.0, 3.0], [1, 2, 3], 0.5); 9];
    for encoding in ENCODINGS {
        let mut bytes = file(encoding, &points);
        // Face and half of the last point.
        let cut = if encoding == "ascii" { 8 + 20 } else { 13 + 20 };
        bytes.truncate(bytes.len() - cut);
        let (cloud, scan) = read(bytes);
        let message = scan.damage().unwrap().to_string();
        assert!((7..=8).contains(&cloud.len()), "{encoding} {}", cloud.len());
        assert!(message.contains("of 9 points can be read"), "{message}");
    }
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend([0; 30]);
    let (cloud, scan) = read(bytes);
    let message = scan.damage().unwrap().to_string();
    assert_eq!(cloud.len(), 2);
    let place = format!(
        "record 2 (byte {}): the file ends at byte {}",
        header.len() + 24,
        header.len() + 30
    );
    assert!(message.contains(&place) && message.contains("2 of 4 points"), "{message}");
}

fn plain(kind: &str, count: usize, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty {kind} x\nproperty {kind} y\n\
         property {kind} z\nproperty float intensity\nend_header\n"
    );
    [header.as_bytes(), body].concat()
}

#[test]
fn floats_stay_what_they_are_and_coarse_ones_are_said() {
    let point = |x: f32, i: f32| [x, 2.5, -0.1, i].map(f32::to_le_bytes).concat();
    let (cloud, scan) = read(plain("float", 2, &[point(0.1, 0.25), point(f32::NAN, 1.0)].concat()));
    assert_eq!((cloud.len(), cloud.world(0)), (1, [0.1, 2.5, -0.1]));
    assert_eq!((cloud.intensity[0], scan.outside()), (16_384, 1));
    assert_eq!(scan.first_outside(), Some("record 1: x is NaN"));
    assert_eq!(cloud.extra["intensity_as_given"], Column::F32(vec![0.25]));
    let (_, scan) = read(plain("float", 1, &point(5_400_000.5, 7.0)));
    assert!(scan.notes().messages()[0].contains("multiples of 0.5"), "{:?}", scan.notes());
}

#[test]
fn headers_without_points_are_refused() {
    let check = |text: &str, part: &str| {
        let message = open(text.as_bytes().to_vec()).map(drop).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    };
    check("ply\nformat ascii 1.0\nend_header\n", "there is no element");
    check(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n",
        "`vertex` has no property y, z",
    );
    let huge = "ply\nformat binary_little_endian 1.0\nelement a 99999999999999999\nproperty double b\nelement vertex 1\n\
                property float x\nproperty float y\nproperty float z\nend_header\n1234";
    check(huge, "before its 99999999999999999 records");
    let none = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let (cloud, scan) = read(none.as_bytes().to_vec());
    assert!(cloud.is_empty() && scan.damage().is_none() && scan.notes().messages().len() == 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn all_encodings_give_the_same_points(
        points in prop::collection::vec((prop::array::uniform3(-1e6f64..1e6), any::<[u8; 3]>(), -9f32..9.0), 1..40),
    ) {
        let [a, b, c] = ENCODINGS.map(|encoding| read(file(encoding, &points)).0);
        for index in 0..points.len() {
            let expected = points[index].0.map(timberline_pointcloud::frame::quantise);
            for cloud in [&a, &b, &c] {
                prop_assert_eq!(cloud.world(index), expected);
                prop_assert_eq!(cloud.extra["scalar_Depth"].value(index) as f32, points[index].2);
            }
        }
    }

    /// Whatever is changed in a file, it is read or refused.
    #[test]
    fn changed_bytes_never_panic(
        encoding in 0usize..3,
        changes in prop::collection::vec((0usize..2000, any::<u8>()), 1..6),
        cut in prop::option::of(0usize..2000),
    ) {
        let mut bytes = file(ENCODINGS[encoding], &vec![([1.0, 2.0, 3.0], [1, 2, 3], 0.5); 20]);
        for (place, value) in changes {
            let place = place % bytes.len();
            bytes[place] = value;
        }
        bytes.truncate(cut.map_or(bytes.len(), |cut| cut % bytes.len()));
        if let Ok(mut file) = open(bytes) {
            while let Ok(Some(cloud)) = file.next_batch() {
                cloud.validate().unwrap();
            }
        }
    }
}
