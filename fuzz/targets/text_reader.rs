//! Any bytes as a text file of points.
#![no_main]

mod clouds;

use libfuzzer_sys::fuzz_target;

fuzz_target!(
    init: { clouds::write_seeds("text_reader", &seeds()) },
    |bytes: &[u8]| clouds::run(bytes)
);

fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let texts = [
        ("xyz", "1.5 2 3\n-4 5e2 6\n"),
        ("csv", "x,y,z,intensity,class\n1,2,3,4,5\n6,7,8,9,2\n"),
        ("semicolon", "id;X;Y;Z;Art\n1;1,5;2,5;3;Oak\n2;1,5;2,5;4;Fir\n"),
        ("pts", "2\n0 0 0 -2048 1 2 3\n1 1 1 2047 4 5 6\n1\n2 2 2 0 0 0 0\n"),
        ("tabs", "//X\tY\tZ\tR\tG\tB\n1\t2\t3\t4\t5\t6\n1\t2\t3\t\t5\t6\n"),
        ("lone-returns", "1 2 3\r4 5 6\r"),
        ("nan", "# x y z gps_time\nnan 1 2 inf\n1 2 3 -1e400\n"),
    ];
    texts.into_iter().map(|(name, text)| (name, text.as_bytes().to_vec())).collect()
}
