"""The permit with Cyclone DDS: a peer on bare DDS that publishes poses and follows the heartbeat, without rclpy."""

import time
from dataclasses import dataclass

import bare_dds  # before anything that joins a domain
from bare_dds import Header
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float64, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from support import DIGEST, ROBOT, end, figure, require, start
from permit_listener import PermitWatch


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovarianceStamped_"):
    header: Header
    pose: array[float64, 7]
    covariance: array[float64, 36]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class Status(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class Array(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[Status]


def main():
    participant = bare_dds.participant()
    writer = DataWriter(participant, Topic(participant, "rt/amcl_pose", PoseStamped), qos=bare_dds.qos(latched=True))
    reader = DataReader(participant, Topic(participant, "rt/posegate/permission", Array), qos=bare_dds.qos())
    watch = PermitWatch("dock", robot=ROBOT, table=DIGEST)

    def drive(seconds, x, until):
        begin, due = time.monotonic(), 0.0
        while time.monotonic() - begin < seconds:
            if x is not None and time.monotonic() >= due:
                due = time.monotonic() + 0.05
                covariance = [0.0] * 36
                covariance[0] = covariance[7] = 1e-4
                covariance[35] = 1e-5
                writer.write(PoseStamped(bare_dds.header("map"), [x, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], covariance))
            for message in reader.take(N=10):
                # Ignores the notification that the publisher has left.
                if isinstance(message, Array):
                    watch.heartbeat(message, time.time_ns(), time.monotonic_ns())
            if until(watch.permitted(time.monotonic_ns())):
                return time.monotonic() - begin
            time.sleep(0.002)
        return None

    node = start("stands_still:=true")
    took = drive(20.0, 0.0, lambda permitted: permitted)
    require(took is not None, f"no permit with Cyclone DDS: {watch.reason}")
    took = drive(1.0, 0.5, lambda permitted: not permitted)
    require(took is not None and watch.reason == "outside_table", f"a bad pose: {watch.reason}")
    require(drive(20.0, 0.0, lambda permitted: permitted) is not None, "no permit again")
    node.kill()
    took = drive(2.0, 0.0, lambda permitted: not permitted)
    require(took is not None, "the permit outlives its node")
    figure("Cyclone DDS: kill -9 to `no permit`", round(took * 1e3, 1), "ms", 265, at_least=False)


main()
end()
