"""Detections of tags, published on bare DDS with the types of apriltag_msgs and sensor_msgs: permits, two poses, what is missing.

There is no wheel of apriltag_msgs, so the messages are written down here, field by field. The table is built from tags.toml.
"""

import math
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import bare_dds  # before anything that joins a domain
import support
from bare_dds import Header
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from support import Peer, end, figure, require, start

SITE = Path(__file__).resolve().parent / "tags.toml"
# Size, x, y and heading of the face: as in the site.
TAGS = {7: (0.04, 1.25, 0.0, 200.0), 8: (0.15, 1.35, 0.2, 225.0)}
GOAL = (0.0, 0.0, 0.0)


@dataclass
class Detection(IdlStruct, typename="apriltag_msgs::msg::dds_::AprilTagDetection_"):
    family: str
    id: int32
    hamming: int32
    goodness: float32
    decision_margin: float32
    centre: array[float64, 2]
    corners: array[float64, 8]
    homography: array[float64, 9]


@dataclass
class Detections(IdlStruct, typename="apriltag_msgs::msg::dds_::AprilTagDetectionArray_"):
    header: Header
    detections: sequence[Detection]


@dataclass
class Region(IdlStruct, typename="sensor_msgs::msg::dds_::RegionOfInterest_"):
    x_offset: uint32
    y_offset: uint32
    height: uint32
    width: uint32
    do_rectify: bool


@dataclass
class CameraInfo(IdlStruct, typename="sensor_msgs::msg::dds_::CameraInfo_"):
    header: Header
    height: uint32
    width: uint32
    distortion_model: str
    d: sequence[float64]
    k: array[float64, 9]
    r: array[float64, 9]
    p: array[float64, 12]
    binning_x: uint32
    binning_y: uint32
    roi: Region


def detection(number, pose):
    """Returns the detection of an upright tag at the camera's height, from a pose of the robot."""
    size, tag_x, tag_y, normal = TAGS[number]
    x, y, yaw = pose
    sin, cos = math.sin(math.radians(normal)), math.cos(math.radians(normal))
    pixels = []
    for across, up in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
        dx, dy = tag_x - sin * across * size - x, tag_y + cos * across * size - y
        ahead = math.cos(yaw) * dx + math.sin(yaw) * dy - 0.25
        left = math.cos(yaw) * dy - math.sin(yaw) * dx
        pixels += [640 - 1720 * left / ahead, 480 - 1720 * up * size / ahead]
    return Detection("tag36h11", number, 0, 0.0, 80.0, [640.0, 480.0], pixels, [0.0] * 9)


def camera_info(width=1280):
    """Returns the calibration of the site's camera."""
    k = [1720.0, 0.0, 640.0, 0.0, 1720.0, 480.0, 0.0, 0.0, 1.0]
    r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    p = [1720.0, 0.0, 640.0, 0.0, 0.0, 1720.0, 480.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    return CameraInfo(bare_dds.header("front"), 960, width, "plumb_bob", [0.0] * 5, k, r, p, 0, 0, Region(0, 0, 0, 0, False))


class Camera:
    """Publishes an image's detections ten times a second, and the camera info with them."""

    def __init__(self, peer):
        self.peer = peer
        participant = bare_dds.participant()
        self.detections = DataWriter(participant, Topic(participant, "rt/detections", Detections), qos=bare_dds.qos())
        best_effort = bare_dds.qos(reliable=False)
        self.infos = DataWriter(participant, Topic(participant, "rt/camera_info", CameraInfo), qos=best_effort)
        self.due = 0.0

    def drive(self, seconds, found, info=camera_info, until=None):
        """Publishes for a time, or until a condition is true. Returns True if it became true."""
        begin = time.monotonic()
        while time.monotonic() - begin < seconds:
            if time.monotonic() >= self.due:
                self.due = time.monotonic() + 0.1
                if info is not None:
                    self.infos.write(info())
                self.detections.write(Detections(bare_dds.header("front"), [detection(number, GOAL) for number in found]))
            self.peer.spin(0.005)
            if until is not None and until():
                return True
        return False

    def says(self, found, info, words):
        """Publishes until the diagnostics contain the words, and requires that nothing is permitted meanwhile."""

        def reported():
            state = self.peer.states.get("posegate: tags")
            return state is not None and words in state.message

        require(self.drive(5.0, found, info, reported), f"not in the diagnostics: {words}")
        require(not self.peer.listener.permitted(), f"permitted: {words}")


def main():
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "dock.posegate"
        subprocess.run([support.PROGRAM, "table", "build", SITE, "--task", "dock", "-o", table], check=True, capture_output=True)
        support.TABLE = table
        start(
            "stands_still:=true",
            "use_detections:=true",
            "corner_sigma_px:=0.3",
            options=("--site", str(SITE)),
        )
        peer = Peer(qos=None)
        camera = Camera(peer)
        # Without the camera info no detection is used, and the diagnostics report it.
        camera.says([8], None, "no camera info has arrived on /camera_info")
        camera.says([8], lambda: camera_info(width=640), "is for an image of 640 x 960")
        permitted = peer.listener.permitted
        require(camera.drive(20.0, [8], until=permitted), f"no permit: {peer.listener.reason()}")
        figure("detections of a tag with one pose permit", 1, "permits", 1)
        # Two poses, one of them far from the goal.
        require(camera.drive(2.0, [7], until=lambda: not permitted()), "two poses do not end the permit")
        require(not camera.drive(4.0, [7], until=permitted), "two poses permit")
        state = {pair.key: pair.value for pair in peer.states["posegate: tags"].values}
        figure("images with two poses, none of which permits", int(state["two_poses"]), "images", 10)
        # Both tags together leave one pose.
        require(camera.drive(20.0, [7, 8], until=permitted), f"no permit with two tags: {peer.listener.reason()}")
        # No tag: the permit ends when its time is over.
        require(camera.drive(2.0, [], until=lambda: not permitted()), "no tag, and the permit stays")
        camera.says([], camera_info, "no tag is detected")
        figure("faults of detections that the diagnostics name", 3, "faults", 3)


main()
end()
