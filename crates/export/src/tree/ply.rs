//! Meshes as PLY (Turk 1994), binary, little endian.

use super::scene::{BranchMesh, colour};
use timberline_solids::Mesh;

/// How positions are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// `float`: for meshes of one tree in its own frame.
    Single,
    /// `double`: for meshes of a whole plot.
    Double,
}

/// A mesh with a colour for every vertex, where there are colours. `notes` become comment lines: line
/// ends in them become spaces.
#[must_use]
pub fn write(mesh: &Mesh, colours: &[[u8; 3]], precision: Precision, notes: &[String]) -> Vec<u8> {
    let coloured = !colours.is_empty();
    let mut out = header(mesh, coloured, precision, notes).into_bytes();
    for (place, vertex) in mesh.vertices_m.iter().enumerate() {
        for value in vertex {
            match precision {
                Precision::Single => out.extend_from_slice(&(*value as f32).to_le_bytes()),
                Precision::Double => out.extend_from_slice(&value.to_le_bytes()),
            }
        }
        if coloured {
            out.extend_from_slice(&colours.get(place).copied().unwrap_or_default());
        }
    }
    for corners in &mesh.triangles {
        out.push(3);
        corners.iter().for_each(|corner| out.extend_from_slice(&corner.to_le_bytes()));
    }
    out
}

fn header(mesh: &Mesh, coloured: bool, precision: Precision, notes: &[String]) -> String {
    let mut text = "ply\nformat binary_little_endian 1.0\n".to_owned();
    for note in notes {
        text += &format!("comment {}\n", note.replace(['\n', '\r'], " "));
    }
    text += &format!("element vertex {}\n", mesh.vertices_m.len());
    let real = if precision == Precision::Single { "float" } else { "double" };
    for axis in ["x", "y", "z"] {
        text += &format!("property {real} {axis}\n");
    }
    if coloured {
        text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    }
    text += &format!("element face {}\n", mesh.triangles.len());
    text + "property list uchar uint vertex_indices\nend_header\n"
}

/// All branches in one mesh, with the colour of every vertex.
#[must_use]
pub fn merged(branches: &[BranchMesh]) -> (Mesh, Vec<[u8; 3]>) {
    let (mut mesh, mut colours) = (Mesh::default(), Vec::new());
    for branch in branches {
        mesh.append(&branch.mesh);
        colours.extend(branch.source.iter().copied().map(colour));
    }
    (mesh, colours)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_by_hand() {
        let mesh = Mesh {
            vertices_m: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.5, 0.0]],
            triangles: vec![[0, 1, 2]],
        };
        let notes = ["offset_m 1 2 3\nend_header".to_owned()];
        let bytes = write(&mesh, &[[1, 2, 3]; 3], Precision::Single, &notes);
        let end = bytes.windows(12).position(|w| w == b"\nend_header\n").unwrap() + 12;
        let text = std::str::from_utf8(&bytes[..end]).unwrap();
        assert!(text.contains("comment offset_m 1 2 3 end_header\n"));
        assert_eq!(bytes.len() - end, 3 * (12 + 3) + 13);
        assert_eq!(bytes[end + 30 + 4..end + 30 + 8], 1.5f32.to_le_bytes());
        assert_eq!(bytes[bytes.len() - 13..], [3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]);
        let double = write(&mesh, &[], Precision::Double, &[]);
        let head = double.windows(12).position(|w| w == b"\nend_header\n").unwrap() + 12;
        assert_eq!(double.len() - head, 3 * 24 + 13);
    }
}
