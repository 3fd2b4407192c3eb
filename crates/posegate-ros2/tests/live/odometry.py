"""Fixes carried along the odometry: fewer fixes suffice, and a broken odometry ends the permit."""

import time

from nav_msgs.msg import Odometry
from support import Peer, end, figure, pose, require, start

ERRORS = ("odometry_m_per_sqrt_m:=0.005", "odometry_rad_per_sqrt_rad:=0.01", "odometry_rad_per_sqrt_m:=0.005", "odometry_slip:=0.02")
SLOW = ("max_speed:=0.03", "max_yaw_rate_deg:=0.5", "cross_terms:=filled", "maximum_fix_age_ms:=1500", "odometry_maximum_gap_ms:=300")


class Wheels:
    """Publishes odometry of a robot that does not move, at 50 Hz."""

    def __init__(self, peer):
        self.publisher = peer.node.create_publisher(Odometry, "/odom", 10)
        self.peer = peer
        self.x = 0.0
        self.due = 0.0

    def turn(self):
        """Publishes if it is time."""
        if time.monotonic() < self.due:
            return
        self.due = time.monotonic() + 0.02
        message = Odometry()
        stamp_ns = time.time_ns()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
        message.header.frame_id = "odom"
        message.pose.pose.position.x = self.x
        message.pose.pose.orientation.w = 1.0
        self.publisher.publish(message)

    def drive(self, seconds, fixes_every=None, until=None):
        """Publishes odometry, and fixes at intervals. Returns True if a condition became true."""
        begin = time.monotonic()
        due = begin
        while time.monotonic() - begin < seconds:
            self.turn()
            if fixes_every is not None and time.monotonic() >= due:
                due = time.monotonic() + fixes_every
                # A fix that took 60 ms to compute.
                self.peer.poses.publish(pose(stamp_ns=time.time_ns() - 60_000_000))
            self.peer.spin(0.003)
            if until is not None and until():
                return True
        return False


def main():
    node = start("use_odometry:=true", *ERRORS, *SLOW)
    peer = Peer()
    wheels = Wheels(peer)
    listener = peer.listener
    # One fix a second: without odometry, three in a row within the hold time would never come.
    require(wheels.drive(15.0, 1.0, listener.permitted), f"no permit with odometry: {listener.reason()}")
    begin = time.monotonic()
    lost = wheels.drive(4.0, 1.0, lambda: not listener.permitted())
    require(not lost, f"the permit ended between two fixes: {listener.reason()}")
    figure("a permit with one fix a second and odometry stays", round(time.monotonic() - begin, 1), "s", 4.0)
    # A jump of the odometry: a reset.
    wheels.x = 1.0
    require(wheels.drive(0.3, until=lambda: listener.reason() == "odometry_jump"), f"a jump: {listener.reason()}")
    figure("a jump of the odometry ends the permit", 1, "permits", 1)
    require(wheels.drive(15.0, 1.0, listener.permitted), "no permit after the jump")
    # The odometry stops: fixes alone give no permit.
    begin = time.monotonic()
    ended = peer.wait(2.0, lambda: not listener.permitted())
    require(ended is not None and ended < 0.5, f"no odometry: {ended}")
    figure("the odometry stops: time to `no permit`", round(ended * 1e3, 1), "ms", 350, at_least=False)
    require(not peer.drive(2.0, until=listener.permitted), "fixes without odometry permit")
    # No fix: the carried one gets too old.
    require(wheels.drive(15.0, 0.5, listener.permitted), "no permit again")
    begin = time.monotonic()
    require(wheels.drive(4.0, until=lambda: not listener.permitted()), "permitted for 4 s without a fix")
    figure("no fix: time to `no permit`", round((time.monotonic() - begin) * 1e3), "ms", 1600, at_least=False)
    node.kill()


main()
end()
