#!/usr/bin/env python3
"""Follow the fail-safe permit of posegate-node, and say when it ends.

    python permit_listener.py --task dock --robot /robot1/posegate --table DIGEST

prints `permit` or `no permit: REASON` with the time of each change. `PermitListener` is the class for programs:

    listener = PermitListener(node, task="dock", robot="/robot1/posegate", table=DIGEST)
    ...
    if listener.permitted():    # ask at the moment of use, never store the answer

`robot` is the full name of the node that decides for this robot, or its parameter `robot`. `table` is the `table_digest` that
`posegate table info` prints. The topic is relative: it follows the namespace of `node`.

A permit is used only while heartbeats come. It ends by itself `valid_ms` (a value in the heartbeat, at most MOST_VALID_MS) after the
stamp of the last heartbeat that permits, whatever happens to the node, to the network or to this program. Both clocks count: the ROS
clock, on which heartbeats are stamped, and the monotonic clock of this program. The ROS clocks of both machines must agree to within
MOST_AHEAD_MS.
"""

import argparse
import sys
import time

# The longest time for which a heartbeat is valid, whatever it states. After a change of the run, heartbeats of the new run alone must
# come for this time before one permits.
MOST_VALID_MS = 1000
# The same after an earlier run has come back: a node that was started again has a new run, so two nodes are alive, and one may be slow.
TWO_NODES_MS = 10_000
# The earlier runs that are kept.
MOST_RUNS = 8
# A heartbeat from farther in the future shows that the clocks of the machines differ.
MOST_AHEAD_MS = 20
FORMAT = "2"


class PermitWatch:
    """The rules of the permit, without ROS. Times are integers, nanoseconds."""

    def __init__(self, task, robot, table):
        """`task`, `robot` and `table` are those that a permit must name. An empty robot or table is never permitted."""
        self.task = task
        self.robot = robot
        self.table = table
        self.run = None
        self.earlier = []
        self.alone_ns = None
        self.sequence = 0
        self.ends_ns = None
        self.reason = "silent"

    def heartbeat(self, message, ros_ns, monotonic_ns):
        """Takes a diagnostic_msgs/msg/DiagnosticArray at a moment of both clocks."""
        refused = self._refused(message, ros_ns, monotonic_ns)
        if refused is None:
            valid_ns = self._valid_ms(message) * 1_000_000
            age_ns = max(0, ros_ns - self._stamp_ns(message))
            self.ends_ns = monotonic_ns + valid_ns - age_ns
            self.reason = None
        else:
            self.ends_ns = None
            self.reason = refused

    def permitted(self, monotonic_ns):
        """Returns True if the task may run at this moment of the monotonic clock."""
        if self.ends_ns is not None and monotonic_ns >= self.ends_ns:
            self.ends_ns = None
            self.reason = "no heartbeat: the node has stopped, or messages do not arrive"
        return self.ends_ns is not None

    def _refused(self, message, ros_ns, monotonic_ns):
        """Returns why a heartbeat does not permit, or None."""
        if len(message.status) != 1:
            return "not a heartbeat of posegate-node"
        status = message.status[0]
        values = {}
        for pair in status.values:
            if pair.key in values:
                return "a value is given twice"
            values[pair.key] = pair.value
        if status.name != "posegate" or values.get("format") != FORMAT:
            return "not a heartbeat of posegate-node, or of another version"
        try:
            sequence = int(values["sequence"])
            run = values["run"]
        except (KeyError, ValueError):
            return "a heartbeat without its number"
        # A late message of the same run says nothing about now.
        if run == self.run and sequence <= self.sequence:
            return "heartbeats out of order"
        if self.run not in (None, run):
            alone_ms = TWO_NODES_MS if run in self.earlier else MOST_VALID_MS
            self.alone_ns = max(self.alone_ns or 0, monotonic_ns + alone_ms * 1_000_000)
            self.earlier = [*self.earlier, self.run][-MOST_RUNS:]
        self.run, self.sequence = run, sequence
        if not self.robot or values.get("robot") != self.robot:
            return f"a heartbeat of the robot {values.get('robot')}, expected {self.robot}"
        if self.alone_ns is not None and monotonic_ns < self.alone_ns:
            return "two nodes send heartbeats, or the node was just started again: another run came a moment ago"
        if status.level not in (b"\x00", 0) or status.message != "permit" or values.get("state") != "permitted":
            return values.get("reason") or "denied"
        if values.get("reason") != "":
            return "a heartbeat that contradicts itself"
        if values.get("task") != self.task:
            return f"a permit for the task {values.get('task')}, expected {self.task}"
        if not self.table or values.get("table") != self.table:
            return f"a permit by the table {values.get('table')}, expected {self.table}"
        try:
            valid_ms = self._valid_ms(message)
        except ValueError:
            return "a heartbeat without its time"
        if not 1 <= valid_ms <= MOST_VALID_MS:
            return f"a heartbeat that would be valid for {valid_ms} ms"
        age_ns = ros_ns - self._stamp_ns(message)
        if age_ns < -MOST_AHEAD_MS * 1_000_000:
            return "a heartbeat from the future: the clocks of the machines differ"
        if age_ns >= valid_ms * 1_000_000:
            return "an old heartbeat: delayed on the way, or the clocks of the machines differ"
        return None

    @staticmethod
    def _valid_ms(message):
        return int(next((pair.value for pair in message.status[0].values if pair.key == "valid_ms"), ""))

    @staticmethod
    def _stamp_ns(message):
        return message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec


class PermitListener:
    """Follows the permit on a node of rclpy."""

    def __init__(self, node, task, robot, table, topic="posegate/permission"):
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

        self.watch = PermitWatch(task, robot=robot, table=table)
        # Deadline and liveliness are offered by the node; the times here do not depend on them.
        qos = QoSProfile(depth=1, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)
        self.subscription = node.create_subscription(DiagnosticArray, topic, self._take, qos)

    def _take(self, message):
        # The system's clock: simulated time can stop, and a permit must not.
        self.watch.heartbeat(message, time.time_ns(), time.monotonic_ns())

    def permitted(self):
        """Returns True if the task may run now."""
        return self.watch.permitted(time.monotonic_ns())

    def reason(self):
        """Returns why the task may not run, or None."""
        return None if self.permitted() else self.watch.reason


def main():
    import rclpy
    from rclpy.executors import ExternalShutdownException

    parser = argparse.ArgumentParser(description="Follow the permit of posegate-node")
    parser.add_argument("--task", required=True, help="the task that may run")
    parser.add_argument("--robot", required=True, help="full name of the node that decides, such as /robot1/posegate")
    parser.add_argument("--table", required=True, help="digest of the table: `table_digest` of `posegate table info`")
    parser.add_argument("--topic", default="posegate/permission", help="relative to the namespace (-r __ns:=/robot1)")
    given = parser.parse_args(rclpy.utilities.remove_ros_args(sys.argv)[1:])
    rclpy.init(args=sys.argv)
    node = rclpy.create_node("permit_listener")
    listener = PermitListener(node, given.task, robot=given.robot, table=given.table, topic=given.topic)
    said = None
    try:
        while rclpy.ok():
            rclpy.spin_once(node, timeout_sec=0.01)
            says = "permit" if listener.permitted() else f"no permit: {listener.reason()}"
            if says != said:
                print(f"{time.time():.3f} {says}", flush=True)
                said = says
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == "__main__":
    main()
