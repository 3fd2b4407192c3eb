"""Prints the table of a replay's rules as JSON lines: permits, and false permits and denials if the truth is known."""

import json
import sys

name = sys.argv[1]
replay = json.load(sys.stdin)
truth = replay.get("truth")
if truth["estimates"]:
    print(json.dumps({"name": f"{name}: truth in the pose-sets", "value": truth["coverage"], "unit": "share", "goal": None}))
for rule in ["gate", "interlock", "distance", "sigma", "ellipse", "ate"]:
    counts = replay["rules"][rule]
    if counts is None:
        # The rule has no input: no covariance, or no truth.
        print(json.dumps({"name": f"{name}: permitted by {rule}", "value": None, "unit": "not judged", "goal": None}))
        continue
    line = {
        "name": f"{name}: permitted by {rule}",
        "value": counts["permits"],
        "unit": f"of {replay['estimates']} estimates",
        "goal": None,
    }
    if truth["estimates"]:
        line["false_permits"] = counts["false_permits"]
        line["false_denials"] = counts["false_denials"]
    print(json.dumps(line))
