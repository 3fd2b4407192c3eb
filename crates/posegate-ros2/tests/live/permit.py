"""Poses give and end a permit; services; what the diagnostics say; quality of service."""

import signal
import subprocess

from support import (
    DurabilityPolicy,
    NODE,
    Peer,
    QoSProfile,
    ReliabilityPolicy,
    TABLE,
    end,
    figure,
    pose,
    require,
    start,
)

STILL = ("stands_still:=true",)


def gives_and_ends():
    """Good poses give a permit; each bad one ends it with its reason."""
    node = start(*STILL)
    peer = Peer()
    cases = [
        ("outside_table", lambda: pose(x=0.5)),
        ("not_contained", lambda: pose(x=0.07)),
        ("frame_mismatch", lambda: pose(frame="odom")),
        ("covariance_zero", lambda: pose(variance=0.0)),
        ("stale", lambda: pose(stamp_ns=10**18 * 2)),
    ]
    ended = 0
    for reason, make in cases:
        peer.open()
        require(peer.drive(1.0, until=lambda: peer.bools[-1:] == [True]), "the Bool does not follow")
        # Not in the same millisecond as the last pose.
        peer.spin(0.005)
        # A stamp far away has no place on the gate's clock and counts as too old, or as not newer than the last one.
        expected = {reason, "time_backwards"} if reason == "stale" else {reason}
        peer.poses.publish(make())
        took = peer.wait(1.0, lambda: peer.listener.reason() in expected)
        require(took is not None, f"{reason} does not end the permit: {peer.listener.reason()}")
        require(peer.wait(0.5, lambda: peer.bools[-1] is False) is not None, "the Bool does not follow")
        ended += 1
    figure("kinds of bad poses that end the permit with their reason", ended, "kinds", len(cases))
    require("frame `odom`, expected `map`" in words_of(peer, lambda: pose(frame="odom"), "posegate: pose"), "wrong frame")
    answer = peer.call("/posegate/explain")
    require(answer.success and "deny, " in answer.message, answer)
    peer.open()
    answer = peer.call("/posegate/explain", pose)
    require(answer.message == "permit", answer)
    # An orderly end publishes a denial, which is faster than silence.
    peer.open()
    peer.drive(0.2)
    require(peer.listener.permitted(), f"no permit before SIGTERM: {peer.listener.reason()}")
    node.send_signal(signal.SIGTERM)
    took = peer.wait(1.0, lambda: not peer.listener.permitted())
    require(took is not None and node.wait(timeout=5) == 0, "SIGTERM")
    # Silence alone would take up to 250 ms; the last heartbeat is at most 50 ms old.
    figure("SIGTERM to `no permit`", round(took * 1e3, 1), "ms", 100, at_least=False)
    peer.close()


def resets():
    """With restart on_reset a denial waits for the service."""
    node = start(*STILL, "restart:=on_reset")
    peer = Peer()
    peer.open()
    peer.poses.publish(pose(x=0.5))
    require(peer.wait(1.0, lambda: not peer.listener.permitted()) is not None, "the denial does not end the permit")
    opened = peer.drive(2.0, until=peer.listener.permitted)
    require(not opened, "the gate opened again without a reset")
    require(peer.call("/posegate/reset").success, "the reset is refused")
    require(not peer.listener.permitted(), "the reset itself opened the gate")
    peer.open()
    node.kill()
    peer.close()
    figure("resets that are needed", 1, "resets", 1)


def words_of(peer, make, name):
    """Returns the message of the diagnostics after a second of poses."""
    peer.drive(1.6, make)
    return peer.states[name].message if name in peer.states else ""


def reports_faults_of_the_graph():
    """No publisher, two publishers, best effort, volatile: each is in the diagnostics and does not open the gate."""
    node = start(*STILL, "pose_durability:=transient_local")
    peer = Peer(qos=None)
    peer.wait(5.0, lambda: "posegate: pose" in peer.states)
    require("nobody publishes /amcl_pose" in peer.states["posegate: pose"].message, "missing publisher")
    reliable, best_effort = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
    for qos, words in [
        (QoSProfile(depth=1, reliability=best_effort), "it offers best effort, and reliable is requested"),
        (QoSProfile(depth=1, reliability=reliable), "it offers volatile, and transient local is requested"),
    ]:
        other = Peer("other", qos)
        opened = other.drive(3.0, until=other.listener.permitted)
        require(not opened, "a publisher that does not match opened the gate")
        peer.spin(1.2)
        message = peer.states["posegate: pose"].message
        require(words in message, f"{words}: {message}")
        # Not the link is to blame.
        answer = peer.call("/posegate/explain")
        require(words in answer.message and "link" not in answer.message, answer.message)
        other.close()
        peer.spin(1.2)
    node.kill()
    # With the parameter that the message names, it works.
    node = start(*STILL, "pose_reliability:=best_effort")
    other = Peer("other", QoSProfile(depth=1, reliability=best_effort, durability=DurabilityPolicy.VOLATILE))
    other.open()
    node.kill()
    other.close()
    node = start(*STILL)
    first, second = Peer("first"), Peer("second")
    opened = False
    for _ in range(60):
        first.drive(0.05)
        second.drive(0.05)
        opened = opened or first.listener.permitted()
    require(not opened, "two publishers that alternate opened the gate")
    require("2 publishers" in first.states["posegate: pose"].message, first.states["posegate: pose"].message)
    node.kill()
    figure("faults of the graph that the diagnostics name", 5, "faults", 5)


def refuses():
    """Invalid arguments are refused with a message and exit code 2."""
    refused = 0
    for words in [
        [],
        [str(TABLE)],
        [str(TABLE), "--task-digest", "00" * 32, "--ros-args", "-p", "stands_still:=true"],
        [str(TABLE), "--ros-args", "-p", "stands_still:=true", "-p", "inflation:=0.1"],
        [__file__, "--ros-args", "-p", "stands_still:=true"],
    ]:
        ended = subprocess.run([NODE, *words], capture_output=True, text=True, timeout=10, check=False)
        refused += ended.returncode == 2 and ended.stderr.startswith("posegate-node: ") and len(ended.stderr) > 40
    figure("wrong command lines that are refused", refused, "lines", 5)


def names_the_hold():
    """Poses that come too rarely for the hold never open; the diagnostics and the service name the hold that would."""
    node = start(*STILL, "permit_hold_ms:=200")
    peer = Peer()
    opened = peer.drive(4.0, period=0.3, until=peer.listener.permitted)
    require(not opened, "poses that are too rare opened the gate")
    answer = peer.call("/posegate/explain").message
    require("with permit_hold_ms of 3" in answer and "link" not in answer, answer)
    # Simulated time is named.
    words = words_of(peer, lambda: pose(stamp_ns=42 * 10**9), "posegate: pose")
    require("simulated time" in words, words)
    node.kill()
    peer.close()
    figure("causes that explain names", 2, "causes", 2)


refuses()
names_the_hold()
gives_and_ends()
resets()
reports_faults_of_the_graph()
end()
