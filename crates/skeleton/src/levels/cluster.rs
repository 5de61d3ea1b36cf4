//! Points parted where gaps are.

use crate::vector::{Vector, squared};

/// Up to so many points all pairs are compared.
const PAIRS: usize = 48;

/// Parts points into groups with gaps of more than `gap_m` between them (single linkage), in the order
/// of their first members.
pub(crate) fn clusters(points: &[Vector], members: Vec<u32>, gap_m: f64) -> Vec<Vec<u32>> {
    if members.len() < 2 || gap_m == f64::INFINITY {
        return if members.is_empty() { Vec::new() } else { vec![members] };
    }
    let group = if members.len() <= PAIRS {
        by_pairs(points, &members, gap_m)
    } else {
        by_cells(points, &members, gap_m)
    };
    let mut place = vec![usize::MAX; members.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for (member, root) in members.iter().zip(group) {
        if place[root] == usize::MAX {
            place[root] = groups.len();
            groups.push(Vec::new());
        }
        groups[place[root]].push(*member);
    }
    groups
}

/// The smallest place among the members of each one's group.
fn by_pairs(points: &[Vector], members: &[u32], gap_m: f64) -> Vec<usize> {
    let mut roots: Vec<usize> = (0..members.len()).collect();
    for a in 0..members.len() {
        for b in 0..a {
            let [p, q] = [a, b].map(|i| points[members[i] as usize]);
            if squared(p, q) <= gap_m * gap_m {
                join(&mut roots, a, b);
            }
        }
    }
    (0..members.len()).map(|i| root(&mut roots, i)).collect()
}

/// As [`by_pairs`], with cells so small that all points of one are near each other: points of two
/// cells are compared only until the cells are joined.
fn by_cells(points: &[Vector], members: &[u32], gap_m: f64) -> Vec<usize> {
    let edge = 0.5 * gap_m;
    let cell = |member: u32| points[member as usize].map(|value| (value / edge).floor() as i64);
    let mut sorted: Vec<([i64; 3], usize)> =
        members.iter().enumerate().map(|(place, &member)| (cell(member), place)).collect();
    sorted.sort_unstable();
    let mut roots: Vec<usize> = (0..members.len()).collect();
    for pair in sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        join(&mut roots, pair[0].1, pair[1].1);
    }
    let cells: Vec<&[([i64; 3], usize)]> = sorted.chunk_by(|a, b| a.0 == b.0).collect();
    let offsets = half_around();
    for &one in &cells {
        for step in &offsets {
            let next: [i64; 3] = std::array::from_fn(|axis| one[0].0[axis] + step[axis]);
            let Ok(found) = cells.binary_search_by_key(&next, |cell| cell[0].0) else {
                continue;
            };
            let other = cells[found];
            let (a, b) = (one[0].1, other[0].1);
            if root(&mut roots, a) != root(&mut roots, b) {
                let at = |entry: &([i64; 3], usize)| points[members[entry.1] as usize];
                let near = |p: Vector| other.iter().any(|q| squared(p, at(q)) <= gap_m * gap_m);
                if one.iter().any(|entry| near(at(entry))) {
                    join(&mut roots, a, b);
                }
            }
        }
    }
    (0..members.len()).map(|i| root(&mut roots, i)).collect()
}

/// Half of the 124 cells within two of one, nearest first.
fn half_around() -> Vec<[i64; 3]> {
    let mut steps: Vec<[i64; 3]> = (0..125)
        .map(|i| [i / 25 - 2, i / 5 % 5 - 2, i % 5 - 2])
        .filter(|step| *step > [0, 0, 0])
        .collect();
    steps.sort_by_key(|step| step.iter().map(|value| value * value).sum::<i64>());
    steps
}

fn join(roots: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(roots, a), root(roots, b));
    roots[a.max(b)] = a.min(b);
}

fn root(roots: &mut [usize], of: usize) -> usize {
    let mut at = of;
    while roots[at] != at {
        roots[at] = roots[roots[at]];
        at = roots[at];
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn two_rows_are_two_groups_however_many_points() {
        for len in [10, 200] {
            let points: Vec<Vector> =
                (0..len).map(|i| [f64::from(i / 2) * 0.1, f64::from(i % 2) * 0.5, 0.0]).collect();
            let groups = clusters(&points, (0..len as u32).collect(), 0.12);
            assert_eq!(groups.len(), 2, "{len} points");
            assert!(groups[1].iter().all(|i| i % 2 == 1));
        }
    }

    proptest! {
        #[test]
        fn cells_part_as_pairs_do(
            points in prop::collection::vec((0i32..40, 0i32..40, 0i32..40), 2..150), gap in 1u8..12,
        ) {
            let points: Vec<Vector> =
                points.iter().map(|p| [f64::from(p.0), f64::from(p.1), f64::from(p.2)]).collect();
            let members: Vec<u32> = (0..points.len() as u32).collect();
            let gap = f64::from(gap);
            prop_assert_eq!(by_cells(&points, &members, gap), by_pairs(&points, &members, gap));
        }
    }
}
