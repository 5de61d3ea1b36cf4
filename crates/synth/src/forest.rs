//! Growing a forest: sizes from distributions, places by inhibition, crowns shaped by neighbours.

use crate::canopy::Canopy;
use crate::exposure;
use crate::random::{Domain, Stream};
use crate::stand::{Layout, Stand};
use crate::terrain::Terrain;
use crate::tree::{Layer, Tree};
use crate::{Crown, Error, Species, crown::Profile};
use rayon::prelude::*;
use timberline_pointcloud::{Frame, Rect};

/// Places tried for a tree before it is given up: the stand is full for trees of its size.
const ATTEMPTS: usize = 60;
/// A tree lower than this share of another's height stands below it and may stand close to it.
const UNDER: f64 = 0.7;
/// Smallest distance of two stems, m.
const STEM_GAP_M: f64 = 0.8;
/// Relative deviation of height and of crown width around their regressions, and of the crown ratio.
const HEIGHT_SPREAD: f64 = 0.07;
const WIDTH_SPREAD: f64 = 0.10;
const RATIO_SPREAD: f64 = 0.12;
/// Edge of the cells in which neighbours are looked up, m.
const CELL_M: f64 = 6.0;

/// The trees of a scene, by descending height.
#[derive(Debug, Clone)]
pub struct Forest {
    /// The trees, in the scene's frame; `trees[i].id == i + 1`.
    pub trees: Vec<Tree>,
    /// Trees that found no place.
    pub unplaced: usize,
    pub(crate) canopy: Canopy,
}

/// A tree before it has a place.
#[derive(Debug, Clone)]
struct Seedling {
    stand: u16,
    layout: Layout,
    species: Species,
    dbh_cm: f64,
    height_m: f64,
    crown_ratio: f64,
    radius_m: f64,
    name: u64,
}

/// A tree that stands.
#[derive(Debug, Clone)]
struct Placed {
    seedling: Seedling,
    at: [f64; 2],
}

impl Forest {
    /// Grows the stands over a terrain.
    ///
    /// Trees are placed from the highest to the lowest by simple sequential inhibition (Diggle 2013,
    /// Statistical analysis of spatial point patterns, section 6.5): a place is refused when
    /// the crown would reach into that of a tree of its own storey by more than the stand allows.
    ///
    /// # Errors
    /// What [`Stand::check`] finds.
    pub fn grow(
        stands: &[Stand],
        terrain: &Terrain,
        frame: Frame,
        seed: u64,
    ) -> Result<Self, Error> {
        stands.iter().try_for_each(Stand::check)?;
        let mut seedlings = seedlings(stands, seed);
        seedlings.sort_by(|a, b| b.height_m.total_cmp(&a.height_m).then(a.name.cmp(&b.name)));
        let wanted = seedlings.len();
        let neighbours = Neighbours::place(seedlings, stands, frame, seed);
        let build = |index: usize| {
            let pressure = neighbours.pressure(index);
            build_tree(&neighbours.placed[index], index, pressure, terrain, seed)
        };
        let trees: Vec<Tree> = (0..neighbours.placed.len()).into_par_iter().map(build).collect();
        let unplaced = wanted - trees.len();
        Ok(Self { unplaced, ..Self::over(trees) })
    }

    /// A forest of given trees, in one frame: they are sorted by descending height (equal ones stay
    /// in their order) and numbered anew, and what follows from their neighbours is assessed anew.
    #[must_use]
    pub fn of(mut trees: Vec<Tree>) -> Self {
        trees.sort_by(|a, b| b.height_m.total_cmp(&a.height_m));
        trees.iter_mut().enumerate().for_each(|(index, tree)| tree.id = index as u32 + 1);
        Self::over(trees)
    }

    /// Trees in their order, assessed.
    fn over(mut trees: Vec<Tree>) -> Self {
        let canopy = Canopy::new(&trees, BEAM_MARGIN_M);
        exposure::assess(&mut trees, &canopy);
        Self { unplaced: 0, trees, canopy }
    }
}

/// Widening of crowns in the index, m: beams have a width, and [`Canopy::along`] walks in steps.
const BEAM_MARGIN_M: f64 = 1.5;

fn seedlings(stands: &[Stand], seed: u64) -> Vec<Seedling> {
    let mut all = Vec::new();
    for (stand_index, stand) in stands.iter().enumerate() {
        for (cohort_index, cohort) in stand.params.cohorts.iter().enumerate() {
            let count = (stand.area_ha() * cohort.stems_per_ha).round() as u64;
            let first = ((stand_index as u64) << 40) | ((cohort_index as u64) << 32);
            all.extend(
                (0..count).map(|i| seedling(stand, stand_index, cohort_index, first | i, seed)),
            );
        }
    }
    all
}

fn seedling(
    stand: &Stand,
    stand_index: usize,
    cohort_index: usize,
    name: u64,
    seed: u64,
) -> Seedling {
    let (params, cohort) = (&stand.params, &stand.params.cohorts[cohort_index]);
    let mut stream = Stream::new(seed, Domain::Tree, name << 1);
    let total: f64 = cohort.mix.iter().map(|share| share.weight.max(0.0)).sum();
    let mut left = total * stream.unit();
    let mut species = cohort.mix[0].species;
    for share in cohort.mix.iter().filter(|share| share.weight > 0.0) {
        species = share.species;
        left -= share.weight;
        if left < 0.0 {
            break;
        }
    }
    let dbh_cm = cohort.dbh_min_cm + stream.weibull(cohort.dbh_shape, cohort.dbh_scale_cm);
    let height_m = species.height_m(dbh_cm) * params.site * stream.factor(HEIGHT_SPREAD);
    let crown_ratio = (cohort.crown_ratio * stream.factor(RATIO_SPREAD)).clamp(0.2, 0.95);
    let width_m = species.crown_width_m(dbh_cm, height_m, crown_ratio);
    let radius_m = 0.5 * width_m * params.crown_scale * stream.factor(WIDTH_SPREAD);
    Seedling {
        stand: stand_index as u16,
        layout: cohort.layout,
        species,
        dbh_cm,
        height_m,
        crown_ratio,
        radius_m,
        name,
    }
}

/// Placed trees in square cells.
struct Neighbours {
    placed: Vec<Placed>,
    cells: Vec<Vec<u32>>,
    corner: [f64; 2],
    size: [usize; 2],
    largest_radius_m: f64,
}

impl Neighbours {
    fn place(seedlings: Vec<Seedling>, stands: &[Stand], frame: Frame, seed: u64) -> Self {
        let boxes: Vec<Rect> = stands.iter().map(|stand| bounding_box(stand, frame)).collect();
        let all = boxes.iter().fold(Rect::EMPTY, |all, rect| all.union(rect));
        let size = all.size().map(|edge| (edge.max(0.0) / CELL_M) as usize + 1);
        let largest_radius_m = seedlings.iter().map(|s| s.radius_m).fold(0.0, f64::max);
        let cells = vec![Vec::new(); size[0] * size[1]];
        let placed = Vec::with_capacity(seedlings.len());
        let mut this = Self { placed, cells, corner: all.min, size, largest_radius_m };
        for seedling in seedlings {
            let stand = &stands[usize::from(seedling.stand)];
            let rect = boxes[usize::from(seedling.stand)];
            let mut stream = Stream::new(seed, Domain::Tree, (seedling.name << 1) | 1);
            let found = (0..ATTEMPTS).find_map(|_| {
                let at = candidate(&seedling.layout, &rect, &mut stream);
                let [x, y, _] = frame.world_from_local([at[0], at[1], 0.0]);
                let free =
                    stand.contains(x, y) && this.is_free(&seedling, at, stand.params.crown_overlap);
                free.then_some(at)
            });
            if let Some(at) = found {
                let [column, row] = this.cell(at);
                this.cells[row * size[0] + column].push(this.placed.len() as u32);
                this.placed.push(Placed { seedling, at });
            }
        }
        this
    }

    fn cell(&self, at: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| {
            let index = ((at[axis] - self.corner[axis]) / CELL_M).max(0.0) as usize;
            index.min(self.size[axis] - 1)
        })
    }

    /// Calls `visit` with the trees in the cells within a distance until it returns false.
    fn around(&self, at: [f64; 2], reach_m: f64, mut visit: impl FnMut(usize, &Placed) -> bool) {
        let (low, high) = (self.cell(at.map(|v| v - reach_m)), self.cell(at.map(|v| v + reach_m)));
        for row in low[1]..=high[1] {
            for column in low[0]..=high[0] {
                for &index in &self.cells[row * self.size[0] + column] {
                    if !visit(index as usize, &self.placed[index as usize]) {
                        return;
                    }
                }
            }
        }
    }

    fn is_free(&self, seedling: &Seedling, at: [f64; 2], overlap: f64) -> bool {
        let mut free = true;
        self.around(at, seedling.radius_m + self.largest_radius_m, |_, other| {
            let under = seedling.height_m < UNDER * other.seedling.height_m;
            let apart = if under {
                0.25 * other.seedling.radius_m
            } else {
                (1.0 - overlap) * (seedling.radius_m + other.seedling.radius_m)
            };
            let (dx, dy) = (at[0] - other.at[0], at[1] - other.at[1]);
            let apart = apart.max(STEM_GAP_M);
            free = dx * dx + dy * dy >= apart * apart;
            free
        });
        free
    }

    /// Where the neighbours push a crown: the sum over overlapping crowns of the direction away from
    /// them, weighted by how far they reach in and how high they are. In crown radii, about.
    fn pressure(&self, index: usize) -> [f64; 2] {
        let Placed { seedling, at } = &self.placed[index];
        let mut pushes: Vec<(usize, [f64; 2])> = Vec::new();
        self.around(*at, seedling.radius_m + self.largest_radius_m, |other_index, other| {
            let (dx, dy) = (at[0] - other.at[0], at[1] - other.at[1]);
            let distance = (dx * dx + dy * dy).sqrt();
            let reach = seedling.radius_m + other.seedling.radius_m - distance;
            if other_index != index && reach > 0.0 {
                let strength = (other.seedling.height_m / seedling.height_m).min(1.5) * reach
                    / (seedling.radius_m * distance);
                pushes.push((other_index, [dx * strength, dy * strength]));
            }
            true
        });
        pushes.iter().fold([0.0; 2], |sum, (_, push)| [sum[0] + push[0], sum[1] + push[1]])
    }
}

fn bounding_box(stand: &Stand, frame: Frame) -> Rect {
    stand.boundary_m.iter().fold(Rect::EMPTY, |rect, &[x, y]| {
        let [x, y, _] = frame.local_from_world([x, y, 0.0]);
        rect.union(&Rect { min: [x, y], max: [x, y] })
    })
}

fn candidate(layout: &Layout, rect: &Rect, stream: &mut Stream) -> [f64; 2] {
    let any = [stream.within(rect.min[0], rect.max[0]), stream.within(rect.min[1], rect.max[1])];
    match *layout {
        Layout::Free => any,
        Layout::Rows { spacing_m, jitter_m, direction_deg } => {
            let (sin, cos) = libm::sincos(direction_deg.to_radians());
            let snap = |value: f64| (value / spacing_m).round() * spacing_m;
            let row = snap(cos * any[0] + sin * any[1]) + jitter_m * stream.normal();
            let place = snap(cos * any[1] - sin * any[0]) + jitter_m * stream.normal();
            [cos * row - sin * place, sin * row + cos * place]
        }
    }
}

/// Largest move of a crown's centre away from its neighbours, in crown radii.
const LARGEST_SHIFT: f64 = 0.35;
/// Move of the centre per unit of pressure.
const SHIFT: f64 = 0.15;

fn build_tree(
    placed: &Placed,
    index: usize,
    pressure: [f64; 2],
    terrain: &Terrain,
    seed: u64,
) -> Tree {
    let Placed { seedling, at } = placed;
    let mut stream = Stream::new(seed, Domain::Lean, seedling.name);
    let base_m = [at[0], at[1], terrain.local(at[0], at[1]).z];
    let crown = build_crown(seedling, base_m, pressure, &mut stream);
    let [top_x, top_y, _] = crown.top_m;
    Tree {
        id: index as u32 + 1,
        stand: seedling.stand,
        species: seedling.species,
        dbh_cm: seedling.dbh_cm,
        height_m: seedling.height_m,
        base_m,
        crown,
        ground_below_top_m: terrain.local(top_x, top_y).z,
        exposed: 1.0,
        visible: true,
        layer: Layer::Dominant,
    }
}

fn build_crown(
    seedling: &Seedling,
    base_m: [f64; 3],
    pressure: [f64; 2],
    stream: &mut Stream,
) -> Crown {
    let shape = &seedling.species.traits().shape;
    let size = (pressure[0] * pressure[0] + pressure[1] * pressure[1]).sqrt();
    let away = if size > 0.0 { pressure.map(|p| p / size) } else { [0.0; 2] };
    // Stems lean at random, and a little towards the gap.
    let lean = libm::tan((shape.lean_deg * stream.normal().abs().min(3.0)).to_radians());
    let towards = stream.direction();
    let lean = [0, 1].map(|i| lean * (towards[i] + 0.5 * away[i] * size.min(1.0)));
    let height_m = seedling.height_m;
    let top_m =
        [base_m[0] + lean[0] * height_m, base_m[1] + lean[1] * height_m, base_m[2] + height_m];
    // Competition lifts the crown's base.
    let length_m = height_m * seedling.crown_ratio * (1.0 - 0.15 * size.min(1.0));
    let upper_m = length_m * shape.upper;
    let shift = seedling.radius_m * (SHIFT * size).min(LARGEST_SHIFT);
    let axis = [0, 1].map(|i| -lean[i] + away[i] * shift / upper_m);
    let stretch = stream.within(1.0, 1.18);
    // Crowns are wider across the direction in which they are pushed.
    let [dx, dy] = if size > 0.3 { [-away[1], away[0]] } else { stream.direction() };
    let straight = stream.within(shape.straight[0], shape.straight[1]);
    Crown {
        top_m,
        axis,
        semi_axes_m: [seedling.radius_m * stretch, seedling.radius_m / stretch],
        direction: [dx, dy],
        upper_m,
        lower_m: length_m - upper_m,
        profile: Profile { straight, round: shape.round },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::StandParams;
    use crate::terrain::TerrainParams;

    fn grown(params: StandParams) -> Forest {
        let boundary_m = vec![[0.0, 0.0], [150.0, 0.0], [150.0, 150.0], [0.0, 150.0]];
        let stand = Stand { name: "s".into(), boundary_m, params };
        let frame = Frame::default();
        let terrain = Terrain::new(&TerrainParams::default(), frame, 5).unwrap();
        Forest::grow(&[stand], &terrain, frame, 5).unwrap()
    }

    #[test]
    fn crowns_of_one_storey_keep_their_distance() {
        let params = StandParams::conifer_plantation();
        let (overlap, forest) = (params.crown_overlap, grown(params));
        for (i, a) in forest.trees.iter().enumerate() {
            for b in &forest.trees[..i] {
                let distance = libm::hypot(a.base_m[0] - b.base_m[0], a.base_m[1] - b.base_m[1]);
                assert!(distance >= STEM_GAP_M);
                if a.height_m >= UNDER * b.height_m {
                    let sum = a.crown.radius_m() + b.crown.radius_m();
                    assert!(distance >= (1.0 - overlap) * sum - 1e-9);
                }
            }
        }
    }

    #[test]
    fn a_tree_is_consistent() {
        for tree in grown(StandParams::multilayer_mixed()).trees {
            assert!((tree.crown.top_m[2] - tree.base_m[2] - tree.height_m).abs() < 1e-9);
            assert!(tree.crown_base_height_m() > 0.0 && tree.crown.semi_axes_m[0] < 12.0);
            assert!(
                (tree.crown.radius_m() * tree.crown.radius_m() * std::f64::consts::PI
                    - tree.crown.area_m2())
                .abs()
                    < 1e-9
            );
        }
    }

    #[test]
    fn densities_are_met_where_there_is_room() {
        let forest = grown(StandParams::open_conifer());
        let wanted = forest.trees.len() + forest.unplaced;
        assert_eq!(wanted, 315);
        assert!(forest.unplaced * 20 < wanted, "{} of {wanted} found no place", forest.unplaced);
    }
}
