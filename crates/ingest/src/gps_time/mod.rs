//! GPS times of LAZ files, decoded step by step.
//!
//! LASzip (Isenburg 2013) codes a time against one of four sequences; a symbol may switch to another
//! of them, after which the next symbol counts. The `laz` crate follows a switch by calling itself, so
//! that damaged data that switches a hundred thousand times overflows the stack and ends the process.
//! Here it is a loop; everything else is left to `laz`.

mod item;
mod layer;
mod sequences;

pub(crate) use item::GpsTimes;
pub(crate) use layer::Point14;

#[cfg(test)]
mod tests;
