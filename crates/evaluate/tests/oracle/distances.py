"""Distances by other programs: reads a scene as JSON on stdin, writes distances as JSON on stdout.

Mesh: trimesh's nearest place on a surface. Cylinders: the same on prisms of 4000 sides, which are nearer to
their cylinder than 4e-7 of its radius, without the discs of open ends. Points: SciPy's kd-tree. Needs the
packages of .ci/requirements.txt."""

import json
import sys

import numpy as np
import scipy.spatial
import trimesh

SIDES = 4000


def lateral(start, end, radius, ends):
    """The surface of a cylinder as triangles."""
    start, end = np.array(start), np.array(end)
    axis = (end - start) / np.linalg.norm(end - start)
    u = np.linalg.svd(axis[None])[2][1]
    v = np.cross(axis, u)
    angle = np.linspace(0, 2 * np.pi, SIDES, endpoint=False)
    ring = radius * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v)
    low, high = start + ring, end + ring
    nxt = np.roll(np.arange(SIDES), -1)
    here = np.arange(SIDES)
    faces = [np.column_stack([here, nxt, nxt + SIDES]), np.column_stack([here, nxt + SIDES, here + SIDES])]
    vertices = np.vstack([low, high, start, end])
    if ends[0]:
        faces.append(np.column_stack([here, nxt, np.full(SIDES, 2 * SIDES)]))
    if ends[1]:
        faces.append(np.column_stack([here + SIDES, nxt + SIDES, np.full(SIDES, 2 * SIDES + 1)]))
    return trimesh.Trimesh(vertices, np.vstack(faces), process=False)


def nearest(mesh, points):
    return trimesh.proximity.closest_point(mesh, points)[1]


scene = json.load(sys.stdin)
points = np.array(scene["points"])
mesh = trimesh.Trimesh(scene["vertices"], scene["triangles"], process=False)
cylinders = np.min(
    [nearest(lateral(c["start_m"], c["end_m"], c["radius_m"], e), points)
     for c, e in zip(scene["cylinders"], scene["ends"])], axis=0)
tree = scipy.spatial.cKDTree(points)
by_mesh = nearest(mesh, points)
summary = {
    "mean_m": by_mesh.mean(), "rms_m": np.sqrt((by_mesh**2).mean()),
    "p95_m": np.percentile(by_mesh, 95), "max_m": by_mesh.max(),
}
json.dump({
    "mesh": by_mesh.tolist(), "cylinders": cylinders.tolist(),
    "points": tree.query(np.array(scene["vertices"]))[0].tolist(),
    "summary": summary, "watertight": bool(mesh.is_watertight), "volume_m3": float(mesh.volume),
}, sys.stdout)
