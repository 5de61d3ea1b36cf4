//! Meshes as Wavefront OBJ (specification 3.0), a group for each order of branches.

use super::scene::{BranchMesh, colour};
use std::fmt::Write as _;

/// The branches, grouped by order: `order_0` is the stem. A vertex carries its colour after its
/// position, from 0 to 1, as most programs read it. `notes` become comment lines.
#[must_use]
pub fn write(branches: &[BranchMesh], notes: &[String]) -> String {
    let mut text = String::new();
    for note in notes {
        line(&mut text, format_args!("# {}", note.replace(['\n', '\r'], " ")));
    }
    let mut firsts = Vec::with_capacity(branches.len());
    let mut next = 1;
    for branch in branches {
        firsts.push(next);
        next += branch.mesh.vertices_m.len();
        for ([x, y, z], source) in branch.mesh.vertices_m.iter().zip(&branch.source) {
            let [r, g, b] = colour(*source).map(|value| f64::from(value) / 255.0);
            line(&mut text, format_args!("v {x:.5} {y:.5} {z:.5} {r:.3} {g:.3} {b:.3}"));
        }
    }
    let mut orders: Vec<u16> = branches.iter().map(|branch| branch.order).collect();
    orders.sort_unstable();
    orders.dedup();
    for order in orders {
        line(&mut text, format_args!("g order_{order}"));
        for (branch, first) in branches.iter().zip(&firsts).filter(|(b, _)| b.order == order) {
            for corners in &branch.mesh.triangles {
                let [a, b, c] = corners.map(|corner| corner as usize + first);
                line(&mut text, format_args!("f {a} {b} {c}"));
            }
        }
    }
    text
}

fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    // Writing into a string cannot fail.
    text.write_fmt(arguments).unwrap_or_default();
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_artefact::kinds::RadiusSource;
    use timberline_solids::Mesh;

    #[test]
    fn groups_name_vertices_from_one() {
        let triangle = |order| BranchMesh {
            order,
            mesh: Mesh {
                vertices_m: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.25]],
                triangles: vec![[0, 1, 2]],
            },
            source: vec![RadiusSource::Measured; 3],
        };
        let text = write(&[triangle(1), triangle(0)], &["two\nlines".to_owned()]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "# two lines");
        assert_eq!(lines[3], "v 0.00000 1.00000 0.25000 0.000 0.620 0.451");
        assert_eq!(lines[7..], ["g order_0", "f 4 5 6", "g order_1", "f 1 2 3"]);
    }
}
