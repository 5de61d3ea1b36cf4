#!/usr/bin/env python3
"""Checks a folder of outputs with other programs' readers: GDAL (rasterio, pyogrio) and laspy.

Usage: check_outputs.py OUTPUTS_FOLDER

    pip install rasterio pyogrio 'laspy[lazrs]' numpy

Prints one line for every file; exits with 1 and the reasons when something does not hold.
"""

import csv
import glob
import os
import sqlite3
import sys

import laspy
import numpy as np
import pyogrio
import rasterio

NODATA = -9999.0
failures = []


def expect(holds, what):
    """Notes a failure without stopping."""
    if not holds:
        failures.append(what)


def read_table(folder):
    """trees.csv: every column described, ids sorted and unique, fixed decimals."""
    with open(os.path.join(folder, "trees.csv"), newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with open(os.path.join(folder, "trees.dictionary.csv"), newline="", encoding="utf-8") as file:
        dictionary = {row["column"]: row for row in csv.DictReader(file)}
    if rows:
        expect(list(rows[0]) == list(dictionary), "trees.csv: columns differ from the dictionary")
    ids = [int(row["tree_id"]) for row in rows]
    expect(ids == sorted(set(ids)), "trees.csv: ids are not sorted or not unique")
    expect(all(0 < i < 2**53 for i in ids), "trees.csv: an id is not between 0 and 2^53")
    for row in rows:
        for name, text in row.items():
            kind = dictionary[name]["type"]
            if text and kind.startswith("number"):
                decimals = int(kind.split(",")[1].split()[0])
                expect(len(text.split(".")[1]) == decimals, f"trees.csv: {name} = {text}")
    check_fits(rows, dictionary)
    print(f"trees.csv          {len(rows)} trees, {len(dictionary)} columns")
    return rows


def check_fits(rows, dictionary):
    """trees.csv: what is said about the fitted surfaces agrees with itself."""

    def words(column):
        return set(dictionary[column]["range"].split(", "))

    def number(row, name):
        return float(row[name]) if row[name] else None

    fitted = 0
    for row in rows:
        tree = f"trees.csv: tree {row['tree_id']}"
        expect(row["stem_source"] in words("stem_source"), f"{tree}: {row['stem_source']}")
        expect(set(row["flags"].split()) <= words("flags"), f"{tree}: {row['flags']}")
        larger, smaller = number(row, "semi_axis_a_m"), number(row, "semi_axis_b_m")
        expect((larger is None) == (smaller is None), f"{tree}: one semi-axis only")
        rotation = number(row, "rotation_deg")
        if rotation is not None:
            expect(larger is not None, f"{tree}: a rotation without axes")
            expect(0.0 <= rotation < 180.0, f"{tree}: rotation of {rotation} degrees")
        if larger is not None:
            expect(larger >= smaller > 0.0, f"{tree}: semi-axes {larger} and {smaller}")
            expect(row["surface_x"] and row["surface_z"], f"{tree}: axes without a centre")
        gap = number(row, "fit_gap")
        expect(gap is None or gap <= 1e-6, f"{tree}: certified gap {gap}")
        total, mean = number(row, "fit_objective_m"), number(row, "fit_residual_m")
        if total is not None:
            off = abs(total - mean * int(row["fit_cells"]))
            expect(off <= 0.0005 * (int(row["fit_cells"]) + 2), f"{tree}: {mean} is no mean of {total}")
        fitted += row["stem_source"] in ("l1", "l2")
    print(f"trees.csv          {fitted} stems from a fitted surface")


def check_package(folder, rows):
    """trees.gpkg: valid SQLite, layers as GDAL reads them, the same values as the table."""
    path = os.path.join(folder, "trees.gpkg")
    database = sqlite3.connect(path)
    expect(database.execute("PRAGMA integrity_check").fetchone()[0] == "ok", "trees.gpkg: corrupt")
    expect(not database.execute("PRAGMA foreign_key_check").fetchall(), "trees.gpkg: foreign keys")
    layers = {name for name, _ in pyogrio.list_layers(path)}
    expect({"treetops", "crowns", "run"} <= layers, f"trees.gpkg: layers are {sorted(layers)}")
    by_id = {int(row["tree_id"]): row for row in rows}
    for layer, geometry in [("treetops", "Point Z"), ("crowns", "Polygon")]:
        meta, _, shapes, fields = pyogrio.raw.read(path, layer=layer)
        names = [str(name) for name in meta["fields"]]
        expect(meta["geometry_type"] == geometry, f"{layer}: {meta['geometry_type']}")
        columns = dict(zip(names, fields))
        ids = [int(i) for i in columns["tree_id"]]
        if layer == "treetops":
            expect(ids == list(by_id), "treetops: not the trees of trees.csv")
        expect(set(ids) <= set(by_id), f"{layer}: unknown trees")
        for name in ["x", "y", "height_m", "crown_area_m2", "stem_uncertainty_m", "rotation_deg"]:
            table = np.array([float(by_id[i][name] or "nan") for i in ids])
            same = np.allclose(columns[name].astype(float), table, atol=1e-9, equal_nan=True)
            expect(same, f"{layer}: {name} differs from trees.csv")
        expect(all(shape is not None for shape in shapes), f"{layer}: missing geometry")
        index = database.execute(f"SELECT count(*) FROM rtree_{layer}_geom").fetchone()[0]
        expect(index == len(ids), f"{layer}: index has {index} of {len(ids)} rows")
        if len(ids):
            bounds = pyogrio.read_info(path, layer=layer, force_total_bounds=True)["total_bounds"]
            x, y = columns["x"].astype(float), columns["y"].astype(float)
            inside = bounds[0] <= x.max() and bounds[2] >= x.min() and bounds[1] <= y.max()
            expect(inside and bounds[3] >= y.min(), f"{layer}: bounds {bounds} hold no tree")
        print(f"trees.gpkg {layer:9}{len(ids)} features, {meta['crs']}")
        yield meta["crs"]


def check_rasters(folder, stem, low, high):
    """GeoTIFFs and their mosaic: layout, CRS, values in a plausible range."""
    paths = sorted(glob.glob(os.path.join(folder, f"{stem}*.tif")))
    expect(paths, f"{stem}: no raster")
    if len(paths) > 1:
        paths.append(os.path.join(folder, f"{stem}.vrt"))
    for path in paths:
        name = os.path.basename(path)
        with rasterio.open(path) as raster:
            expect(raster.count == 1 and raster.dtypes[0] == "float32", f"{name}: not one f32 band")
            expect(raster.nodata == NODATA, f"{name}: nodata is {raster.nodata}")
            if path.endswith(".tif"):
                expect(raster.profile["tiled"], f"{name}: not tiled")
                expect(raster.profile.get("compress") == "deflate", f"{name}: not deflated")
                values = raster.read(1, masked=True).compressed()
                expect(values.size > 0, f"{name}: empty")
                expect(np.isfinite(values).all(), f"{name}: values that are not finite")
                plausible = values.size == 0 or (values.min() >= low and values.max() <= high)
                expect(plausible, f"{name}: values from {values.min()} to {values.max()}")
                filled = values.size / (raster.width * raster.height)
                print(f"{name:19}{raster.width} x {raster.height}, {filled:.0%} filled, {raster.crs}")
            yield raster.crs


def check_points(folder, rows):
    """points.laz: format, dimensions, ids that occur in the table."""
    path = os.path.join(folder, "points.laz")
    ids = {int(row["tree_id"]) for row in rows}
    with laspy.open(path) as reader:
        header = reader.header
        expect(str(header.version) == "1.4", f"points.laz: version {header.version}")
        expect(header.point_format.id in (6, 7, 8), f"points.laz: format {header.point_format.id}")
        names = set(header.point_format.extra_dimension_names)
        expect({"HeightAboveGround", "treeID"} <= names, f"points.laz: dimensions {names}")
        points, labelled, ground = 0, 0, 0
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for chunk in reader.chunk_iterator(1_000_000):
            trees = np.asarray(chunk["treeID"])
            unknown = set(np.unique(trees).astype(int).tolist()) - ids - {0}
            expect(not unknown, f"points.laz: trees {sorted(unknown)[:3]} are not in trees.csv")
            height = np.asarray(chunk["HeightAboveGround"])
            is_ground = np.asarray(chunk["classification"]) == 2
            off = np.abs(height[is_ground & np.isfinite(height)])
            expect(off.size == 0 or np.median(off) < 0.5, "points.laz: ground points off the ground")
            position = np.array([chunk.x, chunk.y, chunk.z])
            low, high = np.minimum(low, position.min(1)), np.maximum(high, position.max(1))
            points += len(chunk)
            labelled += int((trees > 0).sum())
            ground += int(is_ground.sum())
        expect(points == header.point_count, f"points.laz: {points} of {header.point_count} points")
        near = np.allclose([*low, *high], [*header.mins, *header.maxs], atol=2 * header.scales[0])
        expect(near, "points.laz: bounds in the header are not those of the points")
        print(f"points.laz         {points} points, {labelled} in trees, {ground} ground")
        has_crs = any(v.user_id == "LASF_Projection" and v.record_id == 2112 for v in header.vlrs)
        return header, has_crs


def main(folder):
    rows = read_table(folder)
    systems = [crs for crs in check_package(folder, rows)]
    systems += [crs for crs in check_rasters(folder, "dtm", -500.0, 30_000.0)]
    systems += [crs for crs in check_rasters(folder, "chm", 0.0, 500.0)]
    _, has_crs = check_points(folder, rows)
    # A GeoPackage without a CRS has the "undefined" one that its standard provides.
    known = {str(crs) for crs in systems if crs and "Undefined Cartesian" not in str(crs)}
    codes = {rasterio.crs.CRS.from_user_input(crs).to_epsg() for crs in known}
    expect(len(codes - {None}) <= 1, f"the outputs have several CRS: {codes}")
    expect(has_crs == bool(known), f"points.laz has a CRS: {has_crs}, rasters and layers: {known}")
    for failure in failures:
        print(f"FAILED {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
