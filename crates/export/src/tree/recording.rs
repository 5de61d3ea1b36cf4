//! A tree as MCAP for Foxglove: its points, skeleton and cylinders, in the tree's frame.

use super::Model;
use super::scene::colour;
use crate::Error;
use foxglove::messages::line_primitive::Type as LineType;
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{
    Color, CylinderPrimitive, KeyValuePair, LinePrimitive, PackedElementField, Point3,
    PointCloud as CloudMessage, Pose, Quaternion, SceneEntity, SceneUpdate, Vector3,
};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::io::Cursor;
use timberline_artefact::kinds::{QsmCylinder, Skeleton, TreeCloud};
use timberline_pointcloud::PointCloud;
use timberline_solids::vector::{distance, scale, sub};

/// Points in one message at most.
const POINTS_A_MESSAGE: usize = 1_000_000;
/// Name of the metadata record that says where the tree stands.
pub const RECORD: &str = "timberline.tree";

/// The recording. The points must be in the model's frame.
///
/// # Errors
/// [`Error::Recording`].
pub fn write(model: &Model<'_>, cloud: &PointCloud, skeleton: &Skeleton) -> Result<Vec<u8>, Error> {
    let fail = |error: mcap::McapError| Error::Recording(error.to_string());
    let writer = WriteOptions::new()
        .profile("timberline")
        .library("timberline")
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        .compression_threads(0)
        .create(Cursor::new(Vec::new()))
        .map_err(fail)?;
    let mut recording = Recording { writer, sequence: 0 };
    let frame_id = format!("tree-{}", model.qsm.tree_id);
    let points = recording.channel::<CloudMessage>("/cloud")?;
    for first in (0..cloud.len()).step_by(POINTS_A_MESSAGE) {
        let range = first..cloud.len().min(first + POINTS_A_MESSAGE);
        recording.message(points, &cloud_message(cloud, range, &frame_id))?;
    }
    let lines = recording.channel::<SceneUpdate>("/skeleton")?;
    let entity =
        SceneEntity { lines: vec![line(skeleton)], ..located(model, "skeleton", &frame_id) };
    recording.message(lines, &update(entity))?;
    let solids = recording.channel::<SceneUpdate>("/cylinders")?;
    let cylinders = model.qsm.cylinders.iter().map(cylinder).collect();
    let entity = SceneEntity { cylinders, ..located(model, "cylinders", &frame_id) };
    recording.message(solids, &update(entity))?;
    let mut writer = recording.writer;
    let place = place(model).into_iter().map(|pair| (pair.key, pair.value)).collect();
    let record = Metadata { name: RECORD.to_owned(), metadata: place };
    writer.write_metadata(&record).map_err(fail)?;
    writer.finish().map_err(fail)?;
    Ok(writer.into_inner().into_inner())
}

struct Recording {
    writer: mcap::Writer<Cursor<Vec<u8>>>,
    sequence: u32,
}

impl Recording {
    fn channel<T: foxglove::Encode>(&mut self, topic: &str) -> Result<u16, Error> {
        let fail = |error: mcap::McapError| Error::Recording(error.to_string());
        let schema = T::get_schema().ok_or_else(|| Error::Recording("no schema".to_owned()))?;
        let id =
            self.writer.add_schema(&schema.name, &schema.encoding, &schema.data).map_err(fail)?;
        self.writer.add_channel(id, topic, "protobuf", &BTreeMap::new()).map_err(fail)
    }

    /// All messages have the time 0: a viewer shows them together.
    fn message<T: foxglove::Encode>(&mut self, channel_id: u16, value: &T) -> Result<(), Error> {
        let mut bytes = Vec::new();
        value.encode(&mut bytes).map_err(|error| Error::Recording(format!("{error:?}")))?;
        let sequence = self.sequence;
        self.sequence += 1;
        let header = MessageHeader { channel_id, sequence, log_time: 0, publish_time: 0 };
        self.writer
            .write_to_known_channel(&header, &bytes)
            .map_err(|error| Error::Recording(error.to_string()))
    }
}

fn update(entity: SceneEntity) -> SceneUpdate {
    SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
}

fn located(model: &Model<'_>, id: &str, frame_id: &str) -> SceneEntity {
    SceneEntity {
        frame_id: frame_id.to_owned(),
        id: id.to_owned(),
        metadata: place(model),
        ..SceneEntity::default()
    }
}

/// Where the frame begins in the world.
fn place(model: &Model<'_>) -> Vec<KeyValuePair> {
    let [x, y, z] = model.frame.origin_m;
    [
        ("tree_id", model.qsm.tree_id.to_string()),
        ("offset_m", format!("{x} {y} {z}")),
        ("crs", model.crs.name.clone()),
    ]
    .map(|(key, value)| KeyValuePair { key: key.to_owned(), value })
    .into()
}

fn identity() -> Pose {
    Pose {
        position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
        orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
    }
}

/// Position, intensity and the likelihood of wood.
fn cloud_message(
    cloud: &PointCloud,
    range: std::ops::Range<usize>,
    frame_id: &str,
) -> CloudMessage {
    let field = |name: &str, offset, kind: NumericType| PackedElementField {
        name: name.to_owned(),
        offset,
        r#type: kind as i32,
    };
    let wood = cloud.extra.get(TreeCloud::WOOD);
    let mut data = Vec::with_capacity(range.len() * 18);
    for index in range {
        for value in cloud.local(index) {
            data.extend_from_slice(&(value as f32).to_le_bytes());
        }
        let wood = wood.map_or(f32::NAN, |column| column.value(index) as f32);
        data.extend_from_slice(&wood.to_le_bytes());
        data.extend_from_slice(&cloud.intensity[index].to_le_bytes());
    }
    CloudMessage {
        timestamp: None,
        frame_id: frame_id.to_owned(),
        pose: Some(identity()),
        point_stride: 18,
        fields: vec![
            field("x", 0, NumericType::Float32),
            field("y", 4, NumericType::Float32),
            field("z", 8, NumericType::Float32),
            field(TreeCloud::WOOD, 12, NumericType::Float32),
            field("intensity", 16, NumericType::Uint16),
        ],
        data: data.into(),
    }
}

fn line(skeleton: &Skeleton) -> LinePrimitive {
    let point = |[x, y, z]: [f64; 3]| Point3 { x, y, z };
    let pairs =
        (0u32..).zip(&skeleton.nodes).filter_map(|(place, node)| Some([node.parent?, place]));
    LinePrimitive {
        r#type: LineType::LineList as i32,
        pose: Some(identity()),
        thickness: 2.0,
        scale_invariant: true,
        points: skeleton.nodes.iter().map(|node| point(node.position_m)).collect(),
        color: Some(Color { r: 0.1, g: 0.1, b: 0.1, a: 1.0 }),
        colors: Vec::new(),
        indices: pairs.flatten().collect(),
    }
}

fn cylinder(cylinder: &QsmCylinder) -> CylinderPrimitive {
    let [r, g, b] = colour(cylinder.source).map(|value| f64::from(value) / 255.0);
    let middle = scale(sub(cylinder.end_m, cylinder.start_m), 0.5);
    let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| cylinder.start_m[axis] + middle[axis]);
    let length_m = distance(cylinder.start_m, cylinder.end_m);
    let width_m = 2.0 * cylinder.radius_m;
    CylinderPrimitive {
        pose: Some(Pose {
            position: Some(Vector3 { x, y, z }),
            orientation: Some(upright_to(sub(cylinder.end_m, cylinder.start_m))),
        }),
        size: Some(Vector3 { x: width_m, y: width_m, z: length_m }),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(Color { r, g, b, a: 1.0 }),
    }
}

/// The shortest turn from upwards to a direction.
fn upright_to(direction: [f64; 3]) -> Quaternion {
    let length = timberline_solids::vector::norm(direction);
    if length <= 0.0 {
        return Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
    }
    let [x, y, z] = direction.map(|value| value / length);
    let w = ((1.0 + z) / 2.0).max(0.0).sqrt();
    // Straight down: half a turn about any horizontal axis.
    if w < 1e-9 {
        return Quaternion { x: 1.0, y: 0.0, z: 0.0, w: 0.0 };
    }
    Quaternion { x: -y / (2.0 * w), y: x / (2.0 * w), z: 0.0, w }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upwards_is_turned_to_the_axis() {
        for direction in
            [[0.0, 0.0, 2.0], [1.0, 0.0, 0.0], [0.3, -0.5, 0.2], [0.1, 0.2, -3.0], [0.0, 0.0, -1.0]]
        {
            let Quaternion { x, y, z, w } = upright_to(direction);
            assert!((x * x + y * y + z * z + w * w - 1.0).abs() < 1e-9);
            // The third column of the rotation matrix.
            let up = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)];
            let length = timberline_solids::vector::norm(direction);
            for (found, expected) in up.into_iter().zip(direction) {
                assert!((found - expected / length).abs() < 1e-9, "{direction:?}: {up:?}");
            }
        }
    }
}
