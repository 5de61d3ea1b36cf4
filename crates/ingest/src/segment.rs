//! The bytes of a run of points of one tile, and of voxel counts.
//!
//! Columns, not records: positions as differences of ticks from point to point, GPS times as
//! differences of their bits, everything split into planes of bytes, then zstd at level 1.

use crate::voxels::Voxel;
use timberline_pointcloud::frame::{TICKS_PER_M, ticks_from_world, world_from_ticks};
use timberline_pointcloud::{Column, Frame, PointCloud};

/// Higher levels gain next to nothing on such data and cost several times as much.
const LEVEL: i32 = 1;
/// No section decompresses to more.
const MAX_RAW: usize = 1 << 27;
/// Points of a segment; more are split.
const MAX_POINTS: usize = 1 << 16;

/// How many points go into one segment, given the number of extra columns.
pub(crate) fn max_points(extra_columns: usize) -> usize {
    const FIXED_BYTES: usize = 36;
    (MAX_RAW / 2 / (FIXED_BYTES + 8 * extra_columns)).clamp(1, MAX_POINTS)
}

/// Encodes points whose frame's origin is the corner of their tile, elevation 0.
///
/// Columns of optional attributes that hold nothing but zeros here are left out.
pub(crate) fn encode(cloud: &PointCloud, optional: &[&str]) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(cloud.len() * 34 + 64);
    out.extend((cloud.len() as u32).to_le_bytes());
    for axis in [&cloud.x, &cloud.y, &cloud.z] {
        let ticks = axis.iter().map(|metres| ticks_from_world(*metres) as i32);
        put(&mut out, Deltas { last: 0, values: ticks });
    }
    put(&mut out, cloud.intensity.iter().map(|v| v.to_le_bytes()));
    put(&mut out, cloud.return_number.iter().map(|v| v.to_le_bytes()));
    put(&mut out, cloud.number_of_returns.iter().map(|v| v.to_le_bytes()));
    put(&mut out, cloud.classification.iter().map(|v| v.to_le_bytes()));
    put(&mut out, cloud.flags.iter().map(|v| v.to_le_bytes()));
    put(&mut out, cloud.scan_angle_deg.iter().map(|v| v.to_le_bytes()));
    let mut last = 0u64;
    put(
        &mut out,
        cloud.gps_time.iter().map(|time| {
            let bits = time.to_bits();
            let delta = bits.wrapping_sub(last);
            last = bits;
            delta.to_le_bytes()
        }),
    );
    put(&mut out, cloud.source_id.iter().map(|v| v.to_le_bytes()));
    let kept = cloud.extra.iter().filter(|(name, column)| {
        !(optional.contains(&name.as_str()) && crate::scatter::is_zero(column))
    });
    for (name, column) in kept {
        put_column(&mut out, name, column);
    }
    pack(&out)
}

/// Compresses bytes behind their length.
fn pack(raw: &[u8]) -> Result<Vec<u8>, String> {
    if raw.len() > MAX_RAW {
        return Err(format!("{} bytes are more than a section may hold", raw.len()));
    }
    let packed = zstd::bulk::compress(raw, LEVEL).map_err(|error| error.to_string())?;
    Ok([&(raw.len() as u32).to_le_bytes(), packed.as_slice()].concat())
}

fn unpack(bytes: &[u8]) -> Result<Vec<u8>, String> {
    let (head, packed) = bytes.split_first_chunk::<4>().ok_or("no length")?;
    let len = u32::from_le_bytes(*head) as usize;
    if len > MAX_RAW {
        return Err(format!("it claims {len} bytes, a section holds at most {MAX_RAW}"));
    }
    let raw = zstd::bulk::decompress(packed, len).map_err(|error| error.to_string())?;
    if raw.len() == len { Ok(raw) } else { Err(format!("{} of {len} bytes", raw.len())) }
}

/// Decodes points into a frame with the tile's corner as origin.
pub(crate) fn decode(bytes: &[u8], frame: Frame) -> Result<PointCloud, String> {
    let raw = unpack(bytes)?;
    let mut input = Input::new(&raw)?;
    let mut cloud = PointCloud::new(frame);
    // The world coordinate is the nearest f64 to its tick; local ones are exact differences of it.
    let origin = frame.origin_m;
    let metres = |ticks: Vec<i32>, axis: usize| -> Vec<f64> {
        let base = origin[axis] * TICKS_PER_M as i64;
        let local = |t: i32| world_from_ticks(base + i64::from(t)) - origin[axis] as f64;
        ticks.into_iter().map(local).collect()
    };
    cloud.x = metres(input.ticks()?, 0);
    cloud.y = metres(input.ticks()?, 1);
    cloud.z = metres(input.ticks()?, 2);
    cloud.intensity = input.values(u16::from_le_bytes)?;
    cloud.return_number = input.values(u8::from_le_bytes)?;
    cloud.number_of_returns = input.values(u8::from_le_bytes)?;
    cloud.classification = input.values(u8::from_le_bytes)?;
    cloud.flags = input.values(u8::from_le_bytes)?;
    cloud.scan_angle_deg = input.values(f32::from_le_bytes)?;
    let mut bits = 0u64;
    cloud.gps_time = input.values(|bytes| {
        bits = bits.wrapping_add(u64::from_le_bytes(bytes));
        f64::from_bits(bits)
    })?;
    cloud.source_id = input.values(u16::from_le_bytes)?;
    while !input.rest.is_empty() {
        let (name, column) = input.named_column()?;
        cloud.extra.insert(name, column);
    }
    cloud.validate().map_err(|error| error.to_string())?;
    Ok(cloud)
}

/// Encodes sorted voxel counts.
pub(crate) fn encode_voxels(counts: &[(Voxel, u32)]) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(counts.len() * 16 + 4);
    out.extend((counts.len() as u32).to_le_bytes());
    for axis in 0..3 {
        put(&mut out, Deltas { last: 0, values: counts.iter().map(|entry| entry.0[axis]) });
    }
    put(&mut out, counts.iter().map(|entry| entry.1.to_le_bytes()));
    pack(&out)
}

/// Decodes voxel counts.
pub(crate) fn decode_voxels(bytes: &[u8]) -> Result<Vec<(Voxel, u32)>, String> {
    let raw = unpack(bytes)?;
    let mut input = Input::new(&raw)?;
    let (x, y, z) = (input.ticks()?, input.ticks()?, input.ticks()?);
    let counts = input.values(u32::from_le_bytes)?;
    let places = x.into_iter().zip(y).zip(z).map(|((x, y), z)| [x, y, z]);
    Ok(places.zip(counts).collect())
}

/// Differences from value to value, small ones of either sign as small numbers (zigzag).
struct Deltas<I> {
    last: i32,
    values: I,
}

impl<I: Iterator<Item = i32>> Iterator for Deltas<I> {
    type Item = [u8; 4];
    fn next(&mut self) -> Option<[u8; 4]> {
        let value = self.values.next()?;
        let delta = value.wrapping_sub(self.last);
        self.last = value;
        Some(((delta << 1) ^ (delta >> 31)).to_le_bytes())
    }
}

/// Appends values as planes: all first bytes, all second bytes, and so on.
fn put<const N: usize>(out: &mut Vec<u8>, values: impl Iterator<Item = [u8; N]>) {
    let values: Vec<[u8; N]> = values.collect();
    for plane in 0..N {
        out.extend(values.iter().map(|bytes| bytes[plane]));
    }
}

fn put_column(out: &mut Vec<u8>, name: &str, column: &Column) {
    let name = &name.as_bytes()[..name.len().min(usize::from(u16::MAX))];
    out.push(type_code(column));
    out.extend((name.len() as u16).to_le_bytes());
    out.extend(name);
    match column {
        Column::U8(values) => out.extend(values),
        Column::I8(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
        Column::U16(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
        Column::I16(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
        Column::U32(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
        Column::I32(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
        Column::F32(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
        Column::F64(values) => put(out, values.iter().map(|v| v.to_le_bytes())),
    }
}

fn type_code(column: &Column) -> u8 {
    match column {
        Column::U8(_) => 0,
        Column::I8(_) => 1,
        Column::U16(_) => 2,
        Column::I16(_) => 3,
        Column::U32(_) => 4,
        Column::I32(_) => 5,
        Column::F32(_) => 6,
        Column::F64(_) => 7,
    }
}

/// Reads columns of `len` values off the front.
struct Input<'a> {
    rest: &'a [u8],
    len: usize,
}

impl<'a> Input<'a> {
    /// Columns of the length that stands in front of them.
    fn new(raw: &'a [u8]) -> Result<Self, String> {
        let (len, rest) = raw.split_first_chunk::<4>().ok_or("no number of values")?;
        Ok(Self { rest, len: u32::from_le_bytes(*len) as usize })
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        if count > self.rest.len() {
            return Err(format!("{count} bytes expected, {} left", self.rest.len()));
        }
        let (taken, rest) = self.rest.split_at(count);
        self.rest = rest;
        Ok(taken)
    }

    fn column<const N: usize>(&mut self) -> Result<Vec<[u8; N]>, String> {
        let len = self.len;
        let planes = self.take(len.checked_mul(N).ok_or("length overflows")?)?;
        Ok((0..len).map(|i| std::array::from_fn(|plane| planes[plane * len + i])).collect())
    }

    fn values<const N: usize, T>(
        &mut self,
        from: impl FnMut([u8; N]) -> T,
    ) -> Result<Vec<T>, String> {
        Ok(self.column::<N>()?.into_iter().map(from).collect())
    }

    fn ticks(&mut self) -> Result<Vec<i32>, String> {
        let mut last = 0i32;
        self.values(|bytes| {
            let code = u32::from_le_bytes(bytes);
            last = last.wrapping_add(((code >> 1) as i32) ^ -((code & 1) as i32));
            last
        })
    }

    fn named_column(&mut self) -> Result<(String, Column), String> {
        let head = self.take(3)?;
        let (code, len) = (head[0], usize::from(u16::from_le_bytes([head[1], head[2]])));
        let name = String::from_utf8_lossy(self.take(len)?).into_owned();
        let column = match code {
            0 => Column::U8(self.values(u8::from_le_bytes)?),
            1 => Column::I8(self.values(i8::from_le_bytes)?),
            2 => Column::U16(self.values(u16::from_le_bytes)?),
            3 => Column::I16(self.values(i16::from_le_bytes)?),
            4 => Column::U32(self.values(u32::from_le_bytes)?),
            5 => Column::I32(self.values(i32::from_le_bytes)?),
            6 => Column::F32(self.values(f32::from_le_bytes)?),
            7 => Column::F64(self.values(f64::from_le_bytes)?),
            _ => return Err(format!("column type {code} is not known")),
        };
        Ok((name, column))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use timberline_pointcloud::Point;

    fn cloud(points: &[(i32, i32, u16)]) -> PointCloud {
        let mut cloud = PointCloud::new(Frame::new([481_000, -640, 0]));
        for (index, (x, z, value)) in points.iter().enumerate() {
            let local = [f64::from(*x) / 1e4, f64::from(*x) / 2e4, f64::from(*z) / 100.0];
            let world: [f64; 3] = std::array::from_fn(|axis| {
                timberline_pointcloud::frame::quantise(
                    local[axis] + cloud.frame.origin_m[axis] as f64,
                )
            });
            let point = Point {
                intensity: *value,
                gps_time: 2.5e8 + index as f64 * 1e-5,
                scan_angle_deg: f32::from(*value) * 0.006,
                source_id: *value,
                ..Point::default()
            };
            cloud.push_world(world, &point);
        }
        let values: Vec<f64> = points.iter().map(|p| f64::from(p.2) / 3.0).collect();
        cloud.extra.insert("depth".into(), Column::F64(values));
        cloud
    }

    proptest! {
        #[test]
        fn what_goes_in_comes_out(points in prop::collection::vec((0i32..640_000, -99_999i32..999_999, any::<u16>()), 0..50)) {
            let cloud = cloud(&points);
            prop_assert_eq!(&decode(&encode(&cloud, &[]).unwrap(), cloud.frame).unwrap(), &cloud);
        }

        #[test]
        fn voxels_come_back(counts in prop::collection::vec((any::<[i32; 3]>(), any::<u32>()), 0..50)) {
            prop_assert_eq!(decode_voxels(&encode_voxels(&counts).unwrap()).unwrap(), counts);
        }

        #[test]
        fn garbage_is_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let packed = pack(&bytes).unwrap();
            let _ = decode(&packed, Frame::default());
            let _ = decode_voxels(&packed);
            prop_assert!(decode(&bytes, Frame::default()).is_err());
        }
    }

    #[test]
    fn optional_columns_of_zeros_are_left_out() {
        let mut cloud = cloud(&[(1, 1, 0), (2, 2, 1)]);
        cloud.extra.insert("user_data".into(), Column::U8(vec![0, 0]));
        let decoded = decode(&encode(&cloud, &["user_data"]).unwrap(), cloud.frame).unwrap();
        assert!(!decoded.extra.contains_key("user_data"));
    }
}
