"""Compares the lens models and windows of crates/posegate-site/examples/lenses.rs (JSON lines on stdin) with OpenCV's projections."""

import json
import sys

import cv2
import numpy as np

NO_TURN = np.zeros((3, 1))
WINDOW_POINTS = 100_000


def project(case, points):
    """Returns OpenCV's pixels of normalised points."""
    fx, fy, cx, cy = case["k"]
    k = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    d = np.array(case["coefficients"], dtype=np.float64)
    space = np.hstack([points, np.ones((len(points), 1))]).reshape(-1, 1, 3)
    if case["model"] == "equidistant":
        pixels, _ = cv2.fisheye.projectPoints(space, NO_TURN, NO_TURN, k, d)
    else:
        pixels, _ = cv2.projectPoints(space, NO_TURN, NO_TURN, k, d if len(d) else None)
    return pixels.reshape(-1, 2)


def window(planes, random):
    """Returns points of a window, half of them on its border."""
    planes = np.array(planes)
    order = np.argsort(np.arctan2(planes[:, 1], planes[:, 0]))
    planes = planes[order]
    corners = []
    for one, other in zip(planes, np.roll(planes, -1, axis=0)):
        corners.append(np.linalg.solve(np.array([one[:2], other[:2]]), -np.array([one[2], other[2]])))
    corners = np.array(corners)
    middle = corners.mean(axis=0)
    edge = random.integers(len(corners), size=WINDOW_POINTS)
    share = random.random((WINDOW_POINTS, 1))
    border = corners[edge] * (1 - share) + np.roll(corners, -1, axis=0)[edge] * share
    out = np.where(random.random((WINDOW_POINTS, 1)) < 0.5, 1.0, np.sqrt(random.random((WINDOW_POINTS, 1))))
    return middle + out * (border - middle)


def main():
    random = np.random.default_rng(1)
    failed = False
    worst, count, outside = {}, {}, 0.0
    for line in sys.stdin:
        case = json.loads(line)
        ours = np.array(case["pixels"])
        theirs = project(case, np.array(case["points"]))
        model = case["model"]
        off = float(np.abs(ours - theirs).max())
        worst[model] = max(worst.get(model, 0.0), off) if np.isfinite(off) else float("inf")
        count[model] = count.get(model, 0) + len(ours)
        seen = project(case, window(case["planes"], random))
        outside = max(outside, float(-seen.min()), float((seen - np.array(case["size"])).max()))
        print(f"{model}: window keeps {case['kept']:.4f} in {len(case['planes'])} planes", file=sys.stderr)
    for model in ["none", "plumb_bob", "rational_polynomial", "equidistant"]:
        if count.get(model, 0) < 1000:
            print(f"{model}: {count.get(model, 0)} points", file=sys.stderr)
            failed = True
            continue
        value = worst[model]
        name = f"lens {model} against OpenCV {cv2.__version__}, {count[model]} points"
        print(json.dumps({"name": name, "value": value, "unit": "px", "goal": 1e-6}))
        failed |= not value <= 1e-6
    name = f"points of windows outside the image by OpenCV, {WINDOW_POINTS} of each"
    print(json.dumps({"name": name, "value": outside, "unit": "px", "goal": 1e-6}))
    failed |= not outside <= 1e-6
    return failed


sys.exit(main())
