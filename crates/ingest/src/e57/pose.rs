//! Where a scanner stood and how it was turned.

use ::e57::Transform;

/// Rotation and translation from the frame of a scan to that of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    rows: [[f64; 3]; 3],
    translation_m: [f64; 3],
}

/// Quaternions are written with so many digits at least.
const UNIT_TOLERANCE: f64 = 1e-6;

impl Pose {
    /// The pose of a scan (ASTM E2807, `RigidBodyTransform`), and what is wrong with it.
    pub(super) fn of(transform: Option<&Transform>) -> (Self, Option<String>) {
        let unturned = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let Some(transform) = transform else {
            return (Self { rows: unturned, translation_m: [0.0; 3] }, None);
        };
        let t = &transform.translation;
        let q = &transform.rotation;
        let translation_m = [t.x, t.y, t.z];
        let norm = (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z).sqrt();
        if !(norm.is_finite() && norm > 0.5) {
            let said =
                format!("the rotation {} {} {} {} is none and not applied", q.w, q.x, q.y, q.z);
            return (Self { rows: unturned, translation_m }, Some(said));
        }
        let off = (norm - 1.0).abs() > UNIT_TOLERANCE;
        let said =
            off.then(|| format!("the rotation has length {norm} and is taken with length 1"));
        let [w, x, y, z] = [q.w, q.x, q.y, q.z].map(|value| value / norm);
        let rows = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        (Self { rows, translation_m }, said)
    }

    /// A position in the frame of the file.
    pub(super) fn apply(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let [a, b, c] = self.rows[axis];
            a * p[0] + b * p[1] + c * p[2] + self.translation_m[axis]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::e57::{Quaternion, Translation};

    #[test]
    fn a_quarter_turn_and_a_step() {
        let half = 0.5f64.sqrt();
        let turn = |scale: f64| Transform {
            rotation: Quaternion { w: half * scale, x: 0.0, y: 0.0, z: half * scale },
            translation: Translation { x: 500_000.0, y: 10.0, z: -1.0 },
        };
        let (pose, said) = Pose::of(Some(&turn(1.0)));
        let [x, y, z] = pose.apply([1.0, 2.0, 3.0]);
        assert!((x - 499_998.0).abs() < 1e-9 && (y - 11.0).abs() < 1e-12 && z == 2.0);
        assert_eq!(said, None);
        let (longer, said) = Pose::of(Some(&turn(1.5)));
        assert!((longer.apply([1.0, 0.0, 0.0])[1] - 11.0).abs() < 1e-12);
        assert!(said.is_some_and(|said| said.contains("length 1.5")));
        assert!(Pose::of(Some(&turn(0.0))).1.is_some());
        assert_eq!(Pose::of(None).0.apply([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    }
}
