use super::lzf::compress;
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

/// Position, packed colour, intensity, two normals.
type Row = ([f64; 3], [u8; 3], u16, [f32; 2]);

fn header(rows: usize, data: &str) -> Vec<u8> {
    format!(
        "# .PCD v0.7 - made by hand\nVERSION 0.7\nFIELDS x y z rgb _ intensity n\nSIZE 8 8 8 4 1 2 4\n\
         TYPE F F F F U U F\nCOUNT 1 1 1 1 3 1 2\nWIDTH {rows}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n\
         POINTS {rows}\nDATA {data}\n"
    )
    .into_bytes()
}

fn fields(row: &Row) -> [Vec<u8>; 7] {
    let (at, [r, g, b], intensity, n) = row;
    [
        at[0].to_le_bytes().to_vec(),
        at[1].to_le_bytes().to_vec(),
        at[2].to_le_bytes().to_vec(),
        vec![*b, *g, *r, 0],
        vec![0; 3],
        intensity.to_le_bytes().to_vec(),
        n.map(f32::to_le_bytes).concat(),
    ]
}

fn file(rows: &[Row], data: &str) -> Vec<u8> {
    let mut bytes = header(rows.len(), data);
    match data {
        "binary" => rows.iter().for_each(|row| bytes.extend(fields(row).concat())),
        "binary_compressed" => {
            let all: Vec<[Vec<u8>; 7]> = rows.iter().map(fields).collect();
            let columns: Vec<u8> =
                (0..7).flat_map(|f| all.iter().flat_map(move |row| row[f].clone())).collect();
            let packed = compress(&columns);
            bytes.extend((packed.len() as u32).to_le_bytes());
            bytes.extend((columns.len() as u32).to_le_bytes());
            bytes.extend(packed);
        }
        _ => {
            for (at, [r, g, b], intensity, n) in rows {
                let packed = f32::from_bits(u32::from_le_bytes([*b, *g, *r, 0]));
                let [x, y, z] = at;
                let line = format!("{x} {y} {z} {packed:e} 0 0 0 {intensity} {} {}\n", n[0], n[1]);
                bytes.extend(line.bytes());
            }
        }
    }
    bytes
}

const DATA: [&str; 3] = ["ascii", "binary", "binary_compressed"];

#[test]
fn packed_colours_and_counts_are_taken_apart() {
    let rows: Vec<Row> = (0..5)
        .map(|i| ([f64::from(i), -2.5, 500_000.25], [200, i as u8, 9], 700 + i as u16, [0.5, -1.0]))
        .collect();
    for data in DATA {
        let (cloud, scan) = read(file(&rows, data));
        assert!(
            scan.damage().is_none() && scan.notes().messages().is_empty(),
            "{data} {:?}",
            scan.notes()
        );
        assert_eq!((scan.container(), cloud.world(4)), ("PCD", [4.0, -2.5, 500_000.25]), "{data}");
        assert_eq!(cloud.extra["red"], Column::U16(vec![200 * 257; 5]), "{data}");
        assert_eq!(cloud.extra["green"].value(3), 3.0 * 257.0, "{data}");
        assert_eq!((cloud.intensity[2], cloud.extra["n_2"].value(2)), (702, -1.0), "{data}");
        assert!(!cloud.extra.contains_key("_") && !cloud.extra.contains_key("rgb"), "{data}");
    }
}

/// The header of the PCL manual has colours as whole numbers in a floating-point field.
#[test]
fn colours_written_as_whole_numbers() {
    let text = "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n\
                0.93773 0.33763 0 4.2108e+06\n";
    let (cloud, _) = read(text.as_bytes().to_vec());
    // 4210800 is 0x404070.
    assert_eq!(
        [0x40, 0x40, 0x70].map(|v| f64::from(v) * 257.0),
        ["red", "green", "blue"].map(|name| cloud.extra[name].value(0))
    );
}

#[test]
fn points_without_return_are_left_out() {
    let rows: Vec<Row> =
        vec![([f64::NAN; 3], [0; 3], 0, [0.0; 2]), ([1.0; 3], [0; 3], 0, [0.0; 2])];
    for data in DATA {
        let (cloud, scan) = read(file(&rows, data));
        assert_eq!((cloud.len(), scan.outside()), (1, 1), "{data}");
        assert!(scan.first_outside().unwrap().ends_with("x is NaN"), "{data}");
    }
}

#[test]
fn damage_names_its_place() {
    let rows: Vec<Row> = vec![([1.0, 2.0, 3.0], [1, 2, 3], 4, [0.1, 0.2]); 50];
    let mut cut = file(&rows, "binary");
    cut.truncate(cut.len() - 41 * 3 - 1);
    let (cloud, scan) = read(cut);
    let message = scan.damage().unwrap().to_string();
    assert_eq!(cloud.len(), 46);
    assert!(message.contains("record 46") && message.contains("46 of 50 points"), "{message}");
    let mut cut = file(&rows, "ascii");
    cut.truncate(cut.len() - 60);
    let message = read(cut).1.damage().unwrap().to_string();
    assert!(message.contains("of 50 points can be read"), "{message}");
    let varied: Vec<Row> = (0..50u16)
        .map(|i| ([f64::from(i).sqrt(); 3], [i as u8; 3], i, [f32::from(i).sqrt(); 2]))
        .collect();
    let mut cut = file(&varied, "binary_compressed");
    cut.truncate(cut.len() - 40);
    let (cloud, scan) = read(cut);
    let message = scan.damage().unwrap().to_string();
    assert!(
        (1..50).contains(&cloud.len()) && message.contains("the compressed data end"),
        "{message}"
    );
    let mut wrong = file(&rows, "binary_compressed");
    let at = header(50, "binary_compressed").len() + 4;
    wrong[at] ^= 1;
    let message = open(wrong).map(drop).unwrap_err().to_string();
    assert!(message.contains("50 points of 41 bytes are expected"), "{message}");
}

#[test]
fn a_viewpoint_is_said() {
    let bytes = file(&[([1.0; 3], [0; 3], 0, [0.0; 2])], "ascii");
    let text = String::from_utf8(bytes).unwrap().replace("VIEWPOINT 0 0 0", "VIEWPOINT 0 0 2");
    let (_, scan) = read(text.into_bytes());
    assert!(scan.notes().messages()[0].contains("(0 0 2, rotation 1 0 0 0) is not applied"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn all_encodings_give_the_same_points(
        rows in prop::collection::vec((prop::array::uniform3(-1e6f64..1e6), any::<[u8; 3]>(), any::<u16>(), prop::array::uniform2(-1f32..1.0)), 1..60),
    ) {
        let [a, b, c] = DATA.map(|data| read(file(&rows, data)).0);
        prop_assert_eq!(&b.x, &c.x);
        for index in 0..rows.len() {
            let expected = rows[index].0.map(timberline_pointcloud::frame::quantise);
            for cloud in [&a, &b, &c] {
                prop_assert_eq!(cloud.world(index), expected);
                prop_assert_eq!(cloud.extra["blue"].value(index), f64::from(rows[index].1[2]) * 257.0);
                prop_assert_eq!(cloud.intensity[index], rows[index].2);
            }
        }
    }

    /// Whatever is changed in a file, it is read or refused.
    #[test]
    fn changed_bytes_never_panic(
        data in 0usize..3,
        changes in prop::collection::vec((0usize..2000, any::<u8>()), 1..6),
        cut in prop::option::of(0usize..2000),
    ) {
        let rows: Vec<Row> = vec![([1.0, 2.0, 3.0], [1, 2, 3], 4, [0.1, 0.2]); 20];
        let mut bytes = file(&rows, DATA[data]);
        for (place, value) in changes {
            let place = place % bytes.len();
            bytes[place] = value;
        }
        bytes.truncate(cut.map_or(bytes.len(), |cut| cut % bytes.len()));
        if let Ok(mut file) = open(bytes) {
            let mut batches = 0;
            while let Ok(Some(cloud)) = file.next_batch() {
                cloud.validate().unwrap();
                batches += 1;
                if batches == 20 { break }
            }
        }
    }
}
