#!/usr/bin/env python3
"""Solves crown fitting problems with other people's solvers, formulated as the paper prints them.

Usage: solve.py SOLVER PROBLEMS [--limit SECONDS] [--repeat N] [--jobs N]

    pip install pyscipopt highspy swiglpk numpy scipy

SOLVER is scip (with tight tolerances), scip-default (with its own), glpk or highs (linear programs
only), equal-squares or free-squares. PROBLEMS holds
one JSON object a line: seed, omega, axes ([smallest, largest] for the exact bounds, [largest] for
the paper's C4), prior ([x, y, half width] or null), weights, cells ([x, y, z]). Prints one JSON
object a line in the same order: seed, status (optimal, limit or failed), objective, bound, nodes,
seconds (the smallest of the repeats, of the solver's call alone).

The paper: Polewski et al., L1-norm fitting of elliptic paraboloids with prior information for
enhanced coniferous tree localization in ALS point clouds, eq 12 to 19, with the signs of eq 18
corrected. Positions are centred, the plane is divided by the cells' rms radius and heights by their
standard deviation; nothing else is done to the formulation.
"""

import argparse
import json
import math
import multiprocessing
import time

import numpy as np

GAP = 1e-6
# SCIP's own 1e-6 is absolute: on the squares of C3 with a small omega it moves the optimum by 2e-4.
FEASIBILITY = 1e-8


class Scaled:
    """A problem in units of the crown."""

    def __init__(self, problem):
        cells = np.array(problem["cells"], dtype=float)
        weights = np.array(problem["weights"], dtype=float)
        cells, self.w = cells[weights > 0], weights[weights > 0]
        middle = cells.mean(axis=0)
        spread = cells - middle
        self.length = math.sqrt((spread[:, :2] ** 2).sum() / len(cells)) or 1.0
        self.height = math.sqrt((spread[:, 2] ** 2).mean()) or 1.0
        self.x, self.y = spread[:, 0] / self.length, spread[:, 1] / self.length
        self.z = spread[:, 2] / self.height
        self.omega = problem["omega"]
        unit = self.length**2 / self.height
        axes = problem["axes"]
        self.least = unit / axes[-1] ** 2
        self.most = unit / axes[0] ** 2 if len(axes) == 2 else None
        self.mu = None
        if len(axes) == 1:
            self.mu = 2 * self.least * math.sqrt((1 + self.omega) / (1 - self.omega))
        self.box = None
        if problem["prior"]:
            *centre, half = problem["prior"]
            self.box = [
                [(c - m - half) / self.length, (c - m + half) / self.length]
                for c, m in zip(centre, middle)
            ]

    def answer(self, status, objective, bound, nodes):
        """An answer in metres."""
        return {
            "status": status,
            "objective": objective * self.height,
            "bound": bound * self.height,
            "nodes": nodes,
        }


def equal_axes_rows(p):
    """Eq 18, over phi0 (= phi1), phi3, phi4, phi5 and a g for every cell: rows as (columns, values,
    low, high), and the bounds of phi0."""
    rows = []
    for i in range(len(p.z)):
        design = [p.x[i] ** 2 + p.y[i] ** 2, p.x[i], p.y[i], 1.0]
        columns = [0, 1, 2, 3, 4 + i]
        rows.append((columns, design + [-1.0], -math.inf, p.z[i]))
        rows.append((columns, design + [1.0], p.z[i], math.inf))
    for axis, edges in enumerate(p.box or []):
        low, high = edges
        if high - low < 1e-9:
            rows.append(([0, 1 + axis], [low + high, 1.0], 0.0, 0.0))
        else:
            rows.append(([0, 1 + axis], [2 * low, 1.0], 0.0, math.inf))
            rows.append(([0, 1 + axis], [2 * high, 1.0], -math.inf, 0.0))
    return rows, (-math.inf if p.most is None else -p.most, -p.least)


def glpk(p, limit, repeat):
    """GLPK's primal simplex with its default settings, on the formulation as printed."""
    import swiglpk as g

    g.glp_term_out(g.GLP_OFF)
    rows, (low, high) = equal_axes_rows(p)
    lp = g.glp_create_prob()
    g.glp_set_obj_dir(lp, g.GLP_MIN)
    g.glp_add_cols(lp, 4 + len(p.z))
    g.glp_add_rows(lp, len(rows))
    bounds = g.GLP_UP if math.isinf(low) else g.GLP_DB
    g.glp_set_col_bnds(lp, 1, bounds, 0.0 if math.isinf(low) else low, high)
    for k in (2, 3, 4):
        g.glp_set_col_bnds(lp, k, g.GLP_FR, 0.0, 0.0)
    for i, weight in enumerate(p.w):
        g.glp_set_col_bnds(lp, 5 + i, g.GLP_LO, 0.0, 0.0)
        g.glp_set_obj_coef(lp, 5 + i, float(weight))
    indices, values = g.intArray(6), g.doubleArray(6)
    for r, (columns, coefficients, low, high) in enumerate(rows):
        for k, (column, value) in enumerate(zip(columns, coefficients)):
            indices[k + 1], values[k + 1] = column + 1, float(value)
        g.glp_set_mat_row(lp, r + 1, len(columns), indices, values)
        kind = g.GLP_UP if math.isinf(low) else g.GLP_LO if math.isinf(high) else g.GLP_FX
        g.glp_set_row_bnds(lp, r + 1, kind, *(0.0 if math.isinf(v) else v for v in (low, high)))
    settings = g.glp_smcp()
    g.glp_init_smcp(settings)
    settings.msg_lev = g.GLP_MSG_OFF
    settings.tm_lim = int(1000 * limit)
    seconds = []
    for _ in range(repeat):
        g.glp_std_basis(lp)
        start = time.perf_counter()
        g.glp_simplex(lp, settings)
        seconds.append(time.perf_counter() - start)
    solved = g.glp_get_status(lp) == g.GLP_OPT
    value = g.glp_get_obj_val(lp)
    g.glp_delete_prob(lp)
    return p.answer("optimal" if solved else "failed", value, value, 0), min(seconds)


def highs(p, limit, repeat):
    """HiGHS' simplex on the formulation as printed."""
    import highspy

    rows, (low, high) = equal_axes_rows(p)
    n = len(p.z)
    lp = highspy.HighsLp()
    lp.num_col_, lp.num_row_ = 4 + n, len(rows)
    lp.col_cost_ = np.concatenate([np.zeros(4), p.w])
    lp.col_lower_ = np.array([low] + [-math.inf] * 3 + [0.0] * n)
    lp.col_upper_ = np.array([high] + [math.inf] * (3 + n))
    lp.row_lower_ = np.array([row[2] for row in rows])
    lp.row_upper_ = np.array([row[3] for row in rows])
    lp.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    lp.a_matrix_.start_ = np.cumsum([0] + [len(row[0]) for row in rows])
    lp.a_matrix_.index_ = np.concatenate([row[0] for row in rows])
    lp.a_matrix_.value_ = np.concatenate([row[1] for row in rows])
    solver = highspy.Highs()
    for name, value in [
        ("output_flag", False),
        ("solver", "simplex"),
        ("threads", 1),
        ("time_limit", limit),
    ]:
        solver.setOptionValue(name, value)
    solver.passModel(lp)
    seconds = []
    for _ in range(repeat):
        solver.clearSolver()
        start = time.perf_counter()
        solver.run()
        seconds.append(time.perf_counter() - start)
    solved = solver.getModelStatus() == highspy.HighsModelStatus.kOptimal
    value = solver.getObjectiveValue()
    return p.answer("optimal" if solved else "failed", value, value, 0), min(seconds)


def scip_model(p):
    """C1 with C3, C4 (or the bounds on the axes) and C5 as quadratic constraints."""
    from pyscipopt import Model, quicksum

    model = Model()
    model.hideOutput()
    model.setParam("parallel/maxnthreads", 1)
    model.setParam("limits/gap", GAP)
    free = {"lb": None, "ub": None}
    p0 = model.addVar("phi0", lb=None, ub=-p.least)
    if p.most is not None:
        model.chgVarLb(p0, -p.most)
    p3, p4, p5 = (model.addVar(f"phi{k}", **free) for k in (3, 4, 5))
    if p.omega == 0:
        p1, p2 = p0, 0.0
    else:
        p1 = model.addVar("phi1", lb=None, ub=-p.least)
        if p.most is not None:
            model.chgVarLb(p1, -p.most)
        p2 = model.addVar("phi2", **free)
        shape_constraints(model, p, p0, p1, p2)
    g = [model.addVar(f"g{i}", lb=0.0) for i in range(len(p.z))]
    for i, gap in enumerate(g):
        x, y = float(p.x[i]), float(p.y[i])
        surface = x * x * p0 + y * y * p1 + x * y * p2 + x * p3 + y * p4 + p5
        model.addCons(surface - float(p.z[i]) <= gap)
        model.addCons(float(p.z[i]) - surface <= gap)
    prior_constraints(model, p, [p0, p1, p2, p3, p4])
    model.setObjective(quicksum(float(w) * gap for w, gap in zip(p.w, g)))
    return model


def shape_constraints(model, p, p0, p1, p2):
    """C3, and C4 or the exact bounds on the axes."""
    spread, total = (p0 - p1) * (p0 - p1) + p2 * p2, -(p0 + p1)
    if p.omega < 1:
        model.addCons(spread <= p.omega**2 * total * total)
    if p.mu is not None:
        model.addCons(spread + p.mu**2 <= total * total)
        model.addCons(total >= 0)
        return
    model.addCons(total - 2 * p.least >= 0)
    model.addCons(spread <= (total - 2 * p.least) * (total - 2 * p.least))
    model.addCons(total <= 2 * p.most)
    model.addCons(spread <= (2 * p.most - total) * (2 * p.most - total))


def prior_constraints(model, p, phi):
    """C5: linear for equal axes (eq 18), with products of the coefficients otherwise (eq 19)."""
    p0, p1, p2, p3, p4 = phi
    for axis, edges in enumerate(p.box or []):
        low, high = edges
        if p.omega == 0:
            slope = (p3, p4)[axis]
            model.addCons(-2 * low * p0 <= slope)
            model.addCons(slope <= -2 * high * p0)
            continue
        det = 4 * p0 * p1 - p2 * p2
        over = p2 * p4 - 2 * p3 * p1 if axis == 0 else p2 * p3 - 2 * p0 * p4
        model.addCons(low * det <= over)
        model.addCons(over <= high * det)


def scip(p, limit, repeat, feasibility=FEASIBILITY):
    """SCIP on the formulation as printed."""
    seconds = []
    for _ in range(repeat):
        model = scip_model(p)
        model.setParam("limits/time", limit)
        if feasibility:
            model.setParam("numerics/feastol", feasibility)
        start = time.perf_counter()
        model.optimize()
        seconds.append(time.perf_counter() - start)
    status = "optimal" if model.getStatus() in ("optimal", "gaplimit") else "limit"
    if model.getNSols() == 0:
        return p.answer("failed", math.nan, model.getDualbound(), 0), min(seconds)
    answer = p.answer(status, model.getObjVal(), model.getDualbound(), model.getNTotalNodes())
    return answer, min(seconds)


def least_squares(p, free):
    """Weighted least squares without any constraint; the objective is the sum of squares in m²."""
    columns = [p.x**2 + p.y**2] if not free else [p.x**2, p.y**2, p.x * p.y]
    design = np.column_stack(columns + [p.x, p.y, np.ones_like(p.x)])
    root = np.sqrt(p.w)
    start = time.perf_counter()
    phi = np.linalg.lstsq(design * root[:, None], p.z * root, rcond=None)[0]
    seconds = time.perf_counter() - start
    squares = float((p.w * (design @ phi - p.z) ** 2).sum()) * p.height**2
    return {"status": "optimal", "objective": squares, "bound": squares, "nodes": 0}, seconds


SOLVERS = {
    "scip": scip,
    "scip-default": lambda p, limit, repeat: scip(p, limit, repeat, None),
    "glpk": glpk,
    "highs": highs,
    "equal-squares": lambda p, _limit, _repeat: least_squares(p, False),
    "free-squares": lambda p, _limit, _repeat: least_squares(p, True),
}


def solve(task):
    """One line in, one line out."""
    line, name, limit, repeat = task
    problem = json.loads(line)
    answer, seconds = SOLVERS[name](Scaled(problem), limit, repeat)
    finite = lambda value: value if not isinstance(value, float) or math.isfinite(value) else None
    answer = {key: finite(value) for key, value in answer.items()}
    return json.dumps({"seed": problem["seed"], **answer, "seconds": seconds})


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("solver", choices=sorted(SOLVERS))
    parser.add_argument("problems")
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    with open(options.problems, encoding="utf-8") as file:
        tasks = [(line, options.solver, options.limit, options.repeat) for line in file]
    if options.jobs == 1:
        answers = map(solve, tasks)
    else:
        answers = multiprocessing.Pool(options.jobs).imap(solve, tasks)
    for answer in answers:
        print(answer, flush=True)


if __name__ == "__main__":
    main()
