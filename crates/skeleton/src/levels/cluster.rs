//! Points parted where gaps are.

use crate::vector::{Vector, squared};

/// Up to so many points all pairs are compared.
const PAIRS: usize = 48;

/// Parts points into groups with gaps between them, in the order of their first members. Points
/// closer than `gap_m` are always in one group; groups further apart than twice that never are (of
/// many points, cells of a grid are joined instead of the points).
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

fn by_cells(points: &[Vector], members: &[u32], gap_m: f64) -> Vec<usize> {
    let cell = |member: u32| points[member as usize].map(|value| (value / gap_m).floor() as i64);
    let mut cells: Vec<([i64; 3], usize)> =
        members.iter().enumerate().map(|(place, &member)| (cell(member), place)).collect();
    cells.sort_unstable();
    let mut roots: Vec<usize> = (0..members.len()).collect();
    for pair in cells.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        join(&mut roots, pair[0].1, pair[1].1);
    }
    let mut firsts = cells;
    firsts.dedup_by_key(|entry| entry.0);
    for &(at, place) in &firsts {
        for step in &HALF_AROUND {
            let next: [i64; 3] = std::array::from_fn(|axis| at[axis] + step[axis]);
            if let Ok(found) = firsts.binary_search_by_key(&next, |entry| entry.0) {
                join(&mut roots, place, firsts[found].1);
            }
        }
    }
    (0..members.len()).map(|i| root(&mut roots, i)).collect()
}

/// Half of the 26 cells around one.
const HALF_AROUND: [[i64; 3]; 13] = [
    [0, 0, 1],
    [0, 1, -1],
    [0, 1, 0],
    [0, 1, 1],
    [1, -1, -1],
    [1, -1, 0],
    [1, -1, 1],
    [1, 0, -1],
    [1, 0, 0],
    [1, 0, 1],
    [1, 1, -1],
    [1, 1, 0],
    [1, 1, 1],
];

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
}
