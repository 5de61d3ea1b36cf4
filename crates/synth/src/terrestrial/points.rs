//! Points that know what they hit.

use super::scan_params::Station;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use timberline_pointcloud::{Column, PointCloud};

/// What a point comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[repr(u8)]
pub enum Label {
    /// The ground.
    Ground = 0,
    /// Wood of a tree.
    Wood = 1,
    /// Leaves or needles of a tree.
    Leaf = 2,
    /// Shrubs, seedlings and herbs.
    Understorey = 3,
    /// Nothing: a stray point.
    Stray = 4,
}

/// Points with truth, one entry each in every vector.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LabelledPoints {
    /// The points as an instrument would give them; `source_id` is the scan position.
    pub cloud: PointCloud,
    /// Number of the tree, 0 for none.
    pub tree_id: Vec<u32>,
    /// What the largest part of the light comes from.
    pub label: Vec<Label>,
    /// The piece of wood in its tree, for points of wood; `u32::MAX` for others.
    pub cylinder: Vec<u32>,
    /// Whether the range is a mean of rays that end more than 2 cm apart.
    pub mixed: Vec<bool>,
    /// The scan positions.
    pub stations: Vec<Station>,
}

impl LabelledPoints {
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cloud.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cloud.is_empty()
    }

    /// The points at some indices, in their order.
    #[must_use]
    pub fn select(&self, indices: &[u32]) -> Self {
        fn pick<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
            indices.iter().map(|&index| values[index as usize]).collect()
        }
        Self {
            cloud: self.cloud.select(indices),
            tree_id: pick(&self.tree_id, indices),
            label: pick(&self.label, indices),
            cylinder: pick(&self.cylinder, indices),
            mixed: pick(&self.mixed, indices),
            stations: self.stations.clone(),
        }
    }

    /// The points for which a question is answered with yes.
    #[must_use]
    pub fn filter(&self, mut keep: impl FnMut(usize) -> bool) -> Self {
        let kept: Vec<u32> = (0..self.len()).filter(|&i| keep(i)).map(|i| i as u32).collect();
        self.select(&kept)
    }

    /// These points, then those of another scan of the same frame.
    pub(crate) fn joined(mut self, other: &Self) -> Self {
        let shift = self.cloud.frame.shift_from(&other.cloud.frame);
        for index in 0..other.len() {
            let at = other.cloud.local(index);
            let at = std::array::from_fn(|axis| at[axis] + shift[axis]);
            self.cloud.push_local(at, &other.cloud.point(index));
        }
        self.tree_id.extend_from_slice(&other.tree_id);
        self.label.extend_from_slice(&other.label);
        self.cylinder.extend_from_slice(&other.cylinder);
        self.mixed.extend_from_slice(&other.mixed);
        self
    }

    /// The points of one scan position.
    #[must_use]
    pub fn of_station(&self, source_id: u16) -> Self {
        self.filter(|i| self.cloud.source_id[i] == source_id)
    }

    /// One point of every occupied cell of a world-aligned lattice: that nearest to the mean of its
    /// cell, the first of equals. The order of the points stays.
    #[must_use]
    pub fn thinned(&self, voxel_m: f64) -> Self {
        let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
        for index in 0..self.len() {
            let cell = self.cloud.world(index).map(|value| (value / voxel_m).floor() as i64);
            cells.entry(cell).or_default().push(index as u32);
        }
        let mut kept: Vec<u32> = cells.values().filter_map(|some| self.central(some)).collect();
        kept.sort_unstable();
        self.select(&kept)
    }

    fn central(&self, some: &[u32]) -> Option<u32> {
        let at = |&index: &u32| self.cloud.local(index as usize);
        let count = some.len() as f64;
        let mean: [f64; 3] =
            std::array::from_fn(|axis| some.iter().map(|i| at(i)[axis]).sum::<f64>() / count);
        let squared = |index: &u32| {
            let p = at(index);
            (0..3).map(|axis| (p[axis] - mean[axis]) * (p[axis] - mean[axis])).sum::<f64>()
        };
        some.iter().copied().min_by(|a, b| squared(a).total_cmp(&squared(b)).then(a.cmp(b)))
    }

    /// The points with truth as extra columns: `truth_tree_id`, and `truth_label` as in [`Label`].
    #[must_use]
    pub fn with_truth_columns(&self) -> PointCloud {
        let mut cloud = self.cloud.clone();
        let labels = self.label.iter().map(|&label| label as u8).collect();
        cloud.extra.insert("truth_tree_id".to_owned(), Column::U32(self.tree_id.clone()));
        cloud.extra.insert("truth_label".to_owned(), Column::U8(labels));
        cloud
    }
}
