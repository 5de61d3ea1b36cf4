//! Where a crown begins above the ground.

/// Thickness of the layers of the height profile, m.
const LAYER_M: f64 = 0.5;

/// Half width of the running mean over layers: a window of 2.5 m bridges gaps between whorls.
const SMOOTHING: usize = 2;

/// Estimates the height of the crown's base from the heights above ground of a tree's points.
///
/// The profile is the number of points per layer, smoothed; going down from its fullest layer, the
/// crown ends at the first layer below `density` times the fullest. `None` for fewer than ten
/// points: an airborne scan then says nothing about the crown's lower end.
#[must_use]
pub fn crown_base(heights_m: &[f64], density: f64) -> Option<f64> {
    let top = heights_m.iter().copied().filter(|h| h.is_finite()).fold(0.0, f64::max);
    if heights_m.len() < 10 || top <= 0.0 {
        return None;
    }
    let mut layers = vec![0u32; (top / LAYER_M).floor() as usize + 1];
    for &height in heights_m.iter().filter(|h| **h >= 0.0) {
        layers[(height / LAYER_M).floor() as usize] += 1;
    }
    let smooth: Vec<f64> = (0..layers.len())
        .map(|k| {
            let near = &layers[k.saturating_sub(SMOOTHING)..(k + SMOOTHING + 1).min(layers.len())];
            f64::from(near.iter().sum::<u32>()) / near.len() as f64
        })
        .collect();
    let (fullest, most) = smooth
        .iter()
        .copied()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))?;
    let below = (0..fullest).rev().find(|&k| smooth[k] < density * most);
    let base = below.map_or(0, |k| k + 1);
    // The running mean reaches into empty layers: the lowest layer with a point above is the base.
    let lowest = (base..=fullest).find(|&k| layers[k] > 0).unwrap_or(fullest);
    Some(lowest as f64 * LAYER_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crown_over_a_bare_stem() {
        let mut heights: Vec<f64> = (0..200).map(|i| 8.0 + 0.05 * f64::from(i)).collect();
        heights.push(2.2);
        assert_eq!(crown_base(&heights, 0.2), Some(8.0));
    }

    #[test]
    fn a_crown_to_the_ground() {
        let heights: Vec<f64> = (0..200).map(|i| 0.05 * f64::from(i)).collect();
        assert_eq!(crown_base(&heights, 0.1), Some(0.0));
    }

    #[test]
    fn too_few_points_say_nothing() {
        assert_eq!(crown_base(&[5.0; 9], 0.1), None);
        assert_eq!(crown_base(&[-1.0; 20], 0.1), None);
    }
}
