"""Reference values for the multiquadric surface, from SciPy.

    python -m venv venv && venv/bin/pip install numpy scipy
    venv/bin/python make_fixtures.py

writes one CSV for each case into this folder. Nodes and queries are drawn from a seeded synthetic
surface. SciPy's multiquadric is -sqrt(1 + (epsilon r)^2); with epsilon = 1 / D it is the kernel
-sqrt(r^2 + D^2) divided by D, so that smoothing lambda becomes lambda / D there.
"""

import csv
import pathlib

import numpy as np
from scipy.interpolate import RBFInterpolator

HERE = pathlib.Path(__file__).parent


def surface(x, y):
    """Hills, a gully and a slope, metres."""
    hills = 3.0 * np.sin(x / 9.0) * np.cos(y / 7.0) + 0.6 * np.sin(x / 1.7 + y / 2.3)
    gully = -4.0 * np.exp(-(((y - 20.0 - 0.3 * x) / 3.0) ** 2))
    return 640.0 + 0.4 * x - 0.2 * y + hills + gully


CASES = [
    # name, seed, nodes, offset D (m), smoothing lambda (m), degree
    ("exact-plane", 1, 120, 0.5, 0.0, 1),
    ("exact-constant", 2, 90, 1.0, 0.0, 0),
    ("smoothed-plane", 3, 150, 0.8, 0.05, 1),
    ("smoothed-constant", 4, 60, 2.0, 0.3, 0),
    ("large", 5, 1500, 1.5, 0.02, 1),
]


def write(name, seed, count, offset, smoothing, degree):
    random = np.random.default_rng(seed)
    nodes = np.round(random.uniform(0.0, 40.0, (count, 2)), 3)
    z = np.round(surface(nodes[:, 0], nodes[:, 1]) + random.normal(0.0, 0.05, count), 3)
    queries = np.round(random.uniform(-2.0, 42.0, (60, 2)), 3)
    fitted = RBFInterpolator(
        nodes,
        z,
        kernel="multiquadric",
        epsilon=1.0 / offset,
        degree=degree,
        smoothing=smoothing / offset,
    )
    with open(HERE / f"{name}.csv", "w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["kind", "x", "y", "z"])
        rows.writerow(["offset-smoothing-degree", offset, smoothing, degree])
        rows.writerows(["node", *node, value] for node, value in zip(nodes, z))
        rows.writerows(["query", *query, repr(float(value))] for query, value in zip(queries, fitted(queries)))


if __name__ == "__main__":
    for case in CASES:
        write(*case)
