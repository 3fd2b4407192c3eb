"""From a recording to a picture: where the gate would have permitted, where it would have denied, and by which margin.

python verdict_plot.py SITE RECORDING --task TASK -o verdicts.png

The recording is what `posegate replay` reads: a bag of ROS 2 (MCAP, with --topic), a CSV of estimates or a TUM file.
"""

import argparse
from collections import Counter

import matplotlib

matplotlib.use("Agg")  # A file, no window.

import matplotlib.pyplot as plt
import numpy as np
import posegate

PERMIT, DENY = "tab:green", "tab:red"


def main() -> None:
    parser = argparse.ArgumentParser(description="Draws the verdicts of a recording")
    parser.add_argument("site", help="the site file")
    parser.add_argument("recording", help="the recording: MCAP, CSV or TUM")
    parser.add_argument("--task", required=True, help="the task")
    parser.add_argument("--topic", action="append", default=[], help="a topic with estimates (MCAP)")
    parser.add_argument("-o", "--output", required=True, help="the picture: PNG, SVG or PDF")
    given = parser.parse_args()

    rows = posegate.replay(given.site, given.recording, given.task, topic=given.topic, rows=True)["rows"]
    rows = [row for row in rows if row["pose"] is not None and np.all(np.isfinite(np.array(row["pose"], dtype=float)))]
    permit = np.array([row["verdict"] == "permit" for row in rows], dtype=np.bool_)
    poses = np.array([row["pose"] for row in rows], dtype=np.float64).reshape(-1, 3)
    times = np.array([np.nan if row["t_s"] is None else row["t_s"] for row in rows])
    margins = np.array([np.nan if row["margin"] is None else row["margin"] for row in rows])

    figure, (plane, time) = plt.subplots(1, 2, figsize=(11, 4.5), constrained_layout=True)
    for which, colour, name in ((~permit, DENY, "deny"), (permit, PERMIT, "permit")):
        plane.scatter(poses[which, 0], poses[which, 1], s=8, color=colour, label=f"{name}: {which.sum()}")
        time.scatter(times[which], np.clip(margins[which], 0.01, 100), s=8, color=colour)
    plane.set(xlabel="x, m", ylabel="y, m", title=f"{given.task}: estimates", aspect="equal")
    plane.legend()
    time.axhline(1.0, color="black", linewidth=0.8)
    time.set(xlabel="t, s", ylabel="margin (0.01 and less at 0.01)", title="a permit has a margin of at least 1", yscale="log")
    figure.savefig(given.output, dpi=120)

    print(f"{permit.sum()} of {len(rows)} estimates permitted: {given.output}")
    for reason, count in Counter(row["reason"] for row in rows if row["reason"]).most_common():
        print(f"  {count} {reason}")


main()
