//! Tree ids that are the same wherever a tree is seen.

/// Bits of the id that hold the northing.
const NORTHING_BITS: u32 = 27;
/// Bits of the id that hold the easting.
const EASTING_BITS: u32 = 26;

/// The id of the tree with its apex (or stem base) at a world position.
///
/// The position is rounded down to 0.1 m; easting and northing fill 26 and 27 bits, so an id is
/// below 2^53 (exact as a double, in JSON and in JavaScript), unique within 6,700 x 13,400 km, and
/// never 0 for positions with positive coordinates. Apexes closer than 0.1 m do not occur: no two
/// local maxima fit into one window.
#[must_use]
pub fn tree_id(world_x_m: f64, world_y_m: f64) -> u64 {
    let place = |value: f64, bits: u32| ((value * 10.0).floor() as i64 as u64) & ((1 << bits) - 1);
    (place(world_x_m, EASTING_BITS) << NORTHING_BITS) | place(world_y_m, NORTHING_BITS)
}

/// A seed from words that identify something in the world (a stage and a tree id, say): never from
/// time, order or the tile, so that draws do not depend on how a campaign is cut.
#[must_use]
pub fn seed(words: &[&str]) -> u64 {
    let mut hasher = blake3::Hasher::new();
    for word in words {
        hasher.update(&(word.len() as u64).to_le_bytes());
        hasher.update(word.as_bytes());
    }
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
    u64::from_le_bytes(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_exact_doubles_and_differ() {
        let a = tree_id(559_999.99, 5_123_456.7);
        assert!(a < 1 << 53);
        assert_ne!(a, tree_id(560_000.0, 5_123_456.7));
        assert_eq!(a, tree_id(559_999.91, 5_123_456.75));
    }

    #[test]
    fn words_are_not_run_together() {
        assert_ne!(seed(&["ab", "c"]), seed(&["a", "bc"]));
    }
}
