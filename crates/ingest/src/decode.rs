//! Raw point records to columns.

use crate::extra::{ExtraField, Raw};
use crate::format::{INTENSITY, Layout, USER_DATA, XYZ};
use crate::header::Header;
use timberline_artefact::Crs;
use timberline_pointcloud::frame::{MAX_COORDINATE_M, ticks_from_world, world_from_ticks};
use timberline_pointcloud::{Column, PointCloud};

/// Degrees in a step of the scan angle of formats 6 and up (LAS 1.4-R15, table 14).
const SCAN_ANGLE_STEP_DEG: f32 = 0.006;

/// Turns records of one file into points in the world, in metres.
#[derive(Debug, Clone)]
pub(crate) struct Decoder {
    layout: Layout,
    record_len: usize,
    scale: [f64; 3],
    offset: [f64; 3],
    metres: [f64; 3],
    extra: Vec<ExtraField>,
}

/// Points of a batch and how many records were not points.
#[derive(Debug, Clone, Default)]
pub(crate) struct Decoded {
    /// In the frame of the world (origin 0).
    pub(crate) cloud: PointCloud,
    /// Coordinates that are not finite or beyond the lattice.
    pub(crate) outside: u64,
}

impl Decoder {
    pub(crate) fn new(header: &Header, crs: &Crs, extra: Vec<ExtraField>) -> Self {
        let (h, v) = (crs.horizontal_m_per_unit, crs.vertical_m_per_unit);
        Self {
            layout: header.layout,
            record_len: usize::from(header.record_len),
            scale: header.scale,
            offset: header.offset,
            metres: [h, h, v],
            extra,
        }
    }

    pub(crate) fn decode(&self, records: &[u8]) -> Decoded {
        let mut cloud = PointCloud::default();
        [cloud.x, cloud.y, cloud.z] = std::array::from_fn(|axis| self.axis(records, axis));
        self.returns(records, &mut cloud);
        self.angles_and_ids(records, &mut cloud);
        self.colours(records, &mut cloud);
        for field in &self.extra {
            cloud.extra.insert(field.name.clone(), field.column(records, self.record_len));
        }
        keep_inside(cloud)
    }

    fn raw<'a>(&self, records: &'a [u8], at: usize) -> Raw<'a> {
        Raw { records, record_len: self.record_len, at }
    }

    /// World coordinates on the lattice, metres.
    fn axis(&self, records: &[u8], axis: usize) -> Vec<f64> {
        let (scale, offset, metres) = (self.scale[axis], self.offset[axis], self.metres[axis]);
        self.raw(records, XYZ[axis]).values(|bytes| {
            let in_file = f64::from(i32::from_le_bytes(bytes)) * scale + offset;
            let world = in_file * metres;
            if world.abs() <= MAX_COORDINATE_M {
                world_from_ticks(ticks_from_world(world))
            } else {
                f64::NAN
            }
        })
    }

    fn returns(&self, records: &[u8], cloud: &mut PointCloud) {
        cloud.intensity = self.raw(records, INTENSITY).values(u16::from_le_bytes);
        if self.layout.extended {
            let returns = self.raw(records, 14);
            cloud.return_number = returns.values(|[b]| b & 0x0F);
            cloud.number_of_returns = returns.values(|[b]| b >> 4);
            // Bits of byte 15: 4 class flags, 2 scanner channel, scan direction, edge.
            cloud.flags = self
                .raw(records, 15)
                .values(|[b]| (b & 0x0F) | ((b >> 7) << 4) | (((b >> 6) & 1) << 5));
            cloud.classification = self.raw(records, 16).values(|[b]| b);
            let channel: Vec<u8> = self.raw(records, 15).values(|[b]| (b >> 4) & 3);
            cloud.extra.insert("scanner_channel".to_owned(), Column::U8(channel));
        } else {
            let returns = self.raw(records, 14);
            cloud.return_number = returns.values(|[b]| b & 7);
            cloud.number_of_returns = returns.values(|[b]| (b >> 3) & 7);
            // Byte 14: direction in bit 6, edge in bit 7; byte 15: class and three flags.
            cloud.flags = returns
                .values(|[b, c]: [u8; 2]| (c >> 5) | ((b >> 7) << 4) | (((b >> 6) & 1) << 5));
            cloud.classification = self.raw(records, 15).values(|[b]| b & 0x1F);
        }
    }

    fn angles_and_ids(&self, records: &[u8], cloud: &mut PointCloud) {
        cloud.scan_angle_deg = if self.layout.extended {
            self.raw(records, 18)
                .values(|bytes| f32::from(i16::from_le_bytes(bytes)) * SCAN_ANGLE_STEP_DEG)
        } else {
            self.raw(records, 16).values(|bytes| f32::from(i8::from_le_bytes(bytes)))
        };
        cloud.source_id = self.raw(records, self.layout.source_id()).values(u16::from_le_bytes);
        cloud.gps_time = match self.layout.gps_time {
            Some(at) => self.raw(records, at).values(f64::from_le_bytes),
            None => vec![f64::NAN; cloud.x.len()],
        };
        let user = self.raw(records, USER_DATA).values(|[b]| b);
        cloud.extra.insert("user_data".to_owned(), Column::U8(user));
    }

    fn colours(&self, records: &[u8], cloud: &mut PointCloud) {
        let mut add = |name: &str, at: usize| {
            let values = self.raw(records, at).values(u16::from_le_bytes);
            cloud.extra.insert(name.to_owned(), Column::U16(values));
        };
        if let Some(at) = self.layout.rgb {
            ["red", "green", "blue"].iter().enumerate().for_each(|(i, name)| add(name, at + 2 * i));
        }
        if let Some(at) = self.layout.nir {
            add("nir", at);
        }
    }
}

fn keep_inside(cloud: PointCloud) -> Decoded {
    let bad = |i: &usize| cloud.x[*i].is_nan() || cloud.y[*i].is_nan() || cloud.z[*i].is_nan();
    let outside = (0..cloud.len()).filter(bad).count() as u64;
    if outside == 0 {
        return Decoded { cloud, outside };
    }
    let inside: Vec<u32> = (0..cloud.len()).filter(|i| !bad(i)).map(|i| i as u32).collect();
    Decoded { cloud: cloud.select(&inside), outside }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Notes;
    use crate::testing::LasBytes;

    fn decode(bytes: Vec<u8>, crs: &Crs) -> Decoded {
        let mut source = std::io::Cursor::new(bytes.clone());
        let header = Header::read(&mut source, &mut Notes::default()).unwrap();
        let records = &bytes[header.points_at as usize..];
        Decoder::new(&header, crs, Vec::new()).decode(records)
    }

    #[test]
    fn old_flags_and_classes_are_taken_apart() {
        let las = LasBytes::new((1, 2), 0);
        let mut record = las.record([150, -250, 375]);
        record[14] = 2 | (3 << 3) | 0x40;
        record[15] = 5 | 0x80;
        record[16] = (-7i8) as u8;
        let point = decode(las.push(record).build(), &Crs::default()).cloud;
        assert_eq!(point.world(0), [1.5, -2.5, 3.75]);
        let found = point.point(0);
        assert_eq!((found.return_number, found.number_of_returns), (2, 3));
        assert_eq!((found.classification, found.flags), (5, 0b10_0100));
        assert_eq!(found.scan_angle_deg, -7.0);
        assert!(found.gps_time.is_nan());
    }

    #[test]
    fn new_flags_and_classes_are_taken_apart() {
        let las = LasBytes::new((1, 4), 6);
        let mut record = las.record([0, 0, 0]);
        record[14] = 0xF9;
        record[15] = 0x80 | 0x20 | 0x08;
        record[16] = 64;
        record[18..20].copy_from_slice(&2500i16.to_le_bytes());
        let cloud = decode(las.push(record).build(), &Crs::default()).cloud;
        let found = cloud.point(0);
        assert_eq!((found.return_number, found.number_of_returns), (9, 15));
        assert_eq!((found.classification, found.flags), (64, 0b1_1000));
        assert_eq!(found.scan_angle_deg, 15.0);
        assert_eq!(cloud.extra["scanner_channel"], Column::U8(vec![2]));
    }

    #[test]
    fn feet_become_metres() {
        let crs = Crs { horizontal_m_per_unit: 0.3048, vertical_m_per_unit: 1.0, ..Crs::default() };
        let las = LasBytes::new((1, 2), 0);
        let record = las.record([100_000, 0, 100_000]);
        let cloud = decode(las.push(record).build(), &crs).cloud;
        assert_eq!(cloud.world(0), [304.8, 0.0, 1000.0]);
    }

    #[test]
    fn what_the_lattice_cannot_hold_is_counted() {
        let las = LasBytes::new((1, 2), 0);
        let mut bytes = {
            let record = las.record([i32::MAX, 1, 1]);
            las.push(record).points(1).build()
        };
        bytes[131..139].copy_from_slice(&1e300f64.to_le_bytes());
        let found = decode(bytes, &Crs::default());
        assert_eq!((found.outside, found.cloud.len()), (1, 1));
    }
}
