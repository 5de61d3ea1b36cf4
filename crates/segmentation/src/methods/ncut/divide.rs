//! Cutting again and again.

use super::cut::{self, Need};
use super::{Graph, NcutParams, eigen};

/// What is to be cut.
#[derive(Debug)]
pub(super) struct Whole<'a> {
    pub(super) graph: &'a Graph,
    /// Number of tops in every vertex.
    pub(super) tops: &'a [u32],
    /// Start vector of the search.
    pub(super) start: &'a [f64],
    /// Whether the tops are all trees there are.
    pub(super) given: bool,
    pub(super) params: &'a NcutParams,
}

/// Residual from which on the eigenvector is good enough to cut at.
const TOLERANCE: f64 = 1e-3;
/// Most steps of the search. In a large piece many eigenvalues are close to 0, and any mixture of
/// their vectors cuts it well: it need not converge there.
const MOST_STEPS: usize = 64;

impl Whole<'_> {
    /// The parts that are not cut any more, each ascending.
    pub(super) fn parts(&self) -> Vec<Vec<u32>> {
        let mut open = self.graph.components();
        let mut parts = Vec::new();
        while let Some(members) = open.pop() {
            let graph = self.graph.part(&members);
            match self.cut(&graph, &members) {
                Some(first) => open.extend(sides(&graph, &members, &first)),
                None => parts.push(members),
            }
        }
        parts
    }

    /// Which vertices of a part to cut off, unless it stays as it is: because it is small, because
    /// the best cut is worse than the static threshold, or because of its tops.
    fn cut(&self, graph: &Graph, members: &[u32]) -> Option<Vec<bool>> {
        let tops: Vec<u32> = members.iter().map(|member| self.tops[*member as usize]).collect();
        let forced = self.given && tops.iter().filter(|tops| **tops > 0).count() > 1;
        let pointless = self.given && tops.iter().all(|tops| *tops == 0);
        let fewest = if forced { 1 } else { self.params.min_voxels };
        if pointless || members.len() < 2 * fewest {
            return None;
        }
        let start: Vec<f64> = members.iter().map(|member| self.start[*member as usize]).collect();
        let found = eigen::second(graph, &start, TOLERANCE, MOST_STEPS)?;
        // A normalised cut is never less than the eigenvalue (Shi and Malik 2000, section 2.1).
        if !forced && found.value - found.residual > self.params.most_ncut {
            return None;
        }
        let need = Need { vertices: fewest, tops: &tops, least_tops: u32::from(forced) };
        let cut = cut::best(graph, &found.vector, &need)?;
        (forced || cut.ncut < self.params.most_ncut).then_some(cut.first)
    }
}

/// The connected parts of both sides.
fn sides(graph: &Graph, members: &[u32], first: &[bool]) -> Vec<Vec<u32>> {
    let mut found = Vec::new();
    for side in [true, false] {
        let inside: Vec<u32> =
            (0..graph.len() as u32).filter(|v| first[*v as usize] == side).collect();
        for component in graph.part(&inside).components() {
            let member = |v: u32| members[inside[v as usize] as usize];
            found.push(component.into_iter().map(member).collect());
        }
    }
    found
}
