"""Shared code of peers on bare DDS (Cyclone DDS, without rclpy): loopback only, messages of std_msgs, quality of service."""

import os

os.environ["CYCLONEDDS_URI"] = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
    "<AllowMulticast>true</AllowMulticast></General></Domain></CycloneDDS>"
)

import time  # noqa: E402
from dataclasses import dataclass  # noqa: E402

from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct  # noqa: E402
from cyclonedds.idl.types import int32, uint32  # noqa: E402
from cyclonedds.util import duration  # noqa: E402


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


def header(frame):
    """Returns a header that is stamped now."""
    return Header(Time(*divmod(time.time_ns(), 10**9)), frame)


def participant():
    """Joins the domain of the test."""
    return DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))


def qos(latched=False, reliable=True):
    """Returns a quality of service that keeps the last message; `latched` gives it to subscribers that come later."""
    reliability = Policy.Reliability.Reliable(duration(milliseconds=100)) if reliable else Policy.Reliability.BestEffort
    durability = Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile
    # Classic CDR, as ROS writes it.
    classic = Policy.DataRepresentation(use_cdrv0_representation=True)
    return Qos(reliability, durability, Policy.History.KeepLast(1), classic)
