"""The rules of the permit in `integrations/ros2/permit_listener.py`, one by one, with messages and clocks of this test."""

import copy
from types import SimpleNamespace

from support import end, figure, require
from permit_listener import MOST_VALID_MS, PermitWatch

MS = 1_000_000
NOW = 1_800_000_000 * 10**9
ROBOT = "/robot1/posegate"


def heartbeat(ros_ns=NOW, sequence=1, **changed):
    """Returns a heartbeat that permits, with changes."""
    values = {
        "format": "2",
        "task": "dock",
        "robot": ROBOT,
        "table": "abc",
        "run": "r1",
        "sequence": str(sequence),
        "valid_ms": "250",
        "state": "permitted",
        "reason": "",
    }
    status = {"name": "posegate", "level": b"\x00", "message": "permit"}
    for key, value in changed.items():
        (status if key in status else values)[key] = value
    pairs = [SimpleNamespace(key=key, value=value) for key, value in values.items() if value is not None]
    sec, nanosec = divmod(ros_ns, 10**9)
    return SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec)),
        status=[SimpleNamespace(values=pairs, **status)],
    )


def decides(message, robot=ROBOT, table="abc"):
    """Returns True if a new watch permits on a message."""
    watch = PermitWatch("dock", robot=robot, table=table)
    watch.heartbeat(message, NOW, 0)
    return watch.permitted(0)


def main():
    require(decides(heartbeat()), "a good heartbeat does not permit")
    refused = {
        "no status": SimpleNamespace(header=heartbeat().header, status=[]),
        "two": SimpleNamespace(header=heartbeat().header, status=heartbeat().status * 2),
        "empty": SimpleNamespace(
            header=SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0)),
            status=[SimpleNamespace(level=b"\x00", name="", message="", values=[])],
        ),
    }
    for key, value in [
        ("name", "other"),
        ("level", b"\x01"),
        ("message", "deny"),
        ("format", "1"),
        ("format", None),
        ("task", "park"),
        ("task", None),
        ("robot", "/robot2/posegate"),
        ("robot", None),
        ("table", "def"),
        ("table", None),
        ("run", None),
        ("sequence", None),
        ("valid_ms", "0"),
        ("valid_ms", "-5"),
        ("valid_ms", str(MOST_VALID_MS + 1)),
        ("valid_ms", "many"),
        ("valid_ms", None),
        ("state", "latched"),
        ("state", None),
        ("reason", "silent"),
        ("reason", None),
    ]:
        refused[f"{key}={value}"] = heartbeat(**{key: value})
    twice = heartbeat()
    twice.status[0].values.append(copy.copy(twice.status[0].values[0]))
    refused["twice"] = twice
    refused["old"] = heartbeat(ros_ns=NOW - 250 * MS)
    refused["future"] = heartbeat(ros_ns=NOW + 21 * MS)
    for name, message in refused.items():
        require(not decides(message), f"permitted: {name}")
    for robot in ("", None):
        require(not decides(heartbeat(robot=robot), robot=robot), "an empty robot")
        require(not decides(heartbeat(table=robot), table=robot), "an empty table")
    figure("listener: heartbeats that are refused", len(refused) + 4, "heartbeats", 32)

    # It ends by itself, by the stamp and by the monotonic clock, and a denial ends it at once.
    watch = PermitWatch("dock", robot=ROBOT, table="abc")
    watch.heartbeat(heartbeat(), NOW + 100 * MS, 5_000 * MS)
    require(watch.permitted(5_149 * MS) and not watch.permitted(5_150 * MS), "the end is not 250 ms after the stamp")
    require(not watch.permitted(5_140 * MS), "a permit that has ended came back")
    watch.heartbeat(heartbeat(sequence=2), NOW, 6_000 * MS)
    require(watch.permitted(6_000 * MS), "no second permit")
    # An older or repeated heartbeat of the same run also ends it; a new run waits until it is alone for a second.
    watch.heartbeat(heartbeat(sequence=2), NOW, 6_001 * MS)
    require(not watch.permitted(6_001 * MS), "a repeated heartbeat permits")
    for k in range(100):
        watch.heartbeat(heartbeat(sequence=3 + k, run=f"r{k % 2 + 1}"), NOW, (6_002 + k) * MS)
        require(k == 0 or not watch.permitted((6_002 + k) * MS), "two runs that alternate permit")
    watch.heartbeat(heartbeat(sequence=200, run="r2"), NOW, 16_100 * MS)
    require(not watch.permitted(16_100 * MS), "a run that came back permits within ten seconds")
    watch.heartbeat(heartbeat(sequence=201, run="r2"), NOW, 16_101 * MS)
    require(watch.permitted(16_101 * MS), f"a run that is alone does not permit: {watch.reason}")
    watch.heartbeat(heartbeat(sequence=1, run="r3"), NOW, 17_000 * MS)
    watch.heartbeat(heartbeat(sequence=2, run="r3"), NOW, 17_999 * MS)
    require(not watch.permitted(17_999 * MS), "a new run permits within a second")
    watch.heartbeat(heartbeat(sequence=3, run="r3"), NOW, 18_000 * MS)
    require(watch.permitted(18_000 * MS), f"a new run does not permit: {watch.reason}")
    denial = heartbeat(sequence=4, run="r3", message="deny", state="inhibited", reason="silent")
    watch.heartbeat(denial, NOW, 18_003 * MS)
    require(not watch.permitted(18_003 * MS) and watch.reason == "silent", "a denial does not end the permit")
    figure("listener: a permit ends by itself", 250, "ms after its stamp", 250, at_least=False)


main()
end()
