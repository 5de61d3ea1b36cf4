//! Meshes as binary glTF 2.0 (Khronos Group, section 4.4).
//!
//! glTF has y upwards and x to the east: (x, y, z) goes out as (x, z, -y). The world's origin of the frame
//! stands in the `extras` of the scene; positions are `f32` in the frame of their node.

use super::scene::{BranchMesh, colour};
use serde_json::{Value, json};
use timberline_solids::Mesh;
use timberline_solids::vector::{add, cross, sub, unit};

/// One tree in a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Name of its node.
    pub name: String,
    /// Where its frame begins in the frame of the scene, m.
    pub offset_m: [f64; 3],
    /// The surface.
    pub mesh: Mesh,
    /// The colour of every vertex.
    pub colours: Vec<[u8; 3]>,
    /// What else is known about it.
    pub extras: Value,
}

impl Part {
    /// The branches of a tree as one part.
    #[must_use]
    pub fn of(name: String, offset_m: [f64; 3], branches: &[BranchMesh], extras: Value) -> Self {
        let (mut mesh, mut colours) = (Mesh::default(), Vec::new());
        for branch in branches {
            mesh.append(&branch.mesh);
            colours.extend(branch.source.iter().copied().map(colour));
        }
        Self { name, offset_m, mesh, colours, extras }
    }
}

const MAGIC: u32 = 0x4654_6C67;
const CHUNK_JSON: u32 = 0x4E4F_534A;
const CHUNK_BINARY: u32 = 0x004E_4942;
const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The scene as one file; parts without triangles are left out. `extras` stand at the scene.
#[must_use]
pub fn write(parts: &[Part], extras: &Value) -> Vec<u8> {
    let mut file = File::default();
    for part in parts.iter().filter(|part| !part.mesh.triangles.is_empty()) {
        file.add(part);
    }
    let roots: Vec<usize> = (0..file.nodes.len()).collect();
    let mut root = json!({
        "asset": { "version": "2.0", "generator": concat!("Timberline ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "extras": extras }],
    });
    if !roots.is_empty() {
        root["scenes"][0]["nodes"] = json!(roots);
        root["nodes"] = json!(file.nodes);
        root["meshes"] = json!(file.meshes);
        root["materials"] = json!([{
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 }
        }]);
        root["accessors"] = json!(file.accessors);
        root["bufferViews"] = json!(file.views);
        root["buffers"] = json!([{ "byteLength": file.bytes.len() }]);
    }
    container(root.to_string().into_bytes(), file.bytes)
}

/// The header and the two chunks, each filled up to a multiple of four bytes.
fn container(mut text: Vec<u8>, bytes: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut chunks = vec![(CHUNK_JSON, text)];
    if !bytes.is_empty() {
        chunks.push((CHUNK_BINARY, bytes));
    }
    let length: usize = 12 + chunks.iter().map(|(_, data)| 8 + data.len()).sum::<usize>();
    let mut out = Vec::with_capacity(length);
    [MAGIC, 2, length as u32].iter().for_each(|word| out.extend_from_slice(&word.to_le_bytes()));
    for (kind, data) in chunks {
        out.extend_from_slice(&(data.len() as u32).to_le_bytes());
        out.extend_from_slice(&kind.to_le_bytes());
        out.extend_from_slice(&data);
    }
    out
}

/// The parts of a file as they grow.
#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl File {
    fn add(&mut self, part: &Part) {
        let positions: Vec<[f32; 3]> = part.mesh.vertices_m.iter().map(|v| upwards(*v)).collect();
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for position in &positions {
            low = std::array::from_fn(|axis| low[axis].min(position[axis]));
            high = std::array::from_fn(|axis| high[axis].max(position[axis]));
        }
        let position = self.floats(&positions);
        self.accessors[position]["min"] = json!(low);
        self.accessors[position]["max"] = json!(high);
        let normal = self.floats(&normals(&part.mesh));
        let colour = self.colours(part);
        let indices = self.indices(&part.mesh);
        self.nodes.push(json!({
            "name": part.name,
            "mesh": self.meshes.len(),
            "translation": upwards(part.offset_m),
            "extras": part.extras,
        }));
        self.meshes.push(json!({ "name": part.name, "primitives": [{
            "attributes": { "POSITION": position, "NORMAL": normal, "COLOR_0": colour },
            "indices": indices,
            "material": 0,
        }]}));
    }

    /// Adds an accessor over bytes that are there from `start` on; returns its number.
    fn accessor(&mut self, start: usize, target: u32, of: (u32, &str, usize)) -> usize {
        let (component, shape, count) = of;
        self.views.push(json!({
            "buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start,
            "target": target,
        }));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "type": shape,
            "count": count,
        }));
        self.accessors.len() - 1
    }

    fn floats(&mut self, values: &[[f32; 3]]) -> usize {
        let start = self.bytes.len();
        values.iter().flatten().for_each(|v| self.bytes.extend_from_slice(&v.to_le_bytes()));
        self.accessor(start, ARRAY_BUFFER, (FLOAT, "VEC3", values.len()))
    }

    fn colours(&mut self, part: &Part) -> usize {
        let (start, count) = (self.bytes.len(), part.mesh.vertices_m.len());
        for place in 0..count {
            let [r, g, b] = part.colours.get(place).copied().unwrap_or([200; 3]).map(linear);
            self.bytes.extend_from_slice(&[r, g, b, 255]);
        }
        let number = self.accessor(start, ARRAY_BUFFER, (UNSIGNED_BYTE, "VEC4", count));
        self.accessors[number]["normalized"] = json!(true);
        number
    }

    fn indices(&mut self, mesh: &Mesh) -> usize {
        let start = self.bytes.len();
        mesh.triangles
            .iter()
            .flatten()
            .for_each(|corner| self.bytes.extend_from_slice(&corner.to_le_bytes()));
        let of = (UNSIGNED_INT, "SCALAR", mesh.triangles.len() * 3);
        self.accessor(start, ELEMENT_ARRAY_BUFFER, of)
    }
}

/// From z upwards to y upwards.
fn upwards([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, z as f32, -y as f32]
}

/// Colours of vertices are linear in glTF (section 3.9.2), those of the palette are sRGB (IEC 61966-2-1).
fn linear(value: u8) -> u8 {
    let share = f64::from(value) / 255.0;
    let linear =
        if share <= 0.04045 { share / 12.92 } else { libm::pow((share + 0.055) / 1.055, 2.4) };
    (linear * 255.0).round() as u8
}

/// Normals of the vertices: means of those of the triangles around, weighted by area.
fn normals(mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0; 3]; mesh.vertices_m.len()];
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| mesh.vertices_m[corner as usize]);
        let weighted = cross(sub(b, a), sub(c, a));
        corners.iter().for_each(|c| sums[*c as usize] = add(sums[*c as usize], weighted));
    }
    sums.into_iter().map(|sum| upwards(unit(sum).unwrap_or([0.0, 0.0, 1.0]))).collect()
}
