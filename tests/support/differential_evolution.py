"""Long runs of SciPy's differential evolution on the cost that `placement serve` answers.

usage: differential_evolution.py PLACEMENT SITE TASK SIGMA_X SIGMA_Y SIGMA_YAW_DEG RUNS ITERATIONS
Prints one JSON line: the best mean cost, its place, and the number of evaluations.
"""

import json
import subprocess
import sys

import numpy as np
from scipy.optimize import differential_evolution

placement, site, task, *sigmas, runs, iterations = sys.argv[1:]
server = subprocess.Popen(
    [placement, "serve", site, task, *sigmas],
    stdin=subprocess.PIPE,
    stdout=subprocess.PIPE,
    text=True,
)
bounds = [(0.3, 7.0), (-3.0, 3.0), (0.0, 2.0), (0.0, 360.0)]
asked = 0


def costs(places):
    """Returns the costs of places, one per column."""
    global asked
    places = places.T if places.ndim == 2 else places[None, :]
    asked += len(places)
    for place in places:
        server.stdin.write(" ".join(f"{v:.17g}" for v in place) + "\n")
    server.stdin.write("\n")
    server.stdin.flush()
    return np.array([float(server.stdout.readline()) for _ in places])


best, each = None, []
for seed in range(int(runs)):
    before = asked
    found = differential_evolution(
        costs,
        bounds,
        maxiter=int(iterations),
        popsize=15,
        tol=1e-8,
        seed=seed,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    each.append(asked - before)
    print(f"seed {seed}: {found.fun:.9f} at {found.x} after {each[-1]}", file=sys.stderr)
    if best is None or found.fun < best.fun:
        best = found
server.stdin.close()
server.wait()
print(json.dumps({"mean": float(best.fun), "place": best.x.tolist(), "evaluations": each}))
