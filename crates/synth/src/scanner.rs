//! The airborne scanner: parameters, flight lines, the direction of every pulse.

use crate::Error;
use crate::error::check;
use crate::foliage::Ray;
use crate::noise::line_noise;
use crate::random::{Domain, Stream};
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Rect;

/// A discrete-return scanner with a rotating mirror over parallel flight lines.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScannerParams {
    /// Flying height above the mean ground, m.
    pub altitude_m: f64,
    /// Largest scan angle to either side, degrees.
    pub half_angle_deg: f64,
    /// Share of a swath that its neighbour covers too.
    pub sidelap: f64,
    /// Direction of the first flight line, degrees from east towards north.
    pub heading_deg: f64,
    /// Speed over ground, m/s.
    pub speed_m_s: f64,
    /// Pulses per second that leave within the scan angle.
    pub pulse_rate_hz: f64,
    /// Sweeps of the mirror per second.
    pub sweep_rate_hz: f64,
    /// Full divergence of the beam at 1/e² of its intensity, mrad.
    pub divergence_mrad: f64,
    /// Smallest range between two returns of a pulse (the dead time of the detector), m.
    pub resolution_m: f64,
    /// Most returns of a pulse that are recorded.
    pub max_returns: u8,
    /// Smallest share of the light of a pulse that makes a return.
    pub sensitivity: f64,
    /// Deviation of ranges, m.
    pub range_noise_m: f64,
    /// Deviation of positions in the plane, one for all returns of a pulse, m.
    pub horizontal_noise_m: f64,
    /// Deviation of whole flight lines in x, y and z, m.
    pub strip_noise_m: f64,
    /// Largest roll and pitch of the aircraft, degrees.
    pub attitude_deg: f64,
    /// Pulses thrown back above the canopy (birds), as a share.
    pub high_outliers: f64,
    /// Pulses with too long a way (multipath), as a share.
    pub low_outliers: f64,
    /// Share of the outliers that the supplier has found and classified (7 low, 18 high).
    pub outliers_found: f64,
    /// Share of those that are flagged as withheld, too.
    pub outliers_withheld: f64,
    /// Sets the true class (2 ground, 3 to 5 vegetation by height) instead of 1.
    pub true_classes: bool,
    /// Flags points beyond the middle between two flight lines as overlap.
    pub flag_overlap: bool,
    /// Scale of the intensity.
    pub intensity_scale: f64,
    /// Positions are rounded to this many units of 0.1 mm.
    pub position_ticks: u32,
    /// Time of the first pulse (adjusted standard GPS time), s.
    pub first_time_s: f64,
}

impl Default for ScannerParams {
    /// A survey of 8 pulses per square metre from 600 m, every place seen about twice.
    fn default() -> Self {
        Self {
            altitude_m: 600.0,
            half_angle_deg: 16.0,
            sidelap: 0.5,
            heading_deg: 0.0,
            speed_m_s: 60.0,
            pulse_rate_hz: 0.0,
            sweep_rate_hz: 0.0,
            divergence_mrad: 0.45,
            resolution_m: 2.2,
            max_returns: 5,
            sensitivity: 0.06,
            range_noise_m: 0.015,
            horizontal_noise_m: 0.06,
            strip_noise_m: 0.02,
            attitude_deg: 0.8,
            high_outliers: 1.5e-5,
            low_outliers: 3e-5,
            outliers_found: 0.5,
            outliers_withheld: 0.4,
            true_classes: false,
            flag_overlap: false,
            intensity_scale: 900.0,
            position_ticks: 100,
            first_time_s: 310_000_000.0,
        }
        .with_density(8.0)
    }
}

impl ScannerParams {
    /// Sets pulse rate and sweep rate for a mean number of pulses per square metre of level ground,
    /// with equal distances of pulses along and across the flight line.
    #[must_use]
    pub fn with_density(mut self, pulses_per_m2: f64) -> Self {
        let rate = pulses_per_m2 * self.speed_m_s * self.line_spacing_m();
        let sweeps = (self.speed_m_s * rate / self.swath_m()).sqrt();
        let pulses_per_sweep = (rate / sweeps).round().max(1.0);
        self.pulse_rate_hz = rate;
        self.sweep_rate_hz = rate / pulses_per_sweep;
        self
    }

    /// A perfect instrument: no noise, no outliers, a beam without width.
    #[must_use]
    pub fn without_errors(self) -> Self {
        Self {
            divergence_mrad: 0.0,
            range_noise_m: 0.0,
            horizontal_noise_m: 0.0,
            strip_noise_m: 0.0,
            high_outliers: 0.0,
            low_outliers: 0.0,
            position_ticks: 1,
            ..self
        }
    }

    /// Mean number of pulses per square metre of level ground.
    #[must_use]
    pub fn density_per_m2(&self) -> f64 {
        self.pulse_rate_hz / (self.speed_m_s * self.line_spacing_m())
    }

    /// Width of a swath on level ground, m.
    #[must_use]
    pub fn swath_m(&self) -> f64 {
        2.0 * self.altitude_m * libm::tan(self.half_angle_deg.to_radians())
    }

    /// Distance of flight lines, m.
    #[must_use]
    pub fn line_spacing_m(&self) -> f64 {
        self.swath_m() * (1.0 - self.sidelap)
    }

    /// Radius of the footprint on level ground at 1/e² of its intensity, m.
    #[must_use]
    pub fn footprint_radius_m(&self) -> f64 {
        0.5e-3 * self.divergence_mrad * self.altitude_m
    }

    pub(crate) fn pulses_per_sweep(&self) -> u32 {
        (self.pulse_rate_hz / self.sweep_rate_hz).round().max(1.0) as u32
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        check("altitude_m", self.altitude_m, 100.0..=10_000.0, "100 to 10000 m")?;
        check("half_angle_deg", self.half_angle_deg, 1.0..=28.0, "1 to 28 degrees")?;
        check("sidelap", self.sidelap, 0.0..=0.9, "0 to 0.9")?;
        check("speed_m_s", self.speed_m_s, 1.0..=300.0, "1 to 300 m/s")?;
        check("pulse_rate_hz", self.pulse_rate_hz, 100.0..=1e7, "100 to 10,000,000 Hz")?;
        check(
            "sweep_rate_hz",
            self.sweep_rate_hz,
            1.0..=self.pulse_rate_hz,
            "1 Hz to the pulse rate",
        )?;
        check("footprint radius", self.footprint_radius_m(), 0.0..=0.45, "at most 0.45 m")?;
        check("resolution_m", self.resolution_m, 0.01..=10.0, "0.01 to 10 m")?;
        check("max_returns", f64::from(self.max_returns), 1.0..=15.0, "1 to 15")?;
        check("attitude_deg", self.attitude_deg, 0.0..=2.0, "0 to 2 degrees")?;
        check("high_outliers", self.high_outliers, 0.0..=0.1, "0 to 0.1")?;
        check("low_outliers", self.low_outliers, 0.0..=0.1, "0 to 0.1")?;
        check("position_ticks", f64::from(self.position_ticks), 1.0..=10_000.0, "1 to 10000")
    }
}

/// One flight line, in the scene's frame.
#[derive(Debug, Clone)]
pub(crate) struct Line {
    /// From 1.
    pub(crate) source_id: u16,
    start: [f64; 2],
    along: [f64; 2],
    right: [f64; 2],
    /// Elevation of the aircraft.
    z: f64,
    pub(crate) sweeps: u32,
    first_time_s: f64,
    /// Error of the whole line.
    pub(crate) error_m: [f64; 3],
    salt: u64,
}

/// All flight lines and the mirror's angles.
#[derive(Debug, Clone)]
pub(crate) struct Flight {
    pub(crate) params: ScannerParams,
    pub(crate) lines: Vec<Line>,
    /// Sine and cosine of the mirror's angle for every pulse of a sweep.
    angles: Vec<[f64; 2]>,
}

/// The state of a line during one sweep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sweep {
    pub(crate) index: u32,
    roll: f64,
    roll_sin_cos: [f64; 2],
    pitch_sin_cos: [f64; 2],
}

/// Between starts of flight lines, s.
const TURN_S: f64 = 240.0;
/// Room before and after the area, m.
const RUN_IN_M: f64 = 40.0;
/// Periods of roll and pitch, s.
const ROLL_PERIOD_S: f64 = 1.3;
const PITCH_PERIOD_S: f64 = 2.1;

impl Flight {
    /// Lays lines over an area, such that all of it has the sidelap.
    pub(crate) fn plan(params: &ScannerParams, area: &Rect, ground_m: f64, seed: u64) -> Self {
        let (sin, cos) = libm::sincos(params.heading_deg.to_radians());
        let centre = [0, 1].map(|i| 0.5 * (area.min[i] + area.max[i]));
        let [width, height] = area.size();
        let length = cos.abs() * width + sin.abs() * height;
        let across = sin.abs() * width + cos.abs() * height;
        let spacing = params.line_spacing_m();
        let count = ((across + params.swath_m() - spacing) / spacing).ceil().max(1.0) as u32;
        let pitch_reach = params.altitude_m * libm::tan(params.attitude_deg.to_radians());
        let run = length + 2.0 * (RUN_IN_M + pitch_reach);
        let sweeps = (run / params.speed_m_s * params.sweep_rate_hz).ceil() as u32;
        let line = |index: u32| {
            let offset = (f64::from(index) - 0.5 * f64::from(count - 1)) * spacing;
            let middle = [centre[0] - sin * offset, centre[1] + cos * offset];
            let sign = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            let along = [sign * cos, sign * sin];
            let mut stream = Stream::new(seed, Domain::Line, u64::from(index));
            Line {
                source_id: index as u16 + 1,
                start: [0, 1].map(|i| middle[i] - 0.5 * run * along[i]),
                along,
                right: [along[1], -along[0]],
                z: ground_m + params.altitude_m,
                sweeps,
                first_time_s: params.first_time_s
                    + f64::from(index) * (TURN_S + run / params.speed_m_s).ceil(),
                error_m: std::array::from_fn(|_| params.strip_noise_m * stream.normal()),
                salt: stream.bits(),
            }
        };
        let pulses = params.pulses_per_sweep();
        let half = params.half_angle_deg.to_radians();
        let angle = |pulse: u32| half * ((2.0 * f64::from(pulse) + 1.0) / f64::from(pulses) - 1.0);
        let angles = (0..pulses).map(|pulse| libm::sincos(angle(pulse)).into()).collect();
        Self { params: params.clone(), lines: (0..count).map(line).collect(), angles }
    }

    /// The sweeps of a line that may see something of a rectangle between two elevations.
    pub(crate) fn sweeps_over(
        &self,
        line: &Line,
        rect: &Rect,
        lowest: f64,
    ) -> std::ops::Range<u32> {
        let step = self.params.speed_m_s / self.params.sweep_rate_hz;
        let pitch = (line.z - lowest) * libm::tan(self.params.attitude_deg.to_radians());
        let (low, high) = spread(rect, line.start, line.along);
        let first = ((low - pitch) / step).floor() - 1.0;
        let last = ((high + pitch) / step).ceil() + 1.0;
        (first.max(0.0) as u32)..(last.max(0.0) as u32).min(line.sweeps)
    }

    /// The line's attitude during a sweep.
    pub(crate) fn sweep(&self, line: &Line, index: u32) -> Sweep {
        let time = f64::from(index) / self.params.sweep_rate_hz;
        let largest = self.params.attitude_deg.to_radians();
        let roll = largest * line_noise(time / ROLL_PERIOD_S, line.salt).0;
        let pitch = largest * line_noise(time / PITCH_PERIOD_S, !line.salt).0;
        Sweep {
            index,
            roll,
            roll_sin_cos: libm::sincos(roll).into(),
            pitch_sin_cos: libm::sincos(pitch).into(),
        }
    }

    /// The pulses of a sweep that may see something of a rectangle between two elevations.
    pub(crate) fn pulses_over(
        &self,
        line: &Line,
        sweep: &Sweep,
        rect: &Rect,
        z: [f64; 2],
    ) -> std::ops::Range<u32> {
        let (low, high) = spread(rect, line.start, line.right);
        let angle = |across: f64, z: f64| libm::atan2(across, line.z - z) - sweep.roll;
        let first = angle(low, z[0]).min(angle(low, z[1]));
        let last = angle(high, z[0]).max(angle(high, z[1]));
        let half = self.params.half_angle_deg.to_radians();
        let count = self.angles.len() as f64;
        let pulse = |angle: f64| (angle / half + 1.0) * 0.5 * count;
        // Pitch makes the way down a little longer than `angle` assumes: by less than 0.1 %.
        let slack = 2.0 + 0.001 * count;
        let first = (pulse(first) - slack).floor().clamp(0.0, count);
        let last = (pulse(last) + slack).ceil().clamp(0.0, count);
        first as u32..last as u32
    }

    /// The beam of a pulse.
    pub(crate) fn ray(&self, line: &Line, sweep: &Sweep, pulse: u32) -> Ray {
        let way = self.params.speed_m_s * self.seconds(sweep, pulse);
        let ([sin, cos], [roll_sin, roll_cos]) = (self.angles[pulse as usize], sweep.roll_sin_cos);
        let [pitch_sin, pitch_cos] = sweep.pitch_sin_cos;
        let side = sin * roll_cos + cos * roll_sin;
        let down = cos * roll_cos - sin * roll_sin;
        let ahead = down * pitch_sin;
        Ray {
            origin: [
                line.start[0] + way * line.along[0],
                line.start[1] + way * line.along[1],
                line.z,
            ],
            direction: [
                side * line.right[0] + ahead * line.along[0],
                side * line.right[1] + ahead * line.along[1],
                -down * pitch_cos,
            ],
        }
    }

    fn seconds(&self, sweep: &Sweep, pulse: u32) -> f64 {
        self.pulse_number(sweep, pulse) as f64 / self.params.pulse_rate_hz
    }

    /// Number of a pulse in its line.
    pub(crate) fn pulse_number(&self, sweep: &Sweep, pulse: u32) -> u64 {
        u64::from(sweep.index) * self.angles.len() as u64 + u64::from(pulse)
    }

    /// GPS time of a pulse, s, in whole microseconds.
    pub(crate) fn time_s(&self, line: &Line, sweep: &Sweep, pulse: u32) -> f64 {
        line.first_time_s + (self.seconds(sweep, pulse) * 1e6).round() * 1e-6
    }

    /// Scan angle including roll, degrees, in the steps of LAS 1.4 (0.006).
    pub(crate) fn angle_deg(&self, sweep: &Sweep, pulse: u32) -> f32 {
        let share = (2.0 * f64::from(pulse) + 1.0) / self.angles.len() as f64 - 1.0;
        let angle = share * self.params.half_angle_deg + sweep.roll.to_degrees();
        ((angle / 0.006).round() * 0.006) as f32
    }

    /// Whether a pulse is the first or the last of its sweep.
    pub(crate) fn is_edge(&self, pulse: u32) -> bool {
        pulse == 0 || pulse as usize + 1 == self.angles.len()
    }

    /// Whether a position is nearer to another line than to this one.
    pub(crate) fn is_overlap(&self, line: &Line, at: [f64; 2]) -> bool {
        let across =
            (at[0] - line.start[0]) * line.right[0] + (at[1] - line.start[1]) * line.right[1];
        let outer = if line.source_id % 2 == 1 { 1.0 } else { -1.0 };
        let first_side = line.source_id == 1 && across * outer > 0.0;
        let last_side = usize::from(line.source_id) == self.lines.len() && across * outer < 0.0;
        across.abs() > 0.5 * self.params.line_spacing_m() && !first_side && !last_side
    }
}

/// Range of a rectangle's corners along a direction from a position.
fn spread(rect: &Rect, from: [f64; 2], direction: [f64; 2]) -> (f64, f64) {
    let corners = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| {
        let x = [rect.min[0], rect.max[0]][i] - from[0];
        let y = [rect.min[1], rect.max[1]][j] - from[1];
        x * direction[0] + y * direction[1]
    });
    corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
        (low.min(value), high.max(value))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_give_the_density() {
        let params = ScannerParams::default().with_density(5.0);
        assert!((params.density_per_m2() - 5.0).abs() < 1e-9);
        let along = params.speed_m_s / params.sweep_rate_hz;
        let across = params.swath_m() / f64::from(params.pulses_per_sweep());
        assert!((along / across - 1.0).abs() < 0.01, "{along} {across}");
    }

    #[test]
    fn rays_are_unit_vectors_within_the_selected_pulses() {
        let params = ScannerParams { heading_deg: 33.0, ..ScannerParams::default() };
        let area = Rect { min: [0.0; 2], max: [400.0, 300.0] };
        let flight = Flight::plan(&params, &area, 100.0, 4);
        let rect = Rect { min: [120.0, 80.0], max: [180.0, 140.0] };
        let mut inside = 0;
        for line in &flight.lines {
            let chosen = flight.sweeps_over(line, &rect, 90.0);
            for index in (0..line.sweeps).step_by(3) {
                let sweep = flight.sweep(line, index);
                let pulses = flight.pulses_over(line, &sweep, &rect, [90.0, 140.0]);
                for pulse in 0..params.pulses_per_sweep() {
                    let ray = flight.ray(line, &sweep, pulse);
                    let length: f64 = ray.direction.iter().map(|d| d * d).sum();
                    assert!((length - 1.0).abs() < 1e-12);
                    let sees = [90.0, 140.0].iter().any(|&z| {
                        let [x, y, _] = ray.at(ray.range_at(z));
                        rect.contains(x, y)
                    });
                    inside += u32::from(sees);
                    assert!(!sees || (chosen.contains(&index) && pulses.contains(&pulse)));
                }
            }
        }
        assert!(inside > 5000, "{inside}");
    }
}
