#!/usr/bin/env python3
"""Writes one point cloud with independent writers: libE57 (pye57), plyfile, laspy and numpy.

Usage: write_clouds.py FOLDER

    pip install numpy pye57 plyfile 'laspy[lazrs]'

Writes the files, and expected.csv: what every point is, in the frame of the world.
"""

import os
import sys

import laspy
import numpy as np
import pye57
from plyfile import PlyData, PlyElement

folder = sys.argv[1]
random = np.random.default_rng(7)
count = 5000
# Whole tenths of a millimetre, so that no format's rounding differs.
x = 500000 + np.round(random.uniform(-20, 20, count), 4)
y = 5400000 + np.round(random.uniform(-20, 20, count), 4)
z = np.round(random.uniform(-3, 30, count), 4)
intensity = random.integers(0, 65536, count)
red, green, blue = (random.integers(0, 256, count) for _ in range(3))
table = np.column_stack([x, y, z, intensity, red, green, blue])


def path(name):
    return os.path.join(folder, name)


np.savetxt(path("expected.csv"), table, fmt=["%.4f"] * 3 + ["%d"] * 4, delimiter=",")
np.savetxt(path("blanks.xyz"), table, fmt=["%.4f"] * 3 + ["%d"] * 4)
np.savetxt(path("header.csv"), table, fmt=["%.4f"] * 3 + ["%d"] * 4, delimiter=",",
           header="X,Y,Z,Intensity,Red,Green,Blue", comments="")
with open(path("commas.txt"), "w") as file:
    file.write("X;Y;Z;Intensity;R;G;B\n")
    for row in table:
        numbers = [f"{value:.4f}".replace(".", ",") for value in row[:3]] + [str(int(v)) for v in row[3:]]
        file.write(";".join(numbers) + "\r\n")

vertex = np.zeros(count, dtype=[("x", "f8"), ("y", "f8"), ("z", "f8"), ("intensity", "u2"),
                                ("red", "u1"), ("green", "u1"), ("blue", "u1")])
for name, values in [("x", x), ("y", y), ("z", z), ("intensity", intensity),
                     ("red", red), ("green", green), ("blue", blue)]:
    vertex[name] = values
faces = np.array([([0, 1, 2],), ([1, 2, 3, 4],)], dtype=[("vertex_indices", "O")])
elements = [PlyElement.describe(vertex, "vertex"),
            PlyElement.describe(faces, "face", val_types={"vertex_indices": "i4"})]
PlyData(elements, text=True).write(path("text.ply"))
PlyData(elements, byte_order="<").write(path("little.ply"))
PlyData(elements[::-1], byte_order=">").write(path("big.ply"))

las = laspy.LasData(laspy.LasHeader(point_format=7, version="1.4"))
las.header.offsets, las.header.scales = [500000, 5400000, 0], [1e-4] * 3
las.x, las.y, las.z, las.intensity = x, y, z, intensity
las.red, las.green, las.blue = red * 257, green * 257, blue * 257
las.write(path("cloud.laz"))

# Two scans in libE57, each in its scanner's frame (pye57 writes 32-bit coordinates): world = R local + t,
# R nothing for the first and a quarter turn to the left for the second.
half = count // 2
file = pye57.E57(path("cloud.e57"), mode="w")
for part, is_turned in [(slice(0, half), False), (slice(half, count), True)]:
    data = {"intensity": intensity[part].astype(float)}
    for name, values in [("colorRed", red), ("colorGreen", green), ("colorBlue", blue)]:
        data[name] = values[part].astype(np.uint8)
    t = np.array([500000.0, 5400000.0, 10.0])
    dx, dy, dz = x[part] - t[0], y[part] - t[1], z[part] - t[2]
    q = [np.sqrt(0.5), 0, 0, np.sqrt(0.5)] if is_turned else [1.0, 0, 0, 0]
    local = (dy, -dx, dz) if is_turned else (dx, dy, dz)
    data["cartesianX"], data["cartesianY"], data["cartesianZ"] = local
    file.write_scan_raw(data, rotation=np.array(q), translation=t)
file.close()
print(f"{count} points written with pye57, plyfile, laspy and numpy")
