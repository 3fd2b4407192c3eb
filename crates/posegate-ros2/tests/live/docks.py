"""A node with the tables of twenty docks: the task is asked for by name. And poses of every type, each with a permit at the dock."""

import hashlib
import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import bare_dds  # before anything that joins a domain
from bare_dds import Header
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, sequence
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from support import LATCHED, ROOT, TABLE, Peer, end, figure, pose, require, start
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import String

STILL = "stands_still:=true"
BOUND = ("set_translation_m:=0.02", "set_yaw_deg:=1.0")
# The most memory of a node with twenty docks.
MOST_MB = 40


@dataclass
class Transform(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: Header
    child_frame_id: str
    translation_and_rotation: array[float64, 7]


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    transforms: sequence[Transform]


class TransformWriter:
    """Publishes transforms on bare DDS: there is no wheel with tf2_msgs."""

    def __init__(self):
        participant = bare_dds.participant()
        self.writer = DataWriter(participant, Topic(participant, "rt/tf", TFMessage), qos=bare_dds.qos())

    def publish(self, message):
        self.writer.write(message)


def built(folder):
    """Writes a folder as `posegate site merge` does, with the table of the dock and nineteen others."""
    (folder / "tables").mkdir()
    files = []
    for number in range(20):
        table = TABLE if number == 0 else ROOT / "examples/tables/see-t7.posegate"
        path = f"tables/{number}.posegate"
        (folder / path).write_bytes(table.read_bytes())
        files.append({"path": path, "bytes": table.stat().st_size, "sha256": hashlib.sha256(table.read_bytes()).hexdigest()})
    (folder / "manifest.json").write_text(json.dumps({"format": 1, "files": files}))


def megabytes(process):
    """Returns the resident memory of a process."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")) / 1024


def many_docks():
    with tempfile.TemporaryDirectory() as folder:
        built(Path(folder))
        node = start(STILL, table=folder)
        peer = Peer()
        asked = peer.node.create_publisher(String, "posegate_task", LATCHED)
        opened = peer.drive(4.0, until=peer.listener.permitted)
        require(not opened, "a node that was asked for no task permits")
        require("no task is asked for" in peer.call("/posegate/explain").message, "no task")
        asked.publish(String(data="dock"))
        peer.open()
        figure("docks: memory of a node with twenty docks", round(megabytes(node), 1), "MB", MOST_MB, at_least=False)
        begin = time.monotonic()
        asked.publish(String(data="see-t7"))
        require(peer.drive(1.0, until=lambda: not peer.listener.permitted()), "a change of the task does not close")
        figure("docks: change of the task to `no permit`", round((time.monotonic() - begin) * 1e3, 1), "ms", 100, at_least=False)
        require(not peer.drive(2.0, until=peer.listener.permitted), "the permit of another task is obeyed")
        asked.publish(String(data="dokc"))
        require(not peer.drive(2.0, until=peer.listener.permitted), "an unknown task permits")
        require("`dokc` that is asked for is not in the site" in peer.call("/posegate/explain").message, "unknown task")
        asked.publish(String(data="dock"))
        peer.open()
        node.kill()
        peer.close()


def odometry():
    message = Odometry()
    message.header = pose().header
    message.child_frame_id = "base_link"
    message.pose = pose().pose
    # A filter's covariance changes.
    message.pose.covariance[0] *= 1.0 + 1e-6 * (time.time_ns() % 1000)
    return message


def plain():
    message = PoseStamped()
    message.header, message.pose = pose().header, pose().pose.pose
    return message


def transforms():
    """As Cartographer without odometry: the robot in the map."""
    return TFMessage([Transform(bare_dds.header("map"), "base_link", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])])


def types():
    """Poses of each type give a permit; a pose of an unknown frame is refused with words."""
    opened = 0
    for name, kind, topic, make, more in [
        ("odometry", Odometry, "/amcl_pose", odometry, ()),
        ("pose", PoseStamped, "/amcl_pose", plain, BOUND),
        ("tf", None, "/tf", transforms, BOUND),
    ]:
        node = start(STILL, f"pose_type:={name}", *more)
        peer = Peer(qos=None)
        peer.poses = peer.node.create_publisher(kind, topic, 10) if kind else TransformWriter()
        require(peer.drive(20.0, make, until=peer.listener.permitted), f"{name}: {peer.listener.reason()}")
        opened += 1
        if name == "odometry":

            def of_antenna():
                message = odometry()
                message.child_frame_id = "antenna"
                return message

            require(peer.drive(2.0, of_antenna, until=lambda: not peer.listener.permitted()), "a pose of an antenna permits")
            peer.drive(1.5, of_antenna)
            require("[frame.antenna]" in peer.states["posegate: pose"].message, peer.states["posegate: pose"].message)
        node.kill()
        peer.close()
    figure("types of poses that open", opened, "types", 3)


many_docks()
types()
end()
