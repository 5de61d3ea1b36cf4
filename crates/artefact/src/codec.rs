//! The one file that names bincode, so that a successor can take its place behind the kind versions.
//!
//! Fixed-size little-endian integers: faster than variable ones and the same size for columns.

use serde::{Serialize, de::DeserializeOwned};

/// Decoding allocates at most this many times the payload's own size, whatever lengths the bytes claim.
const EXPANSION: usize = 8;

/// Bytes of a value.
///
/// # Errors
/// bincode's message when the value cannot be written (it always can, for the kinds here).
pub fn encode<T: Serialize>(value: &T) -> Result<Vec<u8>, String> {
    let config = bincode::config::standard().with_fixed_int_encoding();
    bincode::serde::encode_to_vec(value, config).map_err(|error| error.to_string())
}

/// A value from all of the bytes.
///
/// # Errors
/// What does not fit: an impossible value, a claimed length beyond the limit, bytes left over.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let (value, used) = decode_limited(bytes)?;
    if used == bytes.len() {
        Ok(value)
    } else {
        Err(format!("{} bytes left over after {used}", bytes.len() - used))
    }
}

/// bincode wants its limit as a constant: the smallest sufficient step of a ladder is taken.
fn decode_limited<T: DeserializeOwned>(bytes: &[u8]) -> Result<(T, usize), String> {
    macro_rules! ladder {
        ($($limit:literal),*) => {
            $(if bytes.len().saturating_mul(EXPANSION) <= $limit {
                let config = bincode::config::standard()
                    .with_fixed_int_encoding()
                    .with_limit::<$limit>();
                return bincode::serde::decode_from_slice(bytes, config)
                    .map_err(|error| error.to_string());
            })*
        };
    }
    ladder!(0x1_0000, 0x10_0000, 0x100_0000, 0x1000_0000, 0x1_0000_0000, 0x100_0000_0000);
    Err(format!("payload of {} bytes is beyond what one artefact may hold", bytes.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claimed_length_beyond_the_bytes_is_refused_without_allocating() {
        let mut bytes = encode(&vec![1u64, 2, 3]).unwrap();
        bytes[..8].copy_from_slice(&(u64::MAX / 16).to_le_bytes());
        assert!(decode::<Vec<u64>>(&bytes).is_err());
    }

    #[test]
    fn left_over_bytes_are_an_error() {
        let mut bytes = encode(&7u32).unwrap();
        bytes.push(0);
        assert!(decode::<u32>(&bytes).unwrap_err().contains("left over"));
    }
}
