"""Three robots in one domain. No robot is permitted by the node of another one: in namespaces of their own, on one topic, and under one
name."""

import hashlib
import subprocess
import time

from support import (
    DIGEST,
    LATCHED,
    NODE,
    ROOT,
    TABLE,
    PermitListener,
    PoseWithCovarianceStamped,
    end,
    figure,
    pose,
    rclpy,
    require,
    start,
    started,
)

STILL = ("stands_still:=true",)
PERMISSION = "posegate/permission"


class Robot:
    """A namespace with a publisher of poses."""

    def __init__(self, number):
        self.space = f"/robot{number}"
        self.name = f"{self.space}/posegate"
        self.node = rclpy.create_node("peer", namespace=self.space)
        self.poses = self.node.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        self.listener = PermitListener(self.node, "dock", robot=self.name, table=DIGEST)

    def start(self, *ros):
        """Starts the node of this robot."""
        return start(*STILL, ros=("-r", f"__ns:={self.space}", *ros))


def drive(robots, localized, seconds, also=(), until=lambda: False):
    """Publishes poses of the robots that are localized. Returns how often each listener was asked, and how often it permitted."""
    listeners = [robot.listener for robot in robots] + list(also)
    permits = [0] * len(listeners)
    asks, due = 0, 0.0
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s and not until():
        if time.monotonic() >= due:
            due = time.monotonic() + 0.05
            for robot in localized:
                robot.poses.publish(pose())
        for robot in robots:
            rclpy.spin_once(robot.node, timeout_sec=0.001)
        asks += 1
        for k, listener in enumerate(listeners):
            permits[k] += listener.permitted()
    return asks, permits


def main():
    rclpy.init()
    robots = [Robot(number) for number in (1, 2, 3)]
    one, two, three = robots
    nodes = [robot.start() for robot in robots]
    # The consumers of robot 1 that read the topic of robot 2, and expect the right table, robot, or both of robot 2.
    other_table = hashlib.sha256((ROOT / "examples/tables/contingent-dock.posegate").read_bytes()).hexdigest()
    wrong = [
        PermitListener(one.node, "dock", robot=one.name, table=DIGEST, topic=f"{two.space}/{PERMISSION}"),
        PermitListener(one.node, "dock", robot=two.name, table=other_table, topic=f"{two.space}/{PERMISSION}"),
        PermitListener(one.node, "other", robot=two.name, table=DIGEST, topic=f"{two.space}/{PERMISSION}"),
    ]
    drive(robots, [two, three], 20.0, until=lambda: two.listener.permitted() and three.listener.permitted())
    asks, permits = drive(robots, [two, three], 5.0, wrong)
    reasons = [robot.listener.reason() for robot in robots]
    require(min(permits[1:3]) > 0.9 * asks, f"robots 2 and 3 are not permitted: {permits} of {asks}: {reasons}")
    require(f"robot {two.name}, expected {one.name}" in wrong[0].reason(), wrong[0].reason())
    require("by the table" in wrong[1].reason(), wrong[1].reason())
    figure("fleet: permits of a robot without a pose, in namespaces", permits[0], "permits", 0, at_least=False)
    figure("fleet: permits by another robot, table or task", sum(permits[3:]), "permits", 0, at_least=False)
    for node in nodes:
        node.kill()

    # One topic and one name for two nodes; only one of them gets poses. Their runs alternate.
    nodes = [robot.start("-r", f"{PERMISSION}:=/shared", "-p", "robot:=cart") for robot in (one, two)]
    shared = PermitListener(one.node, "dock", robot="cart", table=DIGEST, topic="/shared")
    # The first of them is obeyed until the other one joins.
    drive(robots, [two], 20.0, [shared], until=lambda: "two nodes" in (shared.reason() or ""))
    asks, permits = drive(robots, [two], 6.0, [shared])
    require("two nodes" in shared.reason(), shared.reason())
    figure("fleet: permits of two nodes with one name", permits[3], "permits", 0, at_least=False)
    # When one is stopped, the other one permits.
    nodes[0].kill()
    drive(robots, [two], 40.0, [shared], until=shared.permitted)
    require(shared.permitted(), shared.reason())

    words = [NODE, str(TABLE), "--ros-args", "-p", STILL[0], "-r", "__ns:=/robot1", "-r", "/amcl_pose:=/x"]
    refused = subprocess.run(words, capture_output=True, text=True, timeout=10, check=False)
    require(refused.returncode == 2 and "/robot1/amcl_pose" in refused.stderr, refused.stderr)

    # Poses of another robot's namespace: a warning before anything else.
    words = [NODE, str(TABLE), "--ros-args", "-p", STILL[0], "-r", "__ns:=/robot2", "-r", "pose:=/robot1/amcl_pose"]
    node = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
    started.append(node)
    line = node.stderr.readline()
    require("warning: /robot1/amcl_pose is not in the namespace /robot2" in line, line)


if __name__ == "__main__":
    main()
    end()
