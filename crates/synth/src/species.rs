//! Species: how thick, high and wide they grow and how a laser beam sees their crowns.
//!
//! Sizes follow published regressions, but for one species those of the Pacific Northwest. What a crown looks like inside
//! (porosity, branches, extinction) has no such source: those values were chosen so that the shares
//! of ground, first and multiple returns lie in the range of real airborne scans.

use serde::{Deserialize, Serialize};

/// Metres in a foot; the regressions are in feet and inches.
const M_PER_FT: f64 = 0.3048;
/// Centimetres in an inch.
const CM_PER_IN: f64 = 2.54;
/// Height at which diameters are measured in the regressions, ft.
const BREAST_HEIGHT_FT: f64 = 4.5;

/// The habit of a species.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Habit {
    /// A straight leader, whorls, a crown between cone and paraboloid.
    Conifer,
    /// A rounded crown of clumps.
    Broadleaf,
}

/// The species that can be planted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Species {
    /// *Pseudotsuga menziesii*.
    DouglasFir,
    /// *Abies grandis*.
    GrandFir,
    /// *Tsuga heterophylla*.
    WesternHemlock,
    /// *Thuja plicata*.
    WesternRedcedar,
    /// *Acer macrophyllum*.
    BigleafMaple,
    /// *Alnus rubra*.
    RedAlder,
    /// *Quercus garryana*.
    OregonWhiteOak,
    /// *Cornus nuttallii*, a small tree of the understorey.
    PacificDogwood,
    /// *Picea abies*.
    NorwaySpruce,
}

/// Constants of a species.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Traits {
    code: &'static str,
    name: &'static str,
    pub(crate) habit: Habit,
    height: HeightCurve,
    width: OpenWidth,
    /// Exponent of the crown ratio: constant, per ft of crown length, per in/ft of DBH to height.
    width_ratio: [f64; 3],
    pub(crate) shape: Shape,
    pub(crate) foliage: Foliage,
}

/// Mean total height over diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
enum HeightCurve {
    /// `4.5 + p2 exp(-p3 D^p4)`, ft and in: p2, p3, p4.
    CurtisArney([f64; 3]),
    /// `a / (1 + b / D + c / D²)`, m and cm: a, b, c.
    Hyperbolic([f64; 3]),
}

/// Crown width of open-grown trees over diameter.
#[derive(Debug, Clone, Copy, PartialEq)]
enum OpenWidth {
    /// Constant, linear, quadratic, ft and in; and the diameter beyond which it stays, in.
    Quadratic([f64; 3], f64),
    /// `exp(a + b ln D)`, m and cm: a, b.
    Power([f64; 2]),
}

/// How the envelope of a crown is drawn; see [`crate::crown::Profile`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shape {
    /// Range of the straight share of the upper profile (1 is a cone, 0 a paraboloid).
    pub(crate) straight: [f64; 2],
    /// Share of an ellipsoid in the upper profile.
    pub(crate) round: f64,
    /// Share of the crown's length above its widest place.
    pub(crate) upper: f64,
    /// Deviation of the lean of the stem, degrees.
    pub(crate) lean_deg: f64,
}

/// What is inside the envelope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Foliage {
    /// Extinction of a beam within a clump, 1/m.
    pub(crate) extinction_per_m: f64,
    /// Share of the cells of the clump lattice without foliage.
    pub(crate) porosity: f64,
    /// Edge of the clump lattice, m.
    pub(crate) clump_m: f64,
    /// How much further the envelope may reach than a branch, relative to the branch.
    pub(crate) roughness: f64,
    /// How deep the envelope is dented between boughs and leaders where a scene has relief, m.
    pub(crate) relief_m: f64,
    /// Vertical distance of whorls (or of storeys of boughs), m.
    pub(crate) whorl_m: f64,
    /// How far a branch drops (positive) or rises towards its tip, share of the crown radius.
    pub(crate) droop: f64,
    /// How much thinner foliage is halfway between whorls.
    pub(crate) layering: f64,
    /// Density in the bare heart of the crown, relative to its outside.
    pub(crate) inner: f64,
    /// Share of the light thrown back, at the wavelength of the scanner.
    pub(crate) reflectance: f64,
}

const CONIFER_FOLIAGE: Foliage = Foliage {
    extinction_per_m: 1.9,
    porosity: 0.36,
    clump_m: 0.42,
    roughness: 0.42,
    relief_m: 0.6,
    whorl_m: 0.55,
    droop: 0.10,
    layering: 0.55,
    inner: 0.30,
    reflectance: 0.36,
};

const BROADLEAF_FOLIAGE: Foliage = Foliage {
    extinction_per_m: 1.5,
    porosity: 0.42,
    clump_m: 0.60,
    roughness: 0.35,
    relief_m: 1.2,
    whorl_m: 1.6,
    droop: -0.25,
    layering: 0.20,
    inner: 0.35,
    reflectance: 0.48,
};

const CONIFER_SHAPE: Shape =
    Shape { straight: [0.55, 0.85], round: 0.0, upper: 0.88, lean_deg: 1.0 };
const BROADLEAF_SHAPE: Shape =
    Shape { straight: [0.0, 0.2], round: 0.75, upper: 0.6, lean_deg: 3.0 };

// Heights: FVS Staff 2008, Pacific Northwest Coast variant overview, section 4.1, location 709
// (BLM Eugene). Maximum crown widths: Paine and Hann 1982 (Douglas-fir, grand fir, hemlock, oak,
// and chinkapin standing for dogwood), Smith 1966 (redcedar, alder), Ek 1974 (maple). Crown width in
// the stand: Hann 1997 (incense-cedar standing for redcedar), Johnson 2002 (hemlock).
const DOUGLAS_FIR: Traits = Traits {
    code: "PSME",
    name: "Pseudotsuga menziesii",
    habit: Habit::Conifer,
    height: HeightCurve::CurtisArney([439.1195, 5.8176, -0.4854]),
    width: OpenWidth::Quadratic([4.6198, 1.8426, -0.011311], 81.45),
    width_ratio: [0.0, 0.004_363_24, 0.602_002],
    shape: CONIFER_SHAPE,
    foliage: CONIFER_FOLIAGE,
};
const GRAND_FIR: Traits = Traits {
    code: "ABGR",
    name: "Abies grandis",
    habit: Habit::Conifer,
    height: HeightCurve::CurtisArney([432.2186, 6.2941, -0.5028]),
    width: OpenWidth::Quadratic([6.188, 1.0069, 0.0], 999.99),
    width_ratio: [0.0, 0.003_084_02, 0.0],
    shape: Shape { straight: [0.4, 0.7], upper: 0.92, ..CONIFER_SHAPE },
    foliage: Foliage { extinction_per_m: 2.2, porosity: 0.3, droop: 0.0, ..CONIFER_FOLIAGE },
};
const WESTERN_HEMLOCK: Traits = Traits {
    code: "TSHE",
    name: "Tsuga heterophylla",
    habit: Habit::Conifer,
    height: HeightCurve::CurtisArney([395.4976, 6.4222, -0.532]),
    width: OpenWidth::Quadratic([4.5652, 1.4147, 0.0], 76.7),
    width_ratio: [0.105_59, 0.003_566_2, 0.0],
    shape: Shape { straight: [0.35, 0.65], upper: 0.9, lean_deg: 1.3, ..CONIFER_SHAPE },
    foliage: Foliage { roughness: 0.32, layering: 0.4, droop: 0.18, ..CONIFER_FOLIAGE },
};
const WESTERN_REDCEDAR: Traits = Traits {
    code: "THPL",
    name: "Thuja plicata",
    habit: Habit::Conifer,
    height: HeightCurve::CurtisArney([1012.127, 6.0957, -0.3083]),
    width: OpenWidth::Quadratic([4.0, 1.65, 0.0], 999.99),
    width_ratio: [-0.251_389, 0.006_925_12, 0.985_922],
    shape: Shape { straight: [0.3, 0.6], upper: 0.9, ..CONIFER_SHAPE },
    foliage: Foliage { layering: 0.3, droop: 0.2, porosity: 0.3, ..CONIFER_FOLIAGE },
};
const BIGLEAF_MAPLE: Traits = Traits {
    code: "ACMA3",
    name: "Acer macrophyllum",
    habit: Habit::Broadleaf,
    height: HeightCurve::CurtisArney([160.2171, 3.3044, -0.5299]),
    width: OpenWidth::Quadratic([4.0953, 2.3849, -0.010_265_1], 102.53),
    width_ratio: [0.0, 0.0, 1.470_18],
    shape: BROADLEAF_SHAPE,
    foliage: BROADLEAF_FOLIAGE,
};
const RED_ALDER: Traits = Traits {
    code: "ALRU2",
    name: "Alnus rubra",
    habit: Habit::Broadleaf,
    height: HeightCurve::CurtisArney([10_099.72, 7.6375, -0.1621]),
    width: OpenWidth::Quadratic([8.0, 1.53, 0.0], 999.99),
    width_ratio: [0.322_714, 0.0, 0.0],
    shape: Shape { straight: [0.1, 0.35], round: 0.5, upper: 0.7, lean_deg: 2.5 },
    foliage: Foliage { porosity: 0.48, ..BROADLEAF_FOLIAGE },
};
const OREGON_WHITE_OAK: Traits = Traits {
    code: "QUGA4",
    name: "Quercus garryana",
    habit: Habit::Broadleaf,
    height: HeightCurve::CurtisArney([89.4301, 6.6321, -0.8876]),
    width: OpenWidth::Quadratic([3.0786, 1.9242, 0.0], 999.99),
    width_ratio: [0.364_811, 0.0, 0.0],
    shape: Shape { round: 0.9, ..BROADLEAF_SHAPE },
    foliage: BROADLEAF_FOLIAGE,
};
const PACIFIC_DOGWOOD: Traits = Traits {
    code: "CONU4",
    name: "Cornus nuttallii",
    habit: Habit::Broadleaf,
    height: HeightCurve::CurtisArney([444.5618, 3.9205, -0.2397]),
    width: OpenWidth::Quadratic([2.9794, 1.5512, -0.014_161], 54.77),
    width_ratio: [0.0, 0.0, 1.6144],
    shape: Shape { upper: 0.65, ..BROADLEAF_SHAPE },
    foliage: Foliage { whorl_m: 1.0, porosity: 0.5, ..BROADLEAF_FOLIAGE },
};
// Height: Pukkala, Lähde and Laiho 2009 (Forest Ecology and Management 258), Norway spruce on sites of
// the Myrtillus type. Width of open-grown trees: Hasenauer 1997 (Forest Ecology and Management 96).
// Its reduction by the crown ratio has no source for the species: that of Douglas-fir.
const NORWAY_SPRUCE: Traits = Traits {
    code: "PIAB",
    name: "Picea abies",
    habit: Habit::Conifer,
    height: HeightCurve::Hyperbolic([33.726 + 5.965, 25.683, 37.785]),
    width: OpenWidth::Power([-0.3232, 0.6441]),
    width_ratio: [0.0, 0.004_363_24, 0.602_002],
    shape: Shape { straight: [0.6, 0.9], upper: 0.9, ..CONIFER_SHAPE },
    foliage: Foliage { extinction_per_m: 2.1, porosity: 0.32, droop: 0.2, ..CONIFER_FOLIAGE },
};

impl Species {
    /// All species, in order.
    pub const ALL: [Self; 9] = [
        Self::DouglasFir,
        Self::GrandFir,
        Self::WesternHemlock,
        Self::WesternRedcedar,
        Self::BigleafMaple,
        Self::RedAlder,
        Self::OregonWhiteOak,
        Self::PacificDogwood,
        Self::NorwaySpruce,
    ];

    pub(crate) const fn traits(self) -> &'static Traits {
        match self {
            Self::DouglasFir => &DOUGLAS_FIR,
            Self::GrandFir => &GRAND_FIR,
            Self::WesternHemlock => &WESTERN_HEMLOCK,
            Self::WesternRedcedar => &WESTERN_REDCEDAR,
            Self::BigleafMaple => &BIGLEAF_MAPLE,
            Self::RedAlder => &RED_ALDER,
            Self::OregonWhiteOak => &OREGON_WHITE_OAK,
            Self::PacificDogwood => &PACIFIC_DOGWOOD,
            Self::NorwaySpruce => &NORWAY_SPRUCE,
        }
    }

    /// Code of the USDA PLANTS database.
    #[must_use]
    pub const fn code(self) -> &'static str {
        self.traits().code
    }

    /// Scientific name.
    #[must_use]
    pub const fn scientific_name(self) -> &'static str {
        self.traits().name
    }

    /// Conifer or broadleaf.
    #[must_use]
    pub const fn habit(self) -> Habit {
        self.traits().habit
    }

    /// Mean total height in metres of a diameter at breast height.
    ///
    /// Curtis-Arney form `4.5 + p2 exp(-p3 D^p4)` (feet, inches), straight from 4.51 ft at 0.3 in
    /// to its value at 3 in (FVS Staff 2008, Pacific Northwest Coast variant, section 4.1). Norway
    /// spruce: the curve of Pukkala et al. 2009, straight below 3 in likewise.
    #[must_use]
    pub fn height_m(self, dbh_cm: f64) -> f64 {
        let curve = |d_in: f64| match self.traits().height {
            HeightCurve::CurtisArney([p2, p3, p4]) => {
                BREAST_HEIGHT_FT + p2 * libm::exp(-p3 * libm::pow(d_in, p4))
            }
            HeightCurve::Hyperbolic([a, b, c]) => {
                let d = d_in * CM_PER_IN;
                a / (1.0 + b / d + c / (d * d)) / M_PER_FT
            }
        };
        let d_in = dbh_cm / CM_PER_IN;
        let height_ft = if d_in >= 3.0 {
            curve(d_in)
        } else {
            4.51 + (curve(3.0) - 4.51) * ((d_in - 0.3) / 2.7).max(0.0)
        };
        height_ft * M_PER_FT
    }

    /// Mean largest crown width in metres of a tree in a stand: the width of open-grown trees of
    /// its diameter, reduced by its crown ratio (Hann 1997, Forest Research Laboratory, Oregon
    /// State University, Research Contribution 17).
    #[must_use]
    pub fn crown_width_m(self, dbh_cm: f64, height_m: f64, crown_ratio: f64) -> f64 {
        let traits = self.traits();
        let dbh_in = dbh_cm / CM_PER_IN;
        let open_ft = match traits.width {
            OpenWidth::Quadratic([a0, a1, a2], limit_in) => {
                let d = dbh_in.min(limit_in);
                a0 + a1 * d + a2 * d * d
            }
            OpenWidth::Power([a, b]) => libm::exp(a + b * libm::log(dbh_cm)) / M_PER_FT,
        };
        let height_ft = height_m / M_PER_FT;
        let [b1, b2, b3] = traits.width_ratio;
        let exponent = b1 + b2 * crown_ratio * height_ft + b3 * dbh_in / height_ft;
        open_ft * libm::pow(crown_ratio, exponent) * M_PER_FT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_known_trees() {
        // The regressions evaluated apart: Douglas-fir of 10 in, maple of 20 in, ft.
        assert!((Species::DouglasFir.height_m(25.4) / 0.3048 - 70.009).abs() < 1e-3);
        assert!((Species::BigleafMaple.height_m(50.8) / 0.3048 - 86.028_3).abs() < 1e-3);
        // An open-grown tree (crown ratio 1) has the maximum crown width.
        let open = Species::DouglasFir.crown_width_m(25.4, 20.0, 1.0) / 0.3048;
        assert!((open - (4.6198 + 18.426 - 1.1311)).abs() < 1e-9);
        // Norway spruce of 25 cm: 39.691 / 2.087776 m; open-grown width e^-0.3232 25^0.6441 m.
        assert!((Species::NorwaySpruce.height_m(25.0) - 19.011_139).abs() < 1e-5);
        assert!((Species::NorwaySpruce.crown_width_m(25.0, 19.0, 1.0) - 5.755051).abs() < 1e-5);
    }

    #[test]
    fn every_species_grows() {
        for species in Species::ALL {
            let mut before = 1.3;
            for dbh in 1..120 {
                let height = species.height_m(f64::from(dbh));
                assert!(height >= before && height < 70.0, "{species:?} {dbh} {height}");
                before = height;
            }
        }
    }
}
