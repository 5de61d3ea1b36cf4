//! What is compared on what: stands, densities, repetitions.

use crate::Error;
use serde::Serialize;
use std::fmt;
use std::str::FromStr;
use timberline_evaluate::{MatchParams, MatchRule};
use timberline_synth::StandParams;

/// A kind of stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StandKind {
    /// Large conifers with sky between them.
    OpenConifer,
    /// A closed plantation of conifers.
    ConiferPlantation,
    /// Old conifers over younger ones over small broadleaved trees.
    MultilayerMixed,
    /// Closed, rounded crowns.
    Broadleaf,
    /// Single oaks.
    Savanna,
}

impl StandKind {
    /// All kinds.
    pub const ALL: [Self; 5] = [
        Self::OpenConifer,
        Self::ConiferPlantation,
        Self::MultilayerMixed,
        Self::Broadleaf,
        Self::Savanna,
    ];

    /// Name in tables and arguments.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::OpenConifer => "open-conifer",
            Self::ConiferPlantation => "conifer-plantation",
            Self::MultilayerMixed => "multilayer-mixed",
            Self::Broadleaf => "broadleaf",
            Self::Savanna => "savanna",
        }
    }

    /// What grows there.
    #[must_use]
    pub fn params(self) -> StandParams {
        match self {
            Self::OpenConifer => StandParams::open_conifer(),
            Self::ConiferPlantation => StandParams::conifer_plantation(),
            Self::MultilayerMixed => StandParams::multilayer_mixed(),
            Self::Broadleaf => StandParams::broadleaf(),
            Self::Savanna => StandParams::savanna(),
        }
    }
}

impl fmt::Display for StandKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for StandKind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let known = Self::ALL.iter().find(|kind| kind.name() == text);
        known.copied().ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::Unknown { what: "stand", name: text.to_owned(), known }
        })
    }
}

/// The whole comparison on generated stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// Seed of everything random. Two experiments of different seeds share no stand.
    pub seed: u32,
    /// Repetitions, each with trees of its own.
    pub repeats: u32,
    /// Kinds of stand.
    pub stands: Vec<StandKind>,
    /// Densities of points (all returns), 1/m².
    pub densities_per_m2: Vec<f64>,
    /// Edge of the square in which trees are judged, m.
    pub judged_edge_m: f64,
    /// Width of the margin around it that is scanned, too, m.
    pub margin_m: f64,
    /// Slope of the ground, degrees; it is gently uneven besides. 0 makes it level.
    pub slope_deg: f64,
    /// Width of the crowns, relative to that of the kind of stand.
    pub crown_scale: f64,
    /// How far crowns are dented, relative to what is common in their species; 0 leaves them smooth.
    pub crown_relief: f64,
    /// Lower trees are not looked for, m.
    pub min_height_m: f64,
    /// When a found tree can be a true one, by crown tops.
    pub matching: MatchParams,
    /// Largest difference of heights in the stricter comparison, m.
    pub max_height_difference_m: f64,
    /// Borders between classes of height, m.
    pub height_edges_m: Vec<f64>,
    /// Radius in which the top height is sought that tells the layer of a tree, m.
    pub layer_radius_m: f64,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            seed: 1,
            repeats: 1,
            stands: StandKind::ALL.to_vec(),
            densities_per_m2: vec![2.0, 5.0, 10.0, 20.0, 60.0],
            judged_edge_m: 100.0,
            margin_m: 15.0,
            slope_deg: 6.0,
            crown_scale: 1.0,
            crown_relief: 0.0,
            min_height_m: 2.0,
            matching: MatchParams {
                max_distance_m: 2.0,
                max_height_difference_m: None,
                rule: MatchRule::Optimal,
            },
            max_height_difference_m: 5.0,
            height_edges_m: vec![10.0, 20.0, 30.0],
            layer_radius_m: 10.0,
        }
    }
}

/// One scan of one stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// What grows.
    pub stand: StandKind,
    /// Points wanted, 1/m².
    pub density_per_m2: f64,
    /// Number of the repetition, from 1.
    pub repeat: u32,
}

/// Repetitions beyond which seeds would meet.
const MOST_REPEATS: u32 = 10_000;

impl Experiment {
    /// All cases, by stand, density and repetition.
    #[must_use]
    pub fn cases(&self) -> Vec<Case> {
        let of_stand = |&stand: &StandKind| {
            self.densities_per_m2.iter().flat_map(move |&density_per_m2| {
                (1..=self.repeats).map(move |repeat| Case { stand, density_per_m2, repeat })
            })
        };
        self.stands.iter().flat_map(of_stand).collect()
    }

    /// The rules of the stricter comparison: in dense stands of several layers a found tree that is
    /// none has some true tree within reach by chance, but seldom one of its height.
    #[must_use]
    pub fn matching_with_height(&self) -> MatchParams {
        MatchParams { max_height_difference_m: Some(self.max_height_difference_m), ..self.matching }
    }

    /// The seed of a case's scene: that of its repetition, so that one forest is scanned with all
    /// densities.
    #[must_use]
    pub fn scene_seed(&self, case: &Case) -> u64 {
        u64::from(self.seed) * u64::from(MOST_REPEATS) + u64::from(case.repeat)
    }

    /// Whether the parameters make sense.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that does not.
    pub fn check(&self) -> Result<(), Error> {
        let within = |name, value: f64, low: f64, high: f64, expected| {
            let sound = value >= low && value <= high;
            if sound { Ok(()) } else { Err(Error::Parameter { name, value, expected }) }
        };
        for &density in &self.densities_per_m2 {
            within("density_per_m2", density, 0.2, 2000.0, "0.2 to 2000 points per m²")?;
        }
        let repeats = f64::from(self.repeats);
        within("repeats", repeats, 1.0, f64::from(MOST_REPEATS - 1), "1 to 9999")?;
        within("judged_edge_m", self.judged_edge_m, 10.0, 2000.0, "10 to 2000 m")?;
        within("margin_m", self.margin_m, 0.0, 100.0, "0 to 100 m")?;
        within("crown_scale", self.crown_scale, 0.3, 3.0, "0.3 to 3")?;
        within("crown_relief", self.crown_relief, 0.0, 3.0, "0 to 3")?;
        within("slope_deg", self.slope_deg, 0.0, 45.0, "0 to 45 degrees")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_are_the_product() {
        let experiment = Experiment { repeats: 2, ..Experiment::default() };
        let cases = experiment.cases();
        assert_eq!(cases.len(), 5 * 5 * 2);
        assert_eq!(cases[0].repeat, 1);
        assert_eq!(experiment.scene_seed(&cases[0]), 10_001);
        assert_eq!(experiment.scene_seed(&cases[1]), 10_002);
    }

    #[test]
    fn names_lead_back() {
        for kind in StandKind::ALL {
            assert_eq!(kind.name().parse::<StandKind>().unwrap(), kind);
        }
        let message = "taiga".parse::<StandKind>().unwrap_err().to_string();
        assert!(message.contains("`taiga`") && message.contains("savanna"), "{message}");
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        let wrong = Experiment { densities_per_m2: vec![0.0], ..Experiment::default() };
        assert!(wrong.check().unwrap_err().to_string().contains("density_per_m2"));
        assert!(Experiment::default().check().is_ok());
    }
}
