//! Interior point.
use super::program::{Optimum, Program};
use crate::Error;

pub(super) fn solve<const K: usize>(program: &Program<K>) -> Result<Optimum<K>, Error> {
    super::clarabel::solve(program)
}
