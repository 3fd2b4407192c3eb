"""Each verdict of the node on a recording equals the one of `posegate replay`, and how long a verdict takes.

Usage: rows.py BAG [PERIOD]; PERIOD is the time between two poses, seconds.
"""

import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mcap.reader import make_reader
from support import DEEP, PROGRAM, SITE, TABLE, Peer, end, figure, require, start

BAG = Path(sys.argv[1])
PERIOD = float(sys.argv[2]) if len(sys.argv) > 2 else 0.0


def expected():
    """Returns the rows of `posegate replay`, each estimate evaluated as just made."""
    with tempfile.TemporaryDirectory() as folder:
        rows = Path(folder) / "rows.jsonl"
        words = [PROGRAM, "replay", str(SITE), str(BAG), "--task", "dock", "--topic", "/amcl_pose", "--table", str(TABLE)]
        words += ["--cross-terms", "filled", "--clock", "stamps", "--rows", str(rows), "-o", str(Path(folder) / "x.svg")]
        ended = subprocess.run(words, capture_output=True, text=True, check=False)
        require(ended.returncode in (0, 1), ended.stderr)
        return [json.loads(line) for line in rows.read_text().splitlines()]


def payloads():
    """Returns the messages of the bag as they were recorded, byte for byte."""
    with BAG.open("rb") as file:
        return [bytearray(message.data) for _, channel, message in make_reader(file).iter_messages(topics=["/amcl_pose"])]


def main():
    rows, messages = expected(), payloads()
    require(len(rows) == len(messages) >= 1000, f"{len(rows)} rows, {len(messages)} messages")
    node = start("stands_still:=true", "cross_terms:=filled")
    peer = Peer(qos=DEEP)
    require(peer.wait(10.0, lambda: peer.poses.get_subscription_count() > 0) is not None, "the node does not subscribe")
    peer.spin(0.5)
    equal = permits = 0
    latencies = []
    different = []
    for row, payload in zip(rows, messages):
        stamp_ns = time.time_ns()
        sec, nanosec = divmod(stamp_ns, 1_000_000_000)
        # Only the stamp is changed: to now.
        payload[4:12] = sec.to_bytes(4, "little") + nanosec.to_bytes(4, "little")
        stamp = f"{sec}.{nanosec:09}"
        peer.heartbeats.clear()
        peer.poses.publish(bytes(payload))
        found = None
        begin = time.monotonic()
        while found is None and time.monotonic() - begin < 10.0:
            peer.wait(0.1, lambda: bool(peer.heartbeats))
            for message in peer.heartbeats:
                values = {pair.key: pair.value for pair in message.status[0].values}
                if values.get("report_stamp") == stamp:
                    found = values
                    break
            else:
                peer.heartbeats.clear()
        latencies.append((time.time_ns() - stamp_ns) * 1e-6)
        require(found is not None, f"row {row['index']}: no verdict within 10 s")
        worst = [float(word) for word in found["report_worst_pose"].split()] or None
        margin = float(found["report_margin"]) if found["report_margin"] else None
        node_row = (found["report_verdict"], found["report_reason"] or None, margin, worst)
        replay_row = (row["verdict"], row["reason"], row["margin"], row["worst_pose"])
        permits += row["verdict"] == "permit"
        if node_row == replay_row:
            equal += 1
        else:
            different.append((row["index"], node_row, replay_row))
        if PERIOD:
            peer.spin(max(0.0, PERIOD - (time.monotonic() - begin)))
    for line in different[:5]:
        print(line, file=sys.stderr)
    figure("rows of a bag: permits among them", permits, "rows", 20)
    figure("rows of a bag: verdict, reason, margin and worst pose equal to `posegate replay`", equal, "rows", len(rows))
    latencies.sort()
    figure("pose to verdict, median", round(statistics.median(latencies), 2), "ms", 5.0, at_least=False)
    figure("pose to verdict, 99 %", round(latencies[int(0.99 * len(latencies))], 2), "ms")
    figure("pose to verdict, longest", round(latencies[-1], 2), "ms")
    node.kill()


main()
end()
