"""A recording of Nav2, played with its odometry at several speeds: the node's verdicts equal those of `posegate replay`, row by row.

Usage: nav2.py BAG SITE SPEED..

Two nodes listen: one takes the poses alone, as each row of `replay` is decided, the other carries them along the odometry.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import support
from mcap.reader import make_reader
from nav_msgs.msg import Odometry
from rclpy.qos import QoSProfile
from support import PROGRAM, Peer, end, figure, require

BAG, PLACE, SPEEDS = sys.argv[1], sys.argv[2], [float(word) for word in sys.argv[3:]]
TASK = "hall"
ERRORS = ("odometry_m_per_sqrt_m:=0.01", "odometry_rad_per_sqrt_rad:=0.02", "odometry_rad_per_sqrt_m:=0.01", "odometry_slip:=0.02")


def program(*words, codes=(0,)):
    ended = subprocess.run([PROGRAM, *words], capture_output=True, text=True, check=False)
    require(ended.returncode in codes, ended.stderr)


def recorded():
    """Returns the messages in their order: True for a pose, the stamp (s), the bytes."""
    with open(BAG, "rb") as file:
        found = []
        for _, channel, message in make_reader(file).iter_messages(topics=["/amcl_pose", "/odom"]):
            stamp = int.from_bytes(message.data[4:8], "little") + int.from_bytes(message.data[8:12], "little") * 1e-9
            found.append((channel.topic == "/amcl_pose", stamp, bytearray(message.data)))
        return found


def values(status):
    return {pair.key: pair.value for pair in status.values}


def play(messages, rows, speed):
    """Plays the recording, and compares each verdict with its row."""
    peer = Peer(f"peer_{round(speed)}", qos=support.DEEP)
    odometry = peer.node.create_publisher(Odometry, "/odom", QoSProfile(depth=1000))
    # A faster replay is a faster robot.
    moving = (f"max_speed:={0.5 * speed}", f"max_yaw_rate_deg:={60.0 * speed}", "odometry_maximum_gap_ms:=300")
    nodes = [
        support.start("stands_still:=true"),
        support.start(
            "use_odometry:=true",
            *ERRORS,
            *moving,
            ros=[
                word
                for name in ("permission", "permit", "markers", "reset", "explain")
                for word in ("-r", f"{name}:=/carried/{name}")
            ]
            + ["-r", "__node:=carried", "-r", "diagnostics:=/carried/diagnostics"],
        ),
    ]
    carried = []
    counts = {}

    def note(message):
        counts.update({status.name: values(status) for status in message.status})

    peer.node.create_subscription(support.DiagnosticArray, "/carried/permission", carried.append, 1000)
    peer.node.create_subscription(support.DiagnosticArray, "/carried/diagnostics", note, 10)
    subscribed = lambda: peer.poses.get_subscription_count() == 2 and odometry.get_subscription_count() == 1  # noqa: E731
    require(peer.wait(20.0, subscribed) is not None, "the nodes do not subscribe")
    # Discovery is over once each topic has brought something, which takes long on a busy machine.
    heard = lambda: peer.heartbeats and carried and counts  # noqa: E731
    require(peer.wait(30.0, heard) is not None, "no heartbeat, or no diagnostics")
    peer.spin(1.0)
    peer.heartbeats.clear()
    first = messages[0][1]
    begin_ns = time.time_ns()
    due_s = 0.0
    by_stamp = {}
    for is_pose, stamp, payload in messages:
        # A pose is published when it was: after the odometry before it, later than its stamp.
        if not is_pose:
            due_s = max(due_s, (stamp - first) / speed)
        while time.time_ns() < begin_ns + due_s * 1e9:
            peer.spin(0.0005)
        stamp_ns = begin_ns + round((stamp - first) / speed * 1e9)
        sec, nanosec = divmod(stamp_ns, 1_000_000_000)
        payload[4:12] = sec.to_bytes(4, "little") + nanosec.to_bytes(4, "little")
        if is_pose:
            by_stamp[f"{sec}.{nanosec:09}"] = len(by_stamp)
        (peer.poses if is_pose else odometry).publish(bytes(payload))
        peer.spin(0.0)
    # The diagnostics come once a second.
    peer.spin(3.0)
    shown = {}
    for message in peer.heartbeats:
        found = values(message.status[0])
        index = by_stamp.get(found.get("report_stamp"))
        if index is not None:
            shown[index] = found
    different = 0
    for index, found in shown.items():
        row = rows[index]
        margin = float(found["report_margin"]) if found["report_margin"] else None
        worst = [float(word) for word in found["report_worst_pose"].split()] or None
        node_row = (found["report_verdict"], found["report_reason"] or None, margin, worst)
        replay_row = (row["verdict"], row["reason"], row["margin"], row["worst_pose"])
        if node_row != replay_row:
            different += 1
            print(speed, index, node_row, replay_row, file=sys.stderr)
    name = f"Nav2 bag at {speed:g} times"
    # A heartbeat shows the last pose of a cycle: a machine that stops for longer than that between two poses hides one.
    figure(f"{name}: rows that the heartbeat showed", len(shown), "rows", len(rows) if speed == 1.0 else round(0.9 * len(rows)))
    figure(f"{name}: rows that differ from `posegate replay`", different, "rows", 0, at_least=False)
    poses, ways = counts["carried: pose"], counts["carried: odometry"]
    sent = sum(not is_pose for is_pose, _, _ in messages)
    figure(f"{name}: odometry that was read", int(ways["messages"]), "messages", sent)
    figure(f"{name}: messages that could not be read", int(poses["unreadable"]) + int(ways["unreadable"]), "messages", 0, at_least=False)
    permits = sum(message.status[0].message == "permit" for message in carried)
    figure(f"{name}: heartbeats that permit, with the odometry", permits, "heartbeats", 1 if speed == 1.0 else None)
    alone = sum(message.status[0].message == "permit" for message in peer.heartbeats)
    figure(f"{name}: heartbeats that permit, without", alone, "heartbeats")
    for node in nodes:
        require(node.poll() is None, "a node died")
        node.kill()
        node.wait()
    peer.close()


def main():
    with tempfile.TemporaryDirectory() as folder:
        table, rows = Path(folder) / "hall.posegate", Path(folder) / "rows.jsonl"
        program("table", "build", PLACE, "--task", TASK, "-o", str(table))
        words = ["replay", PLACE, BAG, "--task", TASK, "--topic", "/amcl_pose", "--table", str(table), "--cross-terms", "yaw-unknown"]
        # Each estimate as if it was just made.
        program(*words, "--clock", "stamps", "--rows", str(rows), "-o", str(Path(folder) / "x.svg"), codes=(0, 1))
        expected = [json.loads(line) for line in rows.read_text().splitlines()]
        support.TABLE = table
        messages = recorded()
        poses = sum(is_pose for is_pose, _, _ in messages)
        require(len(expected) == poses >= 100, f"{len(expected)} rows, {poses} poses")
        permits = sum(row["verdict"] == "permit" for row in expected)
        figure("Nav2 bag: permits among its rows", permits, "rows", 20)
        figure("Nav2 bag: denials among its rows", poses - permits, "rows", 5)
        for speed in SPEEDS:
            play(messages, expected, speed)


main()
end()
