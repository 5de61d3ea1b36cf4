//! What users take away: tables, GIS layers, rasters and point clouds.
