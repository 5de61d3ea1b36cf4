//! Any bytes as a PCD file.
#![no_main]

mod clouds;

use libfuzzer_sys::fuzz_target;

fuzz_target!(
    init: { clouds::write_seeds("pcd_reader", &seeds()) },
    |bytes: &[u8]| clouds::run(bytes)
);

fn header(data: &str) -> Vec<u8> {
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb _ n\nSIZE 4 4 8 4 1 2\nTYPE F F F U U I\nCOUNT 1 1 1 1 2 2\n\
         WIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA {data}\n"
    )
    .into_bytes()
}

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    // 78 bytes: 32 literal, then copies of 9 + 15 and 9 + 13 bytes.
    let mut packed = vec![31];
    packed.extend([3; 32]);
    packed.extend([7 << 5, 15, 3, 7 << 5, 11, 7]);
    let sizes = [(packed.len() as u32).to_le_bytes(), 78u32.to_le_bytes()].concat();
    vec![
        ("ascii", [header("ascii"), b"1 2 3 255 0 0 5 6\n".repeat(3)].concat()),
        ("binary", [header("binary"), vec![1; 78]].concat()),
        ("compressed", [header("binary_compressed"), sizes, packed].concat()),
    ]
}
