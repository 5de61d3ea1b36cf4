//! Any bytes as a PLY file.
#![no_main]

mod clouds;

use libfuzzer_sys::fuzz_target;

fuzz_target!(
    init: { clouds::write_seeds("ply_reader", &seeds()) },
    |bytes: &[u8]| clouds::run(bytes)
);

fn header(encoding: &str, list: &str) -> Vec<u8> {
    format!(
        "ply\nformat {encoding} 1.0\ncomment c\nelement camera 1\nproperty uchar a\nelement vertex 3\n\
         property float x\nproperty float y\nproperty double z\nproperty uchar red\nproperty float intensity\n\
         {list}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes()
}

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let list = "property list uchar short l\n";
    let ascii = b"7\n1 2 3 4 0.5\n1 2 3 4 0.5\n1 2 3 4 0.5\n3 0 1 2\n".to_vec();
    let lists = b"7\n1 2 3 4 0.5 0\n1 2 3 4 0.5 2 8 9\n1 2 3 4 0.5 1 7\n3 0 1 2\n".to_vec();
    let binary = vec![1; 1 + 3 * 21 + 13];
    let binary_lists = vec![1; 1 + 3 * 24 + 13];
    vec![
        ("ascii", [header("ascii", ""), ascii].concat()),
        ("ascii-lists", [header("ascii", list), lists].concat()),
        ("little", [header("binary_little_endian", ""), binary.clone()].concat()),
        ("big", [header("binary_big_endian", ""), binary].concat()),
        ("little-lists", [header("binary_little_endian", list), binary_lists].concat()),
    ]
}
