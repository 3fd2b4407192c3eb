"""Compares the placements of `./ci.sh placement`: JSON lines, ends non-zero where a goal is missed.

usage: placements.py FOLDER (with scipy-S.json, tenth-1-S.json to tenth-5-S.json, cmaes-S.json and ga-S.json for each sigma S)
"""

import json
import pathlib
import sys

folder = pathlib.Path(sys.argv[1])
missed = []


def tell(name, value, unit, goal=None, holds=True):
    print(json.dumps({"name": name, "value": value, "unit": unit, "goal": goal}))
    if not holds:
        missed.append(name)


TENTHS = [f"tenth-{seed}" for seed in range(1, 6)]

for sigma in ("0.1", "0.3"):
    read = {
        method: json.loads((folder / f"{method}-{sigma}.json").read_text())
        for method in ("scipy", *TENTHS, "cmaes", "ga")
    }
    best = read["scipy"]["mean"]
    runs = sorted(read["scipy"]["evaluations"])
    middle = runs[len(runs) // 2]
    tell(f"scipy, sigma {sigma}: best mean cost of {len(runs)} runs", best, "")
    tell(f"scipy, sigma {sigma}: evaluations of the middle run", middle, "")
    for method in (*TENTHS, "cmaes", "ga"):
        found = read[method]
        goal = None if method == "ga" else 1.001
        ratio = found["mean"] / best
        tell(f"{method}, sigma {sigma}: mean cost over SciPy's best", ratio, "", goal, goal is None or ratio <= goal)
        # One search against one run, of middle length.
        share = found["evaluations"] / middle
        goal = 0.1 if method in TENTHS else None
        tell(f"{method}, sigma {sigma}: evaluations over those of a run", share, "", goal, goal is None or share <= goal)
        if method in TENTHS:
            continue
        tell(f"{method}, sigma {sigma}: margin", found["margin"], "")
        tell(f"{method}, sigma {sigma}: yaw off square", abs(found["tag_pose"]["yaw_deg"] - 180.0), "deg")
if missed:
    print("beyond a goal: " + "; ".join(missed), file=sys.stderr)
    sys.exit(1)
