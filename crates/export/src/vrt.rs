//! GDAL's virtual raster: one file that shows the rasters of all sites as one.

use crate::crs::Horizontal;
use crate::geotiff::{NODATA, RasterSpec, geo_transform};

/// The XML of a mosaic of rasters of one CRS and cell size; `None` when there are none.
///
/// File names are taken relative to the folder of the mosaic.
#[must_use]
pub fn mosaic_xml(rasters: &[(String, RasterSpec<'_>)]) -> Option<String> {
    let (_, first) = rasters.first()?;
    let window = rasters.iter().map(|(_, spec)| spec.window).reduce(|a, b| a.union(&b))?;
    let whole = RasterSpec { window, ..*first };
    let transform = geo_transform(&whole).map(|value| format!("{value:.17e}")).join(", ");
    let sources: String =
        rasters.iter().map(|(name, spec)| source_xml(name, spec, &whole)).collect();
    let (columns, rows) = (window.columns, window.rows);
    let system = Horizontal::of(first.crs);
    let text = match (system.epsg, system.wkt) {
        (Some(code), _) => format!("EPSG:{code}"),
        (None, wkt) => wkt.unwrap_or_default(),
    };
    let system = if text.is_empty() {
        String::new()
    } else {
        format!("  <SRS dataAxisToSRSAxisMapping=\"1,2\">{}</SRS>\n", escape(&text))
    };
    Some(format!(
        "<VRTDataset rasterXSize=\"{columns}\" rasterYSize=\"{rows}\">\n{system}  \
         <GeoTransform>{transform}</GeoTransform>\n  \
         <VRTRasterBand dataType=\"Float32\" band=\"1\">\n    \
         <Description>{}</Description>\n    <NoDataValue>{NODATA}</NoDataValue>\n    \
         <UnitType>{}</UnitType>\n{sources}  </VRTRasterBand>\n</VRTDataset>\n",
        escape(first.description),
        escape(first.unit),
    ))
}

fn source_xml(name: &str, spec: &RasterSpec<'_>, whole: &RasterSpec<'_>) -> String {
    let (columns, rows) = (spec.window.columns, spec.window.rows);
    let x = spec.window.column0 - whole.window.column0;
    let y = whole.window.end_row() - spec.window.end_row();
    format!(
        "    <ComplexSource>\n      <SourceFilename relativeToVRT=\"1\">{}</SourceFilename>\n      \
         <SourceBand>1</SourceBand>\n      \
         <SrcRect xOff=\"0\" yOff=\"0\" xSize=\"{columns}\" ySize=\"{rows}\"/>\n      \
         <DstRect xOff=\"{x}\" yOff=\"{y}\" xSize=\"{columns}\" ySize=\"{rows}\"/>\n      \
         <NODATA>{NODATA}</NODATA>\n    </ComplexSource>\n",
        escape(name)
    )
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Window;
    use timberline_artefact::Crs;

    #[test]
    fn sources_lie_where_their_windows_do() {
        let crs = Crs { epsg: Some(32610), ..Crs::default() };
        let spec = |column0, row0| RasterSpec {
            cell_m: 1.0,
            window: Window { column0, row0, columns: 10, rows: 20 },
            crs: &crs,
            description: "a < b",
            unit: "metre",
            elevation: true,
        };
        let xml = mosaic_xml(&[("a-1.tif".into(), spec(0, 0)), ("a-2.tif".into(), spec(90, 70))])
            .unwrap();
        assert!(xml.contains("rasterXSize=\"100\" rasterYSize=\"90\""));
        assert!(xml.contains("<DstRect xOff=\"0\" yOff=\"70\" xSize=\"10\" ySize=\"20\"/>"));
        assert!(xml.contains("<DstRect xOff=\"90\" yOff=\"0\" xSize=\"10\" ySize=\"20\"/>"));
        assert!(xml.contains("EPSG:32610") && xml.contains("a &lt; b"));
        assert_eq!(mosaic_xml(&[]), None);
    }
}
