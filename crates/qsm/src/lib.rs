//! x
pub mod fit;
#[cfg(test)]
mod testing;
