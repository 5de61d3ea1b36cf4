//! The best threshold to cut a graph in two.

use super::Graph;

/// A graph in two.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    /// Normalised cut: the weights between the sides over those of each side to all, summed; 0 to 2
    /// (Shi and Malik 2000, eq. 2).
    pub ncut: f64,
    /// Which vertices are on the first side.
    pub first: Vec<bool>,
}

/// What a side must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Need<'a> {
    /// Fewest vertices.
    pub vertices: usize,
    /// Number of tops in every vertex.
    pub tops: &'a [u32],
    /// Fewest tops.
    pub least_tops: u32,
}

/// The cut with the least normalised cut among those that a threshold makes, every threshold that
/// leaves both sides what they need; of equal ones the lowest.
#[must_use]
pub fn best(graph: &Graph, values: &[f64], need: &Need<'_>) -> Option<Cut> {
    let degrees = graph.degrees();
    let total: f64 = degrees.iter().sum();
    let all_tops: u32 = need.tops.iter().sum();
    let mut order: Vec<u32> = (0..graph.len() as u32).collect();
    order.sort_unstable_by(|a, b| {
        values[*a as usize].total_cmp(&values[*b as usize]).then(a.cmp(b))
    });
    let mut first = vec![false; graph.len()];
    let (mut between, mut inside, mut tops) = (0.0, 0.0, 0);
    let mut best: Option<(f64, usize)> = None;
    for (place, &vertex) in order.iter().enumerate() {
        let vertex = vertex as usize;
        for (end, weight) in graph.edges(vertex).filter(|(end, _)| *end != vertex) {
            between += if first[end] { -weight } else { weight };
        }
        first[vertex] = true;
        inside += degrees[vertex];
        tops += need.tops[vertex];
        let count = place + 1;
        let enough = count >= need.vertices && graph.len() - count >= need.vertices.max(1);
        let topped = tops >= need.least_tops && all_tops - tops >= need.least_tops;
        let ncut = between / inside + between / (total - inside);
        if enough && topped && best.is_none_or(|(least, _)| ncut < least) {
            best = Some((ncut, count));
        }
    }
    let (ncut, count) = best?;
    order[count..].iter().for_each(|vertex| first[*vertex as usize] = false);
    Some(Cut { ncut, first })
}

#[cfg(test)]
mod tests {
    use super::super::eigen::second;
    use super::*;

    /// Two cliques of six with one weak edge between vertex 5 and 6.
    fn barbell(weak: f32) -> Graph {
        let row = |i: u32| {
            let edge = |j: u32| match (i / 6 == j / 6, i + j == 11 && i.abs_diff(j) == 1) {
                (true, _) => Some((j, 1.0)),
                (false, true) => Some((j, weak)),
                _ => None,
            };
            (0..12).filter_map(edge).collect()
        };
        Graph::from_rows((0..12).map(row))
    }

    #[test]
    fn cliques_come_apart_at_the_weak_edge() {
        let graph = barbell(0.1);
        let start: Vec<f64> = (0..12).map(|i| f64::from(i * 7 % 5)).collect();
        let vector = second(&graph, &start, 1e-9, 12).unwrap().vector;
        let need = Need { vertices: 1, tops: &[0; 12], least_tops: 0 };
        let cut = best(&graph, &vector, &need).unwrap();
        assert!((0..12).all(|i| cut.first[i] == (cut.first[0] == (i < 6))), "{cut:?}");
        let side = 36.0 + 0.1;
        assert!((cut.ncut - 2.0 * 0.1 / side).abs() < 1e-6, "{}", cut.ncut);
    }

    #[test]
    fn sides_have_what_they_need() {
        let graph = barbell(0.1);
        let values: Vec<f64> = (0..12).map(f64::from).collect();
        let mut tops = [0; 12];
        (tops[0], tops[2]) = (1, 1);
        let need = Need { vertices: 1, tops: &tops, least_tops: 1 };
        let cut = best(&graph, &values, &need).unwrap();
        assert!(cut.first[0] && !cut.first[2]);
        assert_eq!(best(&graph, &values, &Need { vertices: 7, ..need }), None);
        assert_eq!(best(&graph, &values, &Need { least_tops: 2, ..need }), None);
    }
}
