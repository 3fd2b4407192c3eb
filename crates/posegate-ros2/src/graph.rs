//! The node in the ROS graph: its subscriptions, publishers and services on DDS.

use crate::entities::{Entities, GraphError, Topic, reliable};
use crate::message::{
    AprilTagDetectionArray, CameraInfo, DiagnosticArray, Header, Marker, Odometry, Pose,
    PoseStamped, PoseWithCovarianceStamped, Single, TransformStamped, TriggerResponse,
};
use crate::names::Names;
use crate::poses::PoseType;
use crate::received::Received;
use crate::services::{self, Service};
use crate::settings::{Delivery, NodeSettings};
use ros2_client::error::CreateError;
use ros2_client::qos::{Durability, History, Liveliness};
use ros2_client::{Context, NodeName, NodeOptions, Publisher, QosProfile, Server, ServiceMapping};
use rustdds::mio1::Poll;
use rustdds::{DomainParticipantBuilder, DomainParticipantStatusListener, StatusEvented};
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::time::Duration;

/// The time from joining the graph to the first topic. Two nodes that start together may announce their topics out of order. RustDDS puts no source
/// timestamp on an announcement, and Fast DDS then loses some of them for good. After this time the others are known, and announcements arrive in
/// order.
const SETTLE: Duration = Duration::from_millis(500);

/// The environment of a ROS program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`.
    pub domain: u16,
    /// `true` if the node communicates only with programs on this machine.
    pub localhost_only: bool,
    /// The mapping of services: `RMW_IMPLEMENTATION` of the other programs.
    pub services: ServiceMapping,
}

impl Environment {
    /// Reads the variables that ROS programs read, through a function such as `std::env::var(..).ok()`.
    ///
    /// # Errors
    /// [`GraphError::Environment`]
    pub fn read(variable: impl Fn(&str) -> Option<String>) -> Result<Self, GraphError> {
        let given = |name: &'static str| variable(name).filter(|value| !value.is_empty());
        let refused = |name, given, expected| GraphError::Environment {
            name,
            given,
            expected,
        };
        let text = given("ROS_DOMAIN_ID").unwrap_or_else(|| "0".into());
        let domain = text.parse().ok().filter(|domain| *domain <= 232);
        let expected = "a whole number from 0 to 232";
        let domain = domain.ok_or_else(|| refused("ROS_DOMAIN_ID", text, expected))?;
        let name = "ROS_AUTOMATIC_DISCOVERY_RANGE";
        let range = given(name).unwrap_or_else(|| "SUBNET".into());
        let is_near = match range.as_str() {
            "LOCALHOST" => true,
            "SUBNET" | "SYSTEM_DEFAULT" => false,
            _ => {
                let expected =
                    "LOCALHOST, SUBNET or SYSTEM_DEFAULT; this node cannot do without discovery";
                return Err(refused(name, range, expected));
            }
        };
        let is_cyclone =
            given("RMW_IMPLEMENTATION").is_some_and(|name| name == "rmw_cyclonedds_cpp");
        Ok(Self {
            domain,
            localhost_only: is_near || given("ROS_LOCALHOST_ONLY").as_deref() == Some("1"),
            services: if is_cyclone {
                ServiceMapping::Cyclone
            } else {
                ServiceMapping::Enhanced
            },
        })
    }
}

/// A message with poses, or with what they are computed from.
#[expect(clippy::large_enum_variant, reason = "one at a time, and never kept")]
pub enum Input {
    /// A pose of a frame on the robot, if the message names it, with its covariance, if it has one.
    Pose(Header, Option<String>, Pose, Option<[f64; 36]>),
    /// Transforms.
    Transforms(Vec<TransformStamped>),
    /// Detections of tags.
    Detections(AprilTagDetectionArray),
}

const ODOMETRY: [&str; 2] = ["nav_msgs", "Odometry"];
const DIAGNOSTICS: [&str; 2] = ["diagnostic_msgs", "DiagnosticArray"];
const TRIGGER: [&str; 2] = ["std_srvs", "Trigger"];

/// The node in the graph.
pub struct Graph {
    /// Events of discovery.
    pub events: DomainParticipantStatusListener,
    /// The poses, or the detections from which they are computed.
    pub input: Topic<Input>,
    /// The camera info, if detections are used.
    pub camera_info: Option<Topic<CameraInfo>>,
    /// The odometry, if it is used.
    pub odom: Option<Topic<Odometry>>,
    /// The name of the task, if it is asked for.
    pub task: Option<Topic<String>>,
    /// The fail-safe permit.
    pub permission: Publisher<DiagnosticArray>,
    /// The permit for display only.
    pub permit: Publisher<bool>,
    /// The diagnostics.
    pub diagnostics: Publisher<DiagnosticArray>,
    /// The markers.
    pub markers: Publisher<Vec<Marker>>,
    /// The service that resets the gate.
    pub reset: Server<Single<u8>, TriggerResponse>,
    /// The service that returns the reason why the gate is closed.
    pub explain: Server<Single<u8>, TriggerResponse>,
    /// The services of the parameters, and of the lifecycle of a managed node.
    pub services: Vec<Service>,
    threads: DdsThreads,
    // Fields are dropped in their order: the node is in the last one.
    entities: Entities,
}

impl Graph {
    /// Joins the graph. If it takes tasks, it subscribes to their names.
    ///
    /// # Errors
    /// [`GraphError`]
    pub fn join(
        environment: Environment,
        names: &Names,
        settings: &NodeSettings,
        takes_tasks: bool,
    ) -> Result<Self, GraphError> {
        let before = DdsThreads::now();
        let mut participant = DomainParticipantBuilder::new(environment.domain);
        if environment.localhost_only {
            participant = participant.with_only_networks([IpAddr::V4(Ipv4Addr::LOCALHOST)]);
        }
        let participant = participant.build().map_err(CreateError::from)?;
        let mut events = participant.status_listener();
        std::thread::sleep(SETTLE);
        let context = Context::from_domain_participant(participant)?;
        let node_name = NodeName::new(&names.namespace, &names.node);
        let node_name = node_name.map_err(|error| GraphError::Dds(format!("{error:?}")))?;
        // The library's services of parameters need its own loop, which would take the events of discovery.
        let options = NodeOptions::new()
            .enable_rosout(false)
            .start_parameter_services(false);
        let node = context.new_node(node_name, options);
        let mut entities = Entities {
            node: node.map_err(|error| GraphError::Dds(error.to_string()))?,
            services: environment.services,
            poll: Poll::new()?,
        };
        let input = input(&mut entities, names, settings)?;
        let camera_info = settings.detector.as_ref().map(|_| {
            entities.topic(
                &names.camera_info,
                ["sensor_msgs", "CameraInfo"],
                settings.camera_info_delivery,
                "camera_info_reliability to best_effort",
                |message| message,
            )
        });
        let odom = settings.tracker.map(|_| {
            entities.topic(
                &names.odom,
                ODOMETRY,
                settings.odom_delivery,
                "odom_reliability to best_effort, or odom_durability to volatile",
                |message| message,
            )
        });
        let latched = Delivery {
            reliable: true,
            transient_local: true,
        };
        let text = ["std_msgs", "String"];
        let task = takes_tasks.then(|| entities.topic(&names.task, text, latched, "", |name| name));
        let latched = reliable().durability(Durability::TransientLocal);
        let several = reliable().history(History::KeepLast { depth: 10 });
        let of_markers = ["visualization_msgs", "MarkerArray"];
        entities.wake_at(events.as_status_source_mio1())?;
        Ok(Self {
            events,
            input,
            camera_info: camera_info.transpose()?,
            odom: odom.transpose()?,
            task: task.transpose()?,
            permission: entities.publisher(
                &names.permission,
                DIAGNOSTICS,
                heartbeat_qos(settings),
            )?,
            permit: entities.publisher(&names.permit, ["std_msgs", "Bool"], latched)?,
            diagnostics: entities.publisher(&names.diagnostics, DIAGNOSTICS, several)?,
            markers: entities.publisher(&names.markers, of_markers, reliable())?,
            reset: entities.server(&names.reset, TRIGGER)?,
            explain: entities.server(&names.explain, TRIGGER)?,
            services: services::offer(&mut entities, names.full_node(), settings.is_managed)?,
            threads: DdsThreads::now().without(&before),
            entities,
        })
    }

    /// Waits for messages.
    pub fn poll(&mut self) -> &mut Poll {
        &mut self.entities.poll
    }

    /// Returns `true` if the threads of DDS run.
    ///
    /// They end if one of their waits is interrupted: by SIGSTOP and SIGCONT, a debugger, or a suspended machine. The
    /// node then neither receives nor sends, and must join again.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.threads.run()
    }

    /// Returns the counts of all topics with poses, and with what they are computed from.
    pub fn received(&mut self) -> impl Iterator<Item = &mut Received> {
        let odom = self.odom.as_mut().map(|topic| &mut topic.received);
        let camera_info = self.camera_info.as_mut().map(|topic| &mut topic.received);
        std::iter::once(&mut self.input.received)
            .chain(odom)
            .chain(camera_info)
    }
}

/// Subscribes to the poses, or to the detections from which they are computed.
fn input(
    entities: &mut Entities,
    names: &Names,
    settings: &NodeSettings,
) -> Result<Topic<Input>, GraphError> {
    if settings.detector.is_some() {
        return entities.topic(
            &names.detections,
            ["apriltag_msgs", "AprilTagDetectionArray"],
            settings.detections_delivery,
            "detections_reliability to best_effort, or detections_durability to volatile",
            Input::Detections,
        );
    }
    let kind = settings.poses.kind;
    let (name, delivery) = (names.of_poses(kind), settings.pose_delivery);
    let words = "pose_reliability to best_effort, or pose_durability to volatile";
    match kind {
        PoseType::WithCovariance => {
            let of = ["geometry_msgs", "PoseWithCovarianceStamped"];
            entities.topic(name, of, delivery, words, |message| {
                let PoseWithCovarianceStamped { header, pose } = message;
                Input::Pose(header, None, pose.pose, Some(pose.covariance))
            })
        }
        PoseType::Odometry => entities.topic(name, ODOMETRY, delivery, words, |message| {
            let Odometry { header, pose, .. } = message;
            let child = Some(message.child_frame_id);
            Input::Pose(header, child, pose.pose, Some(pose.covariance))
        }),
        PoseType::Pose => {
            let of = ["geometry_msgs", "PoseStamped"];
            entities.topic(name, of, delivery, words, |PoseStamped { header, pose }| {
                Input::Pose(header, None, pose, None)
            })
        }
        PoseType::Transforms => {
            let of = ["tf2_msgs", "TFMessage"];
            let mut topic = entities.topic(name, of, delivery, words, Input::Transforms)?;
            topic.received.peers.is_shared = true;
            Ok(topic)
        }
    }
}

/// The quality of service of the heartbeat: a stated period, and a liveliness that only a publication asserts.
fn heartbeat_qos(settings: &NodeSettings) -> QosProfile {
    let ms = |ms: u32| Some(Duration::from_millis(u64::from(ms)));
    reliable()
        .deadline(ms(2 * settings.heartbeat_ms))
        .liveliness(Liveliness::ManualByTopic)
        .liveliness_lease(ms(settings.valid_ms))
}

/// Threads of DDS, by their numbers in the operating system. Linux only: on other systems the list is empty, and all
/// count as running.
struct DdsThreads(Vec<PathBuf>);

impl DdsThreads {
    /// Returns the threads that run now.
    fn now() -> Self {
        let Ok(threads) = std::fs::read_dir("/proc/self/task") else {
            return Self(Vec::new());
        };
        let paths = threads.flatten().map(|thread| thread.path());
        let is_dds = |path: &PathBuf| {
            let name = std::fs::read_to_string(path.join("comm"));
            name.is_ok_and(|name| name.starts_with("RustDDS"))
        };
        Self(paths.filter(is_dds).collect())
    }

    fn without(mut self, others: &Self) -> Self {
        self.0.retain(|path| !others.0.contains(path));
        self
    }

    fn run(&self) -> bool {
        self.0.iter().all(|path| path.exists())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &[(&str, &str)]) -> Result<Environment, GraphError> {
        Environment::read(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn environment_follows_ros_variables() {
        let plain = read(&[]).unwrap();
        assert_eq!((plain.domain, plain.localhost_only), (0, false));
        let given = read(&[
            ("ROS_DOMAIN_ID", "42"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
            ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"),
        ]);
        let given = given.unwrap();
        assert_eq!((given.domain, given.localhost_only), (42, true));
        assert_eq!(given.services, ServiceMapping::Cyclone);
        for wrong in [
            ("ROS_DOMAIN_ID", "233"),
            ("ROS_DOMAIN_ID", "x"),
            ("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"),
        ] {
            assert!(read(&[wrong]).is_err(), "{wrong:?}");
        }
    }
}
