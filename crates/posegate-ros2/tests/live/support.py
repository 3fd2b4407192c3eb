"""Shared code of the live tests: the node as a process, a peer of rclpy, results as JSON lines. Loopback only."""

import ctypes
import hashlib
import itertools
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
NODE = os.environ["POSEGATE_NODE"]
PROGRAM = os.environ["POSEGATE"]
TABLE = ROOT / "examples/tables/dock.posegate"
# The robot and the table that every permit of these tests must name.
ROBOT = "/posegate"
DIGEST = hashlib.sha256(TABLE.read_bytes()).hexdigest()
SITE = ROOT / "examples/sites/dock.toml"
# A domain of its own for each test: no other program on this machine is received.
os.environ["ROS_DOMAIN_ID"] = str(random.SystemRandom().randrange(10, 100))
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
os.environ["RMW_IMPLEMENTATION"] = "rmw_fastrtps_cpp"
sys.path.insert(0, str(ROOT / "integrations/ros2"))

import rclpy  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from permit_listener import PermitListener  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from std_msgs.msg import Bool  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

beyond = []
started = []
POSES = itertools.count()

LATCHED = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DEEP = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def figure(name, value, unit, goal=None, at_least=True):
    """Prints a figure; notes it if it is beyond its goal."""
    print(json.dumps({"name": f"ros2: {name}", "value": value, "unit": unit, "goal": goal}), flush=True)
    if goal is not None and not (value >= goal if at_least else value <= goal):
        beyond.append(name)


def require(holds, what):
    """Ends the test unless the condition is true."""
    if not holds:
        end(f"failed: {what}")


def end(failure=None):
    """Ends every process of the test, and the test itself: rclpy is slow to shut down."""
    for process in started:
        if process.poll() is None:
            process.kill()
            process.wait()
    failure = failure or ("beyond a goal: " + "; ".join(beyond) if beyond else None)
    if failure:
        print(failure, file=sys.stderr)
    sys.stdout.flush()
    os._exit(1 if failure else 0)


def end_with_parent():
    """Has the kernel kill this process when the test ends in any way."""
    PR_SET_PDEATHSIG = 1
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def start(*parameters, options=(), ros=(), table=None):
    """Starts the node, on the test's table if no other one is given."""
    words = [NODE, str(table or TABLE), *options, "--ros-args"]
    for parameter in parameters:
        words += ["-p", parameter]
    process = subprocess.Popen([*words, *ros], stderr=subprocess.DEVNULL, preexec_fn=end_with_parent)
    started.append(process)
    return process


def pose(x=0.0, frame="map", stamp_ns=None, variance=1e-4):
    """Returns a pose at the dock, stamped now. Its covariance is never that of the pose before, as of a filter."""
    variance *= 1 + 1e-4 * (next(POSES) % 100)
    message = PoseWithCovarianceStamped()
    stamp_ns = time.time_ns() if stamp_ns is None else stamp_ns
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    message.header.frame_id = frame
    message.pose.pose.position.x = x
    message.pose.pose.orientation.w = 1.0
    for at, value in ((0, variance), (7, variance), (35, variance / 10)):
        message.pose.covariance[at] = value
    return message


class Peer:
    """A program of ROS that publishes poses, follows the permit and reads the diagnostics."""

    def __init__(self, name="peer", qos=LATCHED):
        if not rclpy.ok():
            rclpy.init()
        self.node = rclpy.create_node(name)
        self.listener = PermitListener(self.node, "dock", robot=ROBOT, table=hashlib.sha256(TABLE.read_bytes()).hexdigest())
        self.poses = self.node.create_publisher(PoseWithCovarianceStamped, "/amcl_pose", qos) if qos else None
        self.published = 0.0
        self.heartbeats = []
        self.bools = []
        self.states = {}
        self.node.create_subscription(DiagnosticArray, "/posegate/permission", self.heartbeats.append, 100)
        self.node.create_subscription(Bool, "/posegate/permit", lambda message: self.bools.append(message.data), LATCHED)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._diagnostics, 10)

    def _diagnostics(self, message):
        for status in message.status:
            self.states[status.name] = status

    def spin(self, seconds):
        """Receives for a time."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            rclpy.spin_once(self.node, timeout_sec=0.002)

    def drive(self, seconds, make=pose, period=0.05, until=None):
        """Publishes poses for a time, or until a condition is true. Returns True if it became true."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            # Also across calls: two poses of one millisecond are refused.
            if time.monotonic() >= self.published + period:
                self.published = time.monotonic()
                self.poses.publish(make())
            rclpy.spin_once(self.node, timeout_sec=0.002)
            if until is not None and until():
                return True
        return False

    def open(self):
        """Publishes good poses until the permit is given."""
        require(self.drive(20.0, until=self.listener.permitted), f"no permit: {self.listener.reason()}")

    def wait(self, seconds, condition):
        """Receives until a condition is true, and returns the elapsed time. None if it is not true in time."""
        begin = time.monotonic()
        while time.monotonic() - begin < seconds:
            if condition():
                return time.monotonic() - begin
            rclpy.spin_once(self.node, timeout_sec=0.002)
        return None

    def call(self, name, make=None):
        """Calls a service of the node, and publishes poses meanwhile."""
        client = self.node.create_client(Trigger, name)

        def wait(condition):
            return self.drive(10.0, make, until=condition) if make else self.wait(10.0, condition) is not None

        require(wait(client.service_is_ready), f"no service {name}")
        answer = client.call_async(Trigger.Request())
        require(wait(answer.done), f"{name} does not answer")
        return answer.result()

    def close(self):
        """Leaves the graph."""
        self.node.destroy_node()
