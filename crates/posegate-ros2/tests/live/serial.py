"""A controller on a serial line: `examples/interrupt_gate.rs` in QEMU, on a pseudo-terminal that this test can cut, garble and delay.

Usage: serial.py FIRMWARE RUNS
"""

import os
import pty
import random
import select
import signal
import subprocess
import sys
import threading
import time
import tty

import support
from support import Peer, end, figure, pose, require

FIRMWARE, RUNS = sys.argv[1], int(sys.argv[2])
# link_timeout_ms, a cycle, valid_ms, and the resolution of the clocks. Without the last but one if the node runs: but this machine may be busy.
STATED_MS = 150 + 20 + 250 + 5


class Line:
    """A pseudo-terminal, and the bytes between it and the board."""

    def __init__(self):
        self.damage = None
        self.open()
        self.board = None
        self.boot()
        threading.Thread(target=self.relay, daemon=True).start()

    def open(self):
        """Makes a pseudo-terminal. The near end is closed: the node wants it for itself."""
        self.far, near = pty.openpty()
        tty.setraw(near)
        self.device = os.ttyname(near)
        os.close(near)
        # Output of the board is dropped while the node is disconnected.
        os.set_blocking(self.far, False)

    def boot(self):
        """Starts the board, or starts it again as a reset does."""
        if self.board:
            self.board.kill()
            self.board.wait()
        words = ["qemu-system-arm", "-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "stdio", "-kernel", FIRMWARE]
        self.board = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, preexec_fn=support.end_with_parent
        )
        support.started.append(self.board)

    def relay(self):
        """Passes bytes both ways. `damage` changes what the node gets, and may return nothing."""
        while True:
            board = self.board
            ready, _, _ = select.select([self.far, board.stdout], [], [], 0.05)
            for end in ready:
                try:
                    if end is self.far:
                        data = os.read(self.far, 4096)
                        if self.damage != self.cut:
                            board.stdin.write(data)
                    else:
                        data = os.read(board.stdout.fileno(), 4096)
                        data = self.damage(data) if self.damage else data
                        if data:
                            os.write(self.far, data)
                except OSError:
                    # The board was reset, or the node is disconnected.
                    time.sleep(0.002)

    def cut(self, _):
        return b""

    def garble(self, data):
        """Flips a bit of every message."""
        bad = bytearray(data)
        for at in range(0, len(bad), 16):
            bad[at] ^= 1 << random.randrange(8)
        return bytes(bad)

    def garbage(self, data):
        return random.randbytes(max(len(data), 64))

    def replay(self):
        """Returns a damage that repeats the output of the board during a permit."""
        held = bytearray()
        at = 0

        def again(data):
            nonlocal at
            if len(held) < 500:
                held.extend(data)
                return data
            piece = (bytes(held) * 2)[at : at + len(data)]
            at = (at + len(data)) % len(held)
            return piece

        return again


line = Line()
peer = Peer()
node = None


def start():
    global node
    node = support.start(options=("--serial", line.device))


def opened():
    """Publishes good poses until the controller permits. Another try after each end of a permit: this machine may be busy."""
    require(peer.drive(60.0, until=peer.listener.permitted), f"no permit: {peer.listener.reason()} {state()}")


def state():
    status = peer.states.get("posegate: controller")
    return status and (status.message, {value.key: value.value for value in status.values})


def ended(cause, act, undo=None, good=True, more_ms=0):
    """Measures for how long the consumer sees a permit after a cause, while good poses are still published."""
    longest = 0.0
    for _ in range(RUNS):
        opened()
        # The last moment of a permit at the consumer counts, not the time of the next query.
        begin = last = time.monotonic()
        act()
        while True:
            asked = time.monotonic()
            if not peer.listener.permitted():
                break
            last = asked
            if good:
                peer.drive(0.001)
            else:
                peer.spin(0.001)
            require(time.monotonic() - begin < 5.0, f"{cause}: permitted for 5 s")
        longest = max(longest, last - begin)
        if undo:
            # It does not come back while the cause lasts.
            until = time.monotonic() + 1.0
            while time.monotonic() < until:
                peer.drive(0.005)
                require(not peer.listener.permitted(), f"{cause}: a permit again")
            undo()
    figure(f"serial: {cause}: longest time to `no permit`, {RUNS} times", round(longest * 1000.0, 1), "ms", STATED_MS + more_ms, at_least=False)


def set_damage(damage):
    line.damage = damage


start()
opened()


def counts():
    """Returns True if the last diagnostics count messages in both directions. Diagnostics come once a second."""
    return state() and all(int(state()[1][name]) > 0 for name in ("telemetry", "controller_bytes"))


require(peer.wait(5.0, counts) is not None, f"telemetry: {state()}")
_, values = state()
figure("serial: telemetry messages that were published", int(values["telemetry"]), "messages")

# What the controller denies.
require(peer.drive(20.0, make=lambda: pose(x=0.07), until=lambda: not peer.listener.permitted()), "a permit outside of the set")
require(peer.drive(20.0, make=lambda: pose(x=0.07), until=lambda: peer.listener.reason() == "not_contained"), peer.listener.reason())
opened()
require(peer.drive(20.0, make=lambda: pose(frame="odom"), until=lambda: peer.listener.reason() == "frame_mismatch"), peer.listener.reason())

# Ages are those of the robot's clock: an estimate from half a second ago is too old for the controller, and one of the future too new.
opened()
old = lambda: pose(stamp_ns=time.time_ns() - 500_000_000)  # noqa: E731
require(peer.drive(20.0, make=old, until=lambda: peer.listener.reason() == "stale"), peer.listener.reason())
opened()
new = lambda: pose(stamp_ns=time.time_ns() + 500_000_000)  # noqa: E731
require(peer.drive(20.0, make=new, until=lambda: not peer.listener.permitted()), "a permit for a pose of the future")
peer.drive(1.0, make=new, until=peer.listener.permitted)
require(not peer.listener.permitted(), "a permit for a pose of the future")
# The heartbeat names the report that the controller evaluated.
opened()
values = {value.key: value.value for value in peer.heartbeats[-1].status[0].values}
require(abs(time.time() - float(values["report_stamp"])) < 5.0 and values["report_verdict"] == "permit", f"the report: {values}")

ended("the source of poses stops", act=lambda: None, good=False)
ended("the line is cut", act=lambda: set_damage(line.cut), undo=lambda: set_damage(None))
ended("every message is damaged", act=lambda: set_damage(line.garble), undo=lambda: set_damage(None))
ended("noise alone", act=lambda: set_damage(line.garbage), undo=lambda: set_damage(None))
# The first repetition may count as new, for a tenth of a second.
ended("the line repeats itself", act=lambda: set_damage(line.replay()), undo=lambda: set_damage(None), more_ms=150)
ended("the controller is reset", act=line.boot)
# The firmware may take the jump of its clock for a fault, which only a reset ends.
ended("the controller hangs", act=lambda: line.board.send_signal(signal.SIGSTOP), undo=line.boot)
ended("the node is paused", act=lambda: node.send_signal(signal.SIGSTOP), undo=lambda: node.send_signal(signal.SIGCONT))


def kill():
    node.kill()
    node.wait()


ended("the node is killed", act=kill, undo=start)

opened()
answer = peer.call("/posegate/reset", pose)
require(not answer.success and "controller" in answer.message, answer.message)
answer = peer.call("/posegate/explain", pose)
require(answer.success, answer.message)

# Random damage for a time: the permit is only ever the controller's.
wrong = seen = 0
set_damage(lambda data: data if random.random() < 0.7 else line.garble(data))
until = time.monotonic() + 10.0
while time.monotonic() < until:
    # Outside of the set: whatever arrives damaged, nothing permits.
    peer.drive(0.05, make=lambda: pose(x=0.07))
    seen += 1
    wrong += peer.listener.permitted() and time.monotonic() > until - 9.0
set_damage(None)
figure("serial: permits outside of the set on a damaged line", wrong, "permits", 0, at_least=False)
require(seen > 50, "too few looks")
end()
