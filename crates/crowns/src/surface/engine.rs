//! Who solves the convex programs.

use super::program::{Optimum, Program};
use super::{clarabel, interior, vertex};
use crate::Error;

/// Who solves the convex programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Engine {
    /// Vertex descent for linear programs, an interior point method of few unknowns for the others;
    /// where rounding stops that short of the promised gap (some pieces of the search in a prior box,
    /// nothing else so far), Clarabel takes the program over.
    #[default]
    Dedicated,
    /// The general cone solver Clarabel, as a reference: slower by one to two orders of magnitude.
    Clarabel,
}

impl Engine {
    pub(super) fn solve<const K: usize>(self, program: &Program<K>) -> Result<Optimum<K>, Error> {
        if self == Self::Clarabel {
            return clarabel::solve(program);
        }
        if program.is_linear()
            && let Some(optimum) = vertex::solve(program)
        {
            return Ok(optimum);
        }
        // Rounding can stop a solver of few unknowns where a general one still gets through.
        interior::solve(program).or_else(|_| clarabel::solve(program))
    }

    /// A bound and the surface near it, without the last digits of the surface.
    pub(super) fn relax<const K: usize>(self, program: &Program<K>) -> Result<Optimum<K>, Error> {
        match self {
            Self::Clarabel => clarabel::solve(program),
            Self::Dedicated => interior::relax(program).or_else(|_| clarabel::solve(program)),
        }
    }
}
