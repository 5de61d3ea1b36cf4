#!/usr/bin/env python3
"""An example of a segmenter outside Timberline: every point to the nearest crown top.

Use it by one line in a pipeline file:

    [segmentation]
    command = ["python3", "hooks/nearest_top.py"]

A point above 2 m goes to the tree whose top is nearest in the plane, measured in crown radii: of two
tops at the same distance, the larger crown wins. A point farther than 1.5 radii from every top, or
more than 1 m above the top it would go to, belongs to no tree. That is a simple method, and an honest
baseline: it knows nothing of the shape of crowns and cuts touching crowns by circles
(multiplicatively weighted Voronoi cells).

The contract (arguments, files, columns) is in README.md beside this file. Needs numpy, laspy, lazrs:

    pip install numpy 'laspy[lazrs]'
"""

import argparse
import csv
import os
import sys

import laspy
import numpy as np

MIN_HEIGHT_M = 2.0  # below it are ground, herbs and shrubs
REACH = 1.5  # how far a tree reaches, in crown radii
ABOVE_TOP_M = 1.0  # a point higher than that above a top is of another tree
SMALLEST_RADIUS_M = 0.5  # lest a tree with an unknown radius get nothing
RADIUS_OF_HEIGHT = 0.15  # radius of a tree whose crown could not be modelled, as a share of its height
BLOCK = 200_000  # points worked on at once, so that memory does not grow with the tile


def read_tops(path):
    """Ids (uint64), positions in metres (n x 3) and crown radii in metres of the trees."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    ids = np.array([int(row["id"]) for row in rows], dtype=np.uint64)
    place = np.array([[float(row[axis]) for axis in "xyz"] for row in rows]).reshape(-1, 3) * units()
    radius = np.array([float(row["radius_m"]) for row in rows])
    height = np.array([float(row["height_m"]) for row in rows])
    radius = np.where(radius > 0, radius, RADIUS_OF_HEIGHT * height)
    return ids, place, np.maximum(radius, SMALLEST_RADIUS_M)


def units():
    """Metres in one unit of x, y and z: coordinates are in the units of the survey's CRS."""
    plane = float(os.environ.get("TIMBERLINE_M_PER_UNIT", "1"))
    return np.array([plane, plane, float(os.environ.get("TIMBERLINE_VERTICAL_M_PER_UNIT", "1"))])


def nearest(points, ids, tops, radius):
    """The id of the nearest top of every point, 0 where none is near enough."""
    # Tops far from a block of points cannot win; leaving them out keeps the table small. The points
    # come in an order in which neighbours in space are near each other.
    reach = REACH * radius
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    near = ((tops[:, :2] > low - reach[:, None]) & (tops[:, :2] < high + reach[:, None])).all(axis=1)
    ids, tops, radius = ids[near], tops[near], radius[near]
    best = np.full(len(points), REACH)
    tree = np.zeros(len(points), dtype=np.uint64)
    for one, top, size in zip(ids, tops, radius):
        distance = np.hypot(points[:, 0] - top[0], points[:, 1] - top[1]) / size
        wins = (distance < best) & (points[:, 2] <= top[2] + ABOVE_TOP_M)
        best[wins], tree[wins] = distance[wins], one
    return tree


def segment(cloud, ids, tops, radius):
    """The tree of every point of a tile and its surroundings."""
    points = np.column_stack([cloud.x, cloud.y, cloud.z]) * units()
    tree = np.zeros(len(points), dtype=np.uint64)
    # A height that is not known is NaN and compares as false.
    canopy = np.flatnonzero(np.asarray(cloud.height) >= MIN_HEIGHT_M)
    for start in range(0, len(canopy), BLOCK):
        block = canopy[start : start + BLOCK]
        tree[block] = nearest(points[block], ids, tops, radius)
    return tree


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", required=True, help="the points, LAZ")
    parser.add_argument("--tops", required=True, help="the trees, CSV")
    parser.add_argument("--out", required=True, help="where the answer goes, without .laz or .csv")
    parser.add_argument("--csv", action="store_true", help="answer in CSV instead of LAZ")
    args = parser.parse_args()

    cloud = laspy.read(args.points)
    tree = segment(cloud, *read_tops(args.tops))
    own = np.asarray(cloud.own) == 1
    # What goes to stderr is kept in the log of the run.
    print(f"{os.environ.get('TIMBERLINE_UNIT', '-')}: {np.count_nonzero(tree[own])} of "
          f"{np.count_nonzero(own)} points in a tree", file=sys.stderr)
    if args.csv:
        table = np.column_stack([np.arange(len(tree), dtype=np.uint64), tree])
        np.savetxt(args.out + ".csv", table, fmt="%d", delimiter=",", header="point,tree_id", comments="")
    else:
        cloud.add_extra_dim(laspy.ExtraBytesParams(name="tree_id", type=np.uint64))
        cloud.tree_id = tree
        cloud.write(args.out + ".laz")


if __name__ == "__main__":
    main()
