"""Reads what the stages tree-models and tree-tables left with other programs' readers.

Usage: check_trees.py OUTPUTS; needs the packages of .ci/requirements.txt."""

import csv
import glob
import json
import os
import re
import sys

import numpy as np
import pyogrio
import pygltflib
import trimesh
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def expect(condition, message):
    if not condition:
        sys.exit(f"FAILED: {message}")


def rows_of(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def offset_of(path):
    """The offset in the comments of a PLY or OBJ."""
    with open(path, "rb") as stream:
        head = stream.read(2000).decode("latin-1")
    return np.array([float(v) for v in re.search(r"offset_m (\S+) (\S+) (\S+)", head).groups()])


def check_table(folder, stem):
    rows = rows_of(os.path.join(folder, f"{stem}.csv"))
    dictionary = rows_of(os.path.join(folder, f"{stem}.dictionary.csv"))
    expect(rows, f"{stem}.csv is empty")
    expect(list(rows[0]) == [r["column"] for r in dictionary], f"{stem}: columns and dictionary differ")
    return rows


def check_tree(folder, tree_id):
    cylinders = rows_of(os.path.join(folder, "qsm.csv"))
    starts = np.array([[float(r[f"start_{a}"]) for a in "xyz"] for r in cylinders])
    ends = np.array([[float(r[f"end_{a}"]) for a in "xyz"] for r in cylinders])
    radii = np.array([float(r["radius_m"]) for r in cylinders])
    low, high = np.minimum(starts, ends).min(0) - radii.max() - 0.1, np.maximum(starts, ends).max(0) + radii.max() + 0.1
    for row in cylinders:
        expect(not row["parent"] or int(row["parent"]) < int(row["cylinder"]), "a parent after its child")

    # TreeQSM columns: a cylinder is its start, axis and length.
    treeqsm = rows_of(os.path.join(folder, "treeqsm.csv"))
    axis = np.array([[float(r[f"axis_{a}"]) for a in "xyz"] for r in treeqsm])
    start = np.array([[float(r[f"start_{a}"]) for a in "xyz"] for r in treeqsm])
    length = np.array([float(r["length"]) for r in treeqsm])
    expect(np.allclose(start + axis * length[:, None], ends, atol=1e-4), "treeqsm.csv: ends differ")
    for number, row in enumerate(treeqsm, 1):
        extension = int(row["extension"])
        expect(extension == 0 or int(treeqsm[extension - 1]["parent"]) == number, "extension is no child")

    # The tree file, by its documented grammar.
    with open(os.path.join(folder, "tree.txt")) as stream:
        lines = [line for line in stream.read().splitlines() if not line.startswith("#")]
    fields = lines[0].split(",")
    expect(fields[:5] == ["x", "y", "z", "radius", "parent_id"], f"tree.txt: {fields}")
    expect(len(lines) == 2, "tree.txt: one line a tree")
    segments = [dict(zip(fields, map(float, s.split(",")), strict=True)) for s in lines[1].split(", ")]
    expect(segments[0]["parent_id"] == -1 and len(segments) == len(cylinders) + 1, "tree.txt: root")
    for place, segment in enumerate(segments[1:], 1):
        expect(0 <= segment["parent_id"] < place, "tree.txt: parent after child")
    tips = np.array([[s["x"], s["y"], s["z"]] for s in segments[1:]])
    expect(np.allclose(tips, ends, atol=1e-5), "tree.txt: ends differ")

    volume = float((np.pi * radii**2 * np.linalg.norm(ends - starts, axis=1)).sum())
    meshes = {}
    for name in ["tree.ply", "tree.obj", "tree_watertight.ply"]:
        path = os.path.join(folder, name)
        mesh = trimesh.load(path, process=False)
        mesh = mesh.to_geometry() if isinstance(mesh, trimesh.Scene) else mesh
        meshes[name] = mesh
        world = mesh.vertices + offset_of(path)
        expect((world >= low).all() and (world <= high).all(), f"{name}: outside the cylinders' box")
    glb = os.path.join(folder, "tree.glb")
    meshes["tree.glb"] = trimesh.load(glb, process=False).to_geometry()
    offset = np.array(pygltflib.GLTF2().load(glb).scenes[0].extras["offset_m"], dtype=float)
    turned = meshes["tree.glb"].vertices
    world = np.column_stack([turned[:, 0], -turned[:, 2], turned[:, 1]]) + offset
    expect((world >= low).all() and (world <= high).all(), "tree.glb: outside the cylinders' box")
    for name, mesh in meshes.items():
        expect(mesh.is_watertight and mesh.is_winding_consistent, f"{name} is not watertight")
        expect(mesh.volume > 0, f"{name}: inside out")
    # Tubes overlap as cylinders do: the same volume but for the smoothing of radii.
    for name in ["tree.ply", "tree.obj", "tree.glb"]:
        expect(abs(meshes[name].volume / volume - 1) < 0.03, f"{name}: {meshes[name].volume} of {volume}")
    # Bodies turned inside out are cavities: where twigs of less than a cell stand close together.
    bodies = [body for body in meshes["tree_watertight.ply"].split() if body.volume > 0]
    expect(len(bodies) == 1, f"the closed mesh falls apart into {len(bodies)} bodies")
    expect(len(meshes["tree.ply"].visual.vertex_colors) == len(meshes["tree.ply"].vertices), "no colours")
    with open(os.path.join(folder, "tree.obj")) as stream:
        groups = re.findall(r"^g (\S+)$", stream.read(), re.M)
    orders = sorted({int(r["branch_order"]) for r in cylinders})
    expect(groups == [f"order_{o}" for o in orders], f"tree.obj: groups {groups}")

    with open(os.path.join(folder, "metrics.json")) as stream:
        metrics = json.load(stream)
    expect(metrics["tree_id"] == tree_id and metrics["cylinders"] == len(cylinders), "metrics.json")
    told = metrics["watertight"]["volume_m3"]
    # The closed mesh leaves out what is thinner than about an edge of its grid, and holds the rest.
    thick = radii >= metrics["watertight"]["grid_edge_m"]
    lengths = np.linalg.norm(ends - starts, axis=1)
    kept = float((np.pi * radii**2 * lengths)[thick].sum())
    expect(not thick.any() or abs(told / kept - 1) < 0.04, f"closed mesh: {told} of {kept} m3")
    expect(abs(meshes["tree_watertight.ply"].volume / told - 1) < 1e-3, "metrics.json: closed volume")

    topics = {}
    with open(os.path.join(folder, "tree.mcap"), "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            topics.setdefault(channel.topic, []).append(message)
        names = {m.name for m in reader.iter_metadata()}
    expect("timberline.tree" in names, f"tree.mcap: records {names}")
    solids = topics["/cylinders"][0].entities[0].cylinders
    expect(len(solids) == len(cylinders), "tree.mcap: cylinders")
    centre = np.array([[c.pose.position.x, c.pose.position.y, c.pose.position.z] for c in solids]) + offset
    expect(np.allclose(centre, (starts + ends) / 2, atol=1e-5), "tree.mcap: centres")
    turn = np.array([[c.pose.orientation.w, c.pose.orientation.x, c.pose.orientation.y, c.pose.orientation.z] for c in solids])
    up = np.array([trimesh.transformations.quaternion_matrix(q)[:3, 2] for q in turn])
    expect(np.allclose(up, axis, atol=1e-4), "tree.mcap: axes")
    line = topics["/skeleton"][0].entities[0].lines[0]
    expect(len(line.points) > 1 and max(line.indices) < len(line.points), "tree.mcap: skeleton")
    points = sum(len(m.data) // m.point_stride for m in topics["/cloud"])
    expect(points > 0, "tree.mcap: no points")
    print(f"tree {tree_id}: {len(cylinders)} cylinders, {volume:.4f} m3, closed {told:.4f} m3, {points} points")


def check_plot(folder, rows):
    mesh = trimesh.load(os.path.join(folder, "plot.ply"), process=False)
    expect(mesh.is_watertight, "plot.ply is not watertight body by body")
    world = mesh.vertices + offset_of(os.path.join(folder, "plot.ply"))
    scene = trimesh.load(os.path.join(folder, "plot.glb"), process=False)
    expect(len(scene.geometry) == len(rows), "plot.glb: a part for every tree")
    turned = scene.to_geometry().vertices
    offset = np.array(pygltflib.GLTF2().load(os.path.join(folder, "plot.glb")).scenes[0].extras["offset_m"])
    again = np.column_stack([turned[:, 0], -turned[:, 2], turned[:, 1]]) + offset
    expect(np.allclose(again.min(0), world.min(0), atol=1e-4), "plot.glb and plot.ply differ")
    for row in rows:
        base = np.array([float(row[a]) for a in "xyz"])
        near = np.linalg.norm(world[:, :2] - base[:2], axis=1).min()
        # Where nothing was measured at breast height, the model may begin beside the base.
        reach = float(row["dbh_cm"] or 50) / 100 if row["dbh_source"] == "measured" else 0.5
        expect(near < reach, f"no stem within {reach} m of the base of tree {row['tree_id']}: {near}")
    meta, _, geometry, fields = pyogrio.raw.read(os.path.join(folder, "trees.gpkg"), layer="stems")
    columns = dict(zip([str(n) for n in meta["fields"]], fields))
    expect([int(i) for i in columns["tree_id"]] == [int(r["tree_id"]) for r in rows], "trees.gpkg: ids")
    expect(meta["geometry_type"] == "Point Z" and all(g is not None for g in geometry), "trees.gpkg")
    for name in ["x", "y", "height_m", "dbh_cm", "stem_volume_m3"]:
        table = np.array([float(r[name] or "nan") for r in rows])
        expect(np.allclose(columns[name].astype(float), table, equal_nan=True), f"trees.gpkg: {name}")
    print(f"plot: {len(rows)} trees, {len(mesh.faces)} triangles, {meta['crs']}")


def main():
    folder = sys.argv[1]
    rows = check_table(folder, "trees")
    cylinders = check_table(folder, "qsm")
    check_table(folder, "taper")
    check_table(folder, "branches")
    for row in rows:
        tree = os.path.join(folder, "trees", row["tree_id"])
        own = [r for r in cylinders if r["tree_id"] == row["tree_id"]]
        expect(own == rows_of(os.path.join(tree, "qsm.csv")), "merged and own qsm.csv differ")
        check_tree(tree, int(row["tree_id"]))
    folders = {os.path.basename(p) for p in glob.glob(os.path.join(folder, "trees", "*"))}
    expect(folders == {row["tree_id"] for row in rows}, "folders and trees differ")
    check_plot(folder, rows)


main()
