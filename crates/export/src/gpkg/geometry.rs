//! Geometries as GeoPackage blobs (OGC 12-128r17, 2.1.3): a header, then little-endian WKB.

/// A geometry in coordinates of the layer's CRS.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// A position with an elevation.
    Point([f64; 3]),
    /// A polygon without holes: counter-clockwise corners, the first not repeated.
    Polygon(Vec<[f64; 2]>),
}

/// Flags of the header: little-endian, envelope of x and y.
const FLAGS_WITH_ENVELOPE: u8 = 0b0000_0011;
/// Flags of the header: little-endian, no envelope (for points it would only repeat them).
const FLAGS_PLAIN: u8 = 0b0000_0001;
/// WKB codes of ISO 13249-3.
const WKB_POINT_Z: u32 = 1001;
const WKB_POLYGON: u32 = 3;

impl Geometry {
    /// Minimum and maximum of x, then of y.
    #[must_use]
    pub fn bounds(&self) -> [f64; 4] {
        match self {
            Self::Point([x, y, _]) => [*x, *x, *y, *y],
            Self::Polygon(ring) => ring.iter().fold(
                [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY],
                |b, [x, y]| [b[0].min(*x), b[1].max(*x), b[2].min(*y), b[3].max(*y)],
            ),
        }
    }

    /// The blob that goes into the geometry column.
    #[must_use]
    pub fn blob(&self, srs_id: i32) -> Vec<u8> {
        let mut blob = b"GP\0".to_vec();
        match self {
            Self::Point(position) => {
                blob.push(FLAGS_PLAIN);
                blob.extend(srs_id.to_le_bytes());
                wkb_header(&mut blob, WKB_POINT_Z);
                position.iter().for_each(|value| blob.extend(value.to_le_bytes()));
            }
            Self::Polygon(ring) => {
                blob.push(FLAGS_WITH_ENVELOPE);
                blob.extend(srs_id.to_le_bytes());
                self.bounds().iter().for_each(|value| blob.extend(value.to_le_bytes()));
                wkb_header(&mut blob, WKB_POLYGON);
                blob.extend(1_u32.to_le_bytes());
                blob.extend((ring.len() as u32 + 1).to_le_bytes());
                let closed = ring.iter().chain(ring.first());
                closed.flatten().for_each(|value| blob.extend(value.to_le_bytes()));
            }
        }
        blob
    }
}

fn wkb_header(blob: &mut Vec<u8>, code: u32) {
    blob.push(1);
    blob.extend(code.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point() {
        let blob = Geometry::Point([1.0, 2.0, 3.0]).blob(4326);
        assert_eq!(&blob[..8], [b'G', b'P', 0, 1, 0xE6, 0x10, 0, 0]);
        assert_eq!(&blob[8..13], [1, 0xE9, 3, 0, 0]);
        assert_eq!(blob.len(), 8 + 5 + 24);
    }

    #[test]
    fn a_polygon_is_closed_and_has_an_envelope() {
        let polygon = Geometry::Polygon(vec![[0.0, 0.0], [4.0, 0.0], [1.0, 3.0]]);
        assert_eq!(polygon.bounds(), [0.0, 4.0, 0.0, 3.0]);
        let blob = polygon.blob(-1);
        assert_eq!(blob.len(), 8 + 32 + 5 + 8 + 4 * 16);
        assert_eq!(blob[49..53], 4_u32.to_le_bytes());
        assert_eq!(blob[53..69], blob[blob.len() - 16..]);
    }
}
