//! Stands: where they are and what grows in them.

use crate::error::check;
use crate::{Error, Species};
use serde::{Deserialize, Serialize};

/// A share of a species in a cohort.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// The species.
    pub species: Species,
    /// Its weight; need not sum to 1.
    pub weight: f64,
}

/// How stems are laid out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Layout {
    /// Anywhere that the distance to the other stems allows.
    Free,
    /// Planted in rows.
    Rows {
        /// Distance of rows and of trees in a row, m.
        spacing_m: f64,
        /// Deviation of a stem from its place, m.
        jitter_m: f64,
        /// Direction of the rows, degrees from east towards north.
        direction_deg: f64,
    },
}

/// Trees of one storey or age.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cohort {
    /// Stems to place for every hectare; fewer stand in the end where crowns leave no room.
    pub stems_per_ha: f64,
    /// Species and their shares.
    pub mix: Vec<Share>,
    /// Shape of the Weibull distribution of the diameter above the smallest.
    pub dbh_shape: f64,
    /// Scale of that distribution, cm.
    pub dbh_scale_cm: f64,
    /// Smallest diameter, cm.
    pub dbh_min_cm: f64,
    /// Mean share of the height that bears a crown.
    pub crown_ratio: f64,
    /// Layout of the stems.
    pub layout: Layout,
}

/// What grows in a stand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandParams {
    /// Its cohorts.
    pub cohorts: Vec<Cohort>,
    /// How far crowns of one storey may reach into one another, as a share of the sum of their radii.
    pub crown_overlap: f64,
    /// Height relative to the mean of the regressions: the quality of the site.
    pub site: f64,
    /// Crown width relative to the mean of the regressions.
    pub crown_scale: f64,
}

/// A stand: a polygon and what grows in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stand {
    /// Name in tables.
    pub name: String,
    /// Corners of its boundary, world x and y, m; closed by itself.
    pub boundary_m: Vec<[f64; 2]>,
    /// What grows there.
    pub params: StandParams,
}

fn share(species: Species, weight: f64) -> Share {
    Share { species, weight }
}

impl StandParams {
    /// Few large Douglas-firs and grand firs with sky between them.
    #[must_use]
    pub fn open_conifer() -> Self {
        let mix = vec![share(Species::DouglasFir, 0.7), share(Species::GrandFir, 0.3)];
        let cohort = Cohort {
            stems_per_ha: 140.0,
            mix,
            dbh_shape: 2.4,
            dbh_scale_cm: 34.0,
            dbh_min_cm: 12.0,
            crown_ratio: 0.62,
            layout: Layout::Free,
        };
        Self { cohorts: vec![cohort], crown_overlap: 0.1, site: 0.92, crown_scale: 0.95 }
    }

    /// A closed plantation of Douglas-fir in rows, 30 to 40 years old.
    #[must_use]
    pub fn conifer_plantation() -> Self {
        let mix = vec![share(Species::DouglasFir, 0.94), share(Species::WesternHemlock, 0.06)];
        let cohort = Cohort {
            stems_per_ha: 950.0,
            mix,
            dbh_shape: 3.2,
            dbh_scale_cm: 17.0,
            dbh_min_cm: 9.0,
            crown_ratio: 0.46,
            layout: Layout::Rows { spacing_m: 2.9, jitter_m: 0.25, direction_deg: 20.0 },
        };
        Self { cohorts: vec![cohort], crown_overlap: 0.5, site: 1.05, crown_scale: 0.8 }
    }

    /// Old Douglas-firs over hemlock and redcedar over dogwood.
    #[must_use]
    pub fn multilayer_mixed() -> Self {
        let cohort = |stems_per_ha, mix, dbh: [f64; 3], crown_ratio| Cohort {
            stems_per_ha,
            mix,
            dbh_shape: dbh[0],
            dbh_scale_cm: dbh[1],
            dbh_min_cm: dbh[2],
            crown_ratio,
            layout: Layout::Free,
        };
        let old = vec![share(Species::DouglasFir, 0.85), share(Species::WesternRedcedar, 0.15)];
        let middle = vec![
            share(Species::WesternHemlock, 0.6),
            share(Species::GrandFir, 0.2),
            share(Species::WesternRedcedar, 0.2),
        ];
        let low = vec![share(Species::PacificDogwood, 0.6), share(Species::WesternHemlock, 0.4)];
        let cohorts = vec![
            cohort(110.0, old, [2.6, 33.0, 28.0], 0.5),
            cohort(300.0, middle, [2.0, 15.0, 9.0], 0.6),
            cohort(220.0, low, [1.6, 5.0, 4.0], 0.65),
        ];
        Self { cohorts, crown_overlap: 0.3, site: 1.0, crown_scale: 0.9 }
    }

    /// Maple and alder with closed, rounded crowns.
    #[must_use]
    pub fn broadleaf() -> Self {
        let mix = vec![share(Species::BigleafMaple, 0.55), share(Species::RedAlder, 0.45)];
        let upper = Cohort {
            stems_per_ha: 300.0,
            mix,
            dbh_shape: 2.2,
            dbh_scale_cm: 20.0,
            dbh_min_cm: 12.0,
            crown_ratio: 0.52,
            layout: Layout::Free,
        };
        let lower = Cohort {
            stems_per_ha: 120.0,
            mix: vec![share(Species::PacificDogwood, 1.0)],
            dbh_shape: 1.6,
            dbh_scale_cm: 5.0,
            dbh_min_cm: 4.0,
            crown_ratio: 0.65,
            layout: Layout::Free,
        };
        Self { cohorts: vec![upper, lower], crown_overlap: 0.3, site: 1.0, crown_scale: 0.85 }
    }

    /// Single oaks in grass.
    #[must_use]
    pub fn savanna() -> Self {
        let cohort = Cohort {
            stems_per_ha: 28.0,
            mix: vec![share(Species::OregonWhiteOak, 1.0)],
            dbh_shape: 2.4,
            dbh_scale_cm: 34.0,
            dbh_min_cm: 12.0,
            crown_ratio: 0.75,
            layout: Layout::Free,
        };
        Self { cohorts: vec![cohort], crown_overlap: 0.0, site: 0.9, crown_scale: 0.9 }
    }

    fn check(&self, stand: &str) -> Result<(), Error> {
        check("crown_overlap", self.crown_overlap, 0.0..=0.95, "0 to 0.95")?;
        check("site", self.site, 0.2..=3.0, "0.2 to 3")?;
        check("crown_scale", self.crown_scale, 0.2..=3.0, "0.2 to 3")?;
        for (index, cohort) in self.cohorts.iter().enumerate() {
            check("stems_per_ha", cohort.stems_per_ha, 0.0..=1e5, "0 to 100000")?;
            check("dbh_shape", cohort.dbh_shape, 0.3..=20.0, "0.3 to 20")?;
            check("dbh_scale_cm", cohort.dbh_scale_cm, 0.1..=200.0, "0.1 to 200 cm")?;
            check("dbh_min_cm", cohort.dbh_min_cm, 1.0..=200.0, "1 to 200 cm")?;
            check("crown_ratio", cohort.crown_ratio, 0.1..=0.95, "0.1 to 0.95")?;
            if let Layout::Rows { spacing_m, .. } = cohort.layout {
                check("spacing_m", spacing_m, 0.3..=100.0, "0.3 to 100 m")?;
            }
            if !cohort.mix.iter().any(|share| share.weight > 0.0) {
                return Err(Error::NoSpecies { stand: stand.to_owned(), cohort: index });
            }
        }
        Ok(())
    }
}

impl Stand {
    /// Area of the polygon, ha.
    #[must_use]
    pub fn area_ha(&self) -> f64 {
        let corners = &self.boundary_m;
        let Some(&[x0, y0]) = corners.first() else { return 0.0 };
        let cross = |i: usize| {
            let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % corners.len()]);
            (ax - x0) * (by - y0) - (bx - x0) * (ay - y0)
        };
        (0..corners.len()).map(cross).sum::<f64>().abs() / 20_000.0
    }

    /// Whether a world position is inside (even-odd rule).
    #[must_use]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        let corners = &self.boundary_m;
        let mut inside = false;
        for i in 0..corners.len() {
            let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % corners.len()]);
            if (ay > y) != (by > y) && x < ax + (bx - ax) * (y - ay) / (by - ay) {
                inside = !inside;
            }
        }
        inside
    }

    /// Checks boundary and parameters.
    ///
    /// # Errors
    /// [`Error::Boundary`], [`Error::NoSpecies`] or [`Error::Parameter`].
    pub fn check(&self) -> Result<(), Error> {
        let corners = self.boundary_m.len();
        if corners < 3 {
            return Err(Error::Boundary { stand: self.name.clone(), corners });
        }
        self.params.check(&self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Stand {
        let boundary_m = vec![[1000.0, 2000.0], [1200.0, 2000.0], [1000.0, 2100.0]];
        Stand { name: "t".into(), boundary_m, params: StandParams::savanna() }
    }

    #[test]
    fn area_and_inside_of_a_triangle() {
        let stand = triangle();
        assert!((stand.area_ha() - 1.0).abs() < 1e-12);
        assert!(stand.contains(1010.0, 2010.0) && !stand.contains(1190.0, 2090.0));
    }

    #[test]
    fn presets_are_valid_and_nonsense_is_named() {
        let presets = [
            StandParams::open_conifer(),
            StandParams::conifer_plantation(),
            StandParams::multilayer_mixed(),
            StandParams::broadleaf(),
            StandParams::savanna(),
        ];
        for params in presets {
            Stand { params, ..triangle() }.check().unwrap();
        }
        let mut stand = triangle();
        stand.params.cohorts[0].mix.clear();
        assert!(stand.check().unwrap_err().to_string().contains("cohort 0 of stand `t`"));
    }
}
