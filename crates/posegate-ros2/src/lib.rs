//! Posegate as a ROS 2 node: poses with covariance in, a fail-safe permit out.
//!
//! [`permit_gate::PermitGate`] is the gate of the core behind ROS messages, without DDS. [`run::Runner`] is the node. The program
//! `posegate-node` parses a command line ([`arguments::Command`]) and runs it. What the topics mean and what a consumer of the permit
//! must do is described in `docs/for-ros.md`.

pub mod arguments;
pub mod clock;
pub mod diagnostics;
pub mod graph;
pub mod markers;
pub mod message;
pub mod names;
pub mod parameters;
pub mod peers;
pub mod permission;
pub mod permit_gate;
pub mod run;
pub mod settings;
