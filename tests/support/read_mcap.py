"""Reads the MCAP of a replay with the package `mcap` and holds every verdict against the replay's rows."""

import json
import sys

from mcap.reader import make_reader

path, rows_path = sys.argv[1:]
rows = [json.loads(line) for line in open(rows_path)]
counts = {}
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
verdicts = counts.get("/posegate/verdict", 0)
print(json.dumps({"name": "verdicts that the package mcap reads", "value": verdicts, "unit": "messages", "goal": len(rows)}))
print(json.dumps({"name": "of all messages, other than the rows", "value": wrong, "unit": "messages", "goal": 0}))
indexed = sum(summary.statistics.channel_message_counts.values())
print(json.dumps({"name": "messages in the file's index", "value": indexed, "unit": "messages", "goal": sum(counts.values())}))
sys.exit(wrong != 0 or verdicts != len(rows) or not rows or indexed != sum(counts.values())
         or counts.get("/posegate/rules") != len(rows) or counts.get("/posegate/summary") != 1)
