"""The permit ends at the consumer within its stated time if the node or the source of poses stops, or if messages are out of order."""

import random
import signal
import sys
import time

from support import DEEP, Peer, end, figure, pose, require, start

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 10
# valid_ms, and the resolution of the clocks.
STATED_MS = 250
LATE_MS = 5
# The node notices a silent source when its last permit has been held for permit_hold_ms; it then publishes a denial.
HOLD_MS = 800


def stops(name, stop, limit_ms, go_on=None):
    """Stops something many times, and reports the longest time until the consumer says `no permit`."""
    longest = 0.0
    for _ in range(RUNS):
        node = start("stands_still:=true")
        peer = Peer()
        peer.open()
        peer.drive(random.uniform(0.0, 0.1))
        require(peer.listener.permitted(), f"no permit before: {peer.listener.reason()}")
        stop(node)
        # The last moment of a permit at the consumer counts, not the time of the next query.
        begin = last = time.monotonic()
        keeps_driving = name != "the source of poses"
        while True:
            asked = time.monotonic()
            if not peer.listener.permitted():
                break
            last = asked
            if keeps_driving:
                peer.drive(0.001)
            else:
                peer.spin(0.001)
            require(time.monotonic() - begin < 5.0, f"{name}: permitted for 5 s")
        longest = max(longest, last - begin)
        if go_on is not None:
            go_on(node, peer)
        node.kill()
        node.wait()
        peer.close()
    figure(f"{name} stops: longest time to `no permit`, {RUNS} times", round(longest * 1e3, 1), "ms", limit_ms, at_least=False)


def after_a_pause(node, peer):
    """A node that was paused must qualify again: nothing that it sent before, or sends first, permits."""
    peer.spin(1.0)
    before = len(peer.heartbeats)
    node.send_signal(signal.SIGCONT)
    begin = time.monotonic()
    # Without new poses it stays closed.
    while time.monotonic() - begin < 1.0:
        peer.spin(0.002)
        require(not peer.listener.permitted(), "a permit after a pause")
    later = [message for message in peer.heartbeats[before:] if message.status[0].message == "permit"]
    old = [m for m in later if m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 > time.time() - 1.0]
    require(not old, f"{len(old)} permits of a node that was paused")
    peer.open()


def flood():
    """1,000 poses a second: bad ones never permit, and the node stays alive."""
    node = start("stands_still:=true")
    peer = Peer(qos=DEEP)
    peer.open()
    peer.poses.publish(pose(x=0.5))
    peer.wait(1.0, lambda: not peer.listener.permitted())
    wrong = sent = 0
    begin = time.monotonic()
    while time.monotonic() - begin < 5.0:
        while sent < (time.monotonic() - begin) * 1000:
            # One of ten is bad: no ten in a row may count for longer than the hold time.
            peer.poses.publish(pose(x=0.5 if sent % 10 == 0 else 0.0))
            sent += 1
        peer.spin(0.002)
        wrong += peer.listener.permitted()
    figure("flood: poses per second", round(sent / 5.0), "poses/s", 950)
    figure("flood: wrong permits", wrong, "permits", 0, at_least=False)
    require(node.poll() is None, "the node died of a flood")
    peer.open()
    node.kill()
    peer.close()


def damaged():
    """Damaged payloads over the network: no permit, and the node stays alive."""
    from rclpy.serialization import serialize_message

    # One good pose is enough to open.
    node = start("stands_still:=true", "permits_in_a_row:=1", "inhibit_hold_ms:=1")
    peer = Peer(qos=DEEP)
    peer.open()
    peer.poses.publish(pose(x=0.5))
    require(peer.wait(1.0, lambda: not peer.listener.permitted()) is not None, "the denial does not end the permit")
    peer.spin(0.6)
    wrong = 0
    generator = random.Random(1)
    for _ in range(3000):
        # Bad on both axes: damage to one of them can make it good, and DDS has no checksum to find that.
        message = pose(x=3.0)
        message.pose.pose.position.y = 3.0
        payload = bytearray(serialize_message(message))
        for _ in range(generator.randrange(1, 4)):
            at = generator.randrange(4, len(payload)) if len(payload) > 4 else 0
            match generator.randrange(4):
                case 0:
                    del payload[max(at, 5) :]
                case 1 if at < len(payload):
                    payload[at] ^= 1 << generator.randrange(8)
                case 2:
                    payload += bytes(generator.randrange(64))
                case _ if at < len(payload):
                    payload[at] = generator.randrange(256)
        peer.poses.publish(bytes(payload))
        peer.spin(0.001)
        wrong += peer.listener.permitted()
    figure("damaged payloads over the network: wrong permits", wrong, "permits", 0, at_least=False)
    require(node.poll() is None, "the node died of a damaged payload")
    peer.spin(1.2)
    values = {pair.key: pair.value for pair in peer.states["posegate: pose"].values}
    figure("damaged payloads over the network: unreadable", int(values["unreadable"]), "messages", 100)
    peer.open()
    node.kill()
    peer.close()


stops("kill -9: the node", lambda node: node.kill(), STATED_MS + LATE_MS)
stops("SIGSTOP: the node", lambda node: node.send_signal(signal.SIGSTOP), STATED_MS + LATE_MS, after_a_pause)
stops("the source of poses", lambda node: None, HOLD_MS + 20 + 50 + LATE_MS)
flood()
damaged()
end()
