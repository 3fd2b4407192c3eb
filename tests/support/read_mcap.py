"""Reads the MCAP of a replay with the package `mcap` and compares verdicts, rules, truths and summary with the replay's."""

import json
import sys

from mcap.reader import make_reader

path, rows_path, summary_path = sys.argv[1:]
rows = [json.loads(line) for line in open(rows_path)]
known = [row for row in rows if "truth" in row]
expected_summary = json.load(open(summary_path))
counts = {}


def flag(value):
    """Returns a value as channels write it: 0, 1 or null."""
    return None if value is None else int(value)


wrong = 0
with open(path, "rb") as stream:
    reader = make_reader(stream, validate_crcs=True)
    summary = reader.get_summary()
    for schema, channel, message in reader.iter_messages(log_time_order=False):
        value = json.loads(message.data)
        shape = json.loads(schema.data)
        index = counts.get(channel.topic, 0)
        counts[channel.topic] = index + 1
        wrong += schema.encoding != "jsonschema" or channel.message_encoding != "json"
        wrong += shape["type"] != "object" or not set(value) <= set(shape.get("properties", value))
        if channel.topic == "/posegate/verdict":
            row = rows[index]
            wrong += value["permit"] != int(row["verdict"] == "permit")
            wrong += value["open"] != int(row["permitted"])
            wrong += any(value[key] != row[key] for key in ["margin", "reason", "gate_reason", "state", "age_s", "t_s"])
        elif channel.topic == "/posegate/rules":
            wrong += any(value[rule] != flag(rows[index][rule]) for rule in ["distance", "sigma", "ellipse"])
        elif channel.topic == "/posegate/truth":
            row = known[index]
            wrong += any(value[key] != row[key] for key in ["error_m", "error_yaw_rad", "nees"])
            wrong += any(value[key] != flag(row[key]) for key in ["in_success_set", "in_pose_set"])
        elif channel.topic == "/posegate/summary":
            wrong += value != expected_summary
verdicts = counts.get("/posegate/verdict", 0)
print(json.dumps({"name": "verdicts that the package mcap reads", "value": verdicts, "unit": "messages", "goal": len(rows)}))
print(json.dumps({"name": "of all messages, other than the rows", "value": wrong, "unit": "messages", "goal": 0}))
indexed = sum(summary.statistics.channel_message_counts.values())
print(json.dumps({"name": "messages in the file's index", "value": indexed, "unit": "messages", "goal": sum(counts.values())}))
sys.exit(wrong != 0 or verdicts != len(rows) or not rows or indexed != sum(counts.values())
         or counts.get("/posegate/rules") != len(rows) or counts.get("/posegate/summary") != 1
         or counts.get("/posegate/truth") != len(known) or not known)
