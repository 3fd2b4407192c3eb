//! Posegate as a ROS 2 node: poses with covariance in, a fail-safe permit out.
//!
//! [`poses::Poses`] converts messages with a pose, and [`tags::Tags`] computes poses from detections of tags. [`permit_gate::PermitGate`] is the gate of the core behind
//! ROS messages, without DDS. [`bridge::Bridge`] passes them to a gate on a controller instead. [`run::Runner`] is
//! the node; with several tables it decides by a [`docks::DockGate`]. The program `posegate-node` parses a command line ([`arguments::Arguments`]) and runs it.
//! `docs/for-ros.md` describes the topics, and what a consumer of the permit must do.

pub mod arguments;
pub mod bridge;
pub mod clock;
pub mod decider;
pub mod diagnostics;
pub mod docks;
pub mod entities;
#[cfg(test)]
mod fixtures;
pub mod graph;
pub mod lifecycle;
pub mod link;
pub mod markers;
pub mod message;
pub mod names;
pub mod parameter_services;
pub mod parameters;
pub mod peers;
pub mod permission;
pub mod permit_gate;
pub mod permit_watch;
pub mod poses;
pub mod received;
pub mod run;
pub mod serial;
pub mod services;
pub mod settings;
pub mod tags;
