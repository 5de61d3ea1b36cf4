//! A model as a source file.

use crate::{Fitted, Node};
use std::fmt::Write;

/// The source of a static `MODEL`, headed by `about`.
#[must_use]
pub fn source(fitted: &Fitted, about: &str) -> String {
    let mut text = String::new();
    for line in about.lines() {
        let _ = writeln!(text, "//! {line}");
    }
    let model = fitted.model();
    let _ = write!(
        text,
        "\nuse timberline_boosting::{{Model, Node}};\n\n\
         pub(crate) static MODEL: Model<'static> =\n    \
         Model {{ constant: {:?}, roots: &ROOTS, nodes: &NODES, leaves: &LEAVES }};\n",
        model.constant
    );
    let node = |Node(value, threshold, below, above): &Node| {
        format!("Node({value}, {threshold:?}, {below}, {above})")
    };
    array(&mut text, "ROOTS", "i16", 20, model.roots.iter().map(i16::to_string));
    array(&mut text, "NODES", "Node", 5, model.nodes.iter().map(node));
    array(&mut text, "LEAVES", "f32", 12, model.leaves.iter().map(|leaf| format!("{leaf:?}")));
    text
}

/// A constant array, so many entries a line.
fn array(
    text: &mut String,
    name: &str,
    of: &str,
    per_line: usize,
    entries: impl Iterator<Item = String>,
) {
    let entries: Vec<String> = entries.collect();
    let _ = writeln!(
        text,
        "\n#[rustfmt::skip]\n\
         #[allow(clippy::approx_constant, reason = \"any of so many numbers may come near one\")]\n\
         static {name}: [{of}; {}] = [",
        entries.len()
    );
    for line in entries.chunks(per_line) {
        let _ = writeln!(text, "    {},", line.join(", "));
    }
    text.push_str("];\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Params, Sample, fit};

    #[test]
    fn the_source_holds_the_model() {
        let sample = |i: i32| Sample {
            values: [f64::from(i % 100), 1.0],
            is_right: i % 100 >= 40,
            weight: 1.0,
        };
        let samples: Vec<Sample<2>> = (0..1000).map(sample).collect();
        let fitted = fit(&samples, &Params { trees: 2, leaves: 2, ..Params::default() });
        let text = source(&fitted, "About.\nMore.");
        assert!(text.starts_with("//! About.\n//! More.\n\nuse "), "{text}");
        assert!(text.contains("static ROOTS: [i16; 2] = [\n    0, 1,\n];"), "{text}");
        assert!(text.contains("    Node(0, 39.0, -1, -2), Node(0, 39.0, -3, -4),\n"), "{text}");
    }
}
