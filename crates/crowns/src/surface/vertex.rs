//! Vertex descent for linear programs.

use super::program::{Optimum, Program};
/// Placeholder until the engine is in.
pub(super) fn solve<const K: usize>(_program: &Program<K>) -> Option<Optimum<K>> {
    None
}
