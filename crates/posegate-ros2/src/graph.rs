//! The node in the ROS graph: its subscriptions, publishers and services on DDS.

use crate::message::{
    AprilTagDetectionArray, Bool, CameraInfo, DiagnosticArray, MarkerArray, Odometry, PoseStamped,
    PoseWithCovarianceStamped, Text, TfMessage, TriggerRequest, TriggerResponse,
};
use crate::names::Names;
use crate::peers::Peers;
use crate::poses::PoseType;
use crate::received::Received;
use crate::services::{LifecycleServers, ParameterServers};
use crate::settings::{Delivery, NodeSettings};
use ros2_client::error::CreateError;
use ros2_client::qos::{Durability, History, Liveliness, WhenFull};
use ros2_client::{
    Context, Message, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile,
    Server, ServiceMapping, ServiceTypeName, Subscription,
};
use rustdds::mio1::{Interest, Poll, Token};
use rustdds::{DomainParticipantBuilder, DomainParticipantStatusListener, StatusEvented};
use serde::Serialize;
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::time::Duration;

/// Messages that wait for the node: those of one cycle at 1,000 per second, and a reserve.
const DEPTH: usize = 64;

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

/// The reason why the graph cannot be joined.
#[derive(Debug, thiserror::Error)]
pub enum GraphError {
    /// A variable of the environment is invalid.
    #[error("{name} is `{given}`: expected {expected}")]
    Environment {
        /// The variable.
        name: &'static str,
        /// The variable's value.
        given: String,
        /// The expected value.
        expected: &'static str,
    },
    /// DDS reports an error.
    #[error("cannot join the ROS graph: {0}; check ROS_DOMAIN_ID and the network")]
    Dds(String),
    /// The operating system cannot wait for messages.
    #[error("cannot wait for messages: {0}")]
    Poll(#[from] std::io::Error),
}

impl From<CreateError> for GraphError {
    fn from(error: CreateError) -> Self {
        Self::Dds(error.to_string())
    }
}

impl Environment {
    /// Reads the variables that ROS programs read, through a function such as `std::env::var(..).ok()`.
    ///
    /// # Errors
    /// [`GraphError::Environment`]
    pub fn read(variable: impl Fn(&str) -> Option<String>) -> Result<Self, GraphError> {
        let given = |name: &'static str| variable(name).filter(|value| !value.is_empty());
        let domain = match given("ROS_DOMAIN_ID") {
            None => 0,
            Some(text) => match text.parse::<u16>() {
                Ok(domain) if domain <= 232 => domain,
                _ => {
                    return Err(GraphError::Environment {
                        name: "ROS_DOMAIN_ID",
                        given: text,
                        expected: "a whole number from 0 to 232",
                    });
                }
            },
        };
        let range = given("ROS_AUTOMATIC_DISCOVERY_RANGE").unwrap_or_else(|| "SUBNET".into());
        let is_near = match range.as_str() {
            "LOCALHOST" => true,
            "SUBNET" | "SYSTEM_DEFAULT" => false,
            _ => {
                return Err(GraphError::Environment {
                    name: "ROS_AUTOMATIC_DISCOVERY_RANGE",
                    given: range,
                    expected: "LOCALHOST, SUBNET or SYSTEM_DEFAULT; this node cannot do without discovery",
                });
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

/// The source of poses.
pub enum Input {
    /// Poses with covariance.
    Poses(Subscription<PoseWithCovarianceStamped>),
    /// Poses of odometry's type.
    Odometry(Subscription<Odometry>),
    /// Poses without covariance.
    Plain(Subscription<PoseStamped>),
    /// Transforms.
    Transforms(Subscription<TfMessage>),
    /// Detections, and the camera info.
    Detections(
        Subscription<AprilTagDetectionArray>,
        Box<Subscription<CameraInfo>>,
    ),
}

const ODOMETRY: [&str; 2] = ["nav_msgs", "Odometry"];
const DETECTIONS: [&str; 2] = ["apriltag_msgs", "AprilTagDetectionArray"];
const CAMERA_INFO: [&str; 2] = ["sensor_msgs", "CameraInfo"];

/// Returns the package and the name of a type of poses.
const fn type_of(kind: PoseType) -> [&'static str; 2] {
    match kind {
        PoseType::WithCovariance => ["geometry_msgs", "PoseWithCovarianceStamped"],
        PoseType::Odometry => ODOMETRY,
        PoseType::Pose => ["geometry_msgs", "PoseStamped"],
        PoseType::Transforms => ["tf2_msgs", "TFMessage"],
    }
}

/// The node in the graph.
pub struct Graph {
    /// Waits for messages.
    pub poll: Poll,
    /// Events of discovery.
    pub events: DomainParticipantStatusListener,
    /// The poses, or the detections from which they are computed.
    pub input: Input,
    /// The odometry, if it is used.
    pub odom: Option<Subscription<Odometry>>,
    /// The name of the task, if it is asked for.
    pub task: Option<Subscription<Text>>,
    /// The fail-safe permit.
    pub permission: Publisher<DiagnosticArray>,
    /// The permit for display only.
    pub permit: Publisher<Bool>,
    /// The diagnostics.
    pub diagnostics: Publisher<DiagnosticArray>,
    /// The markers.
    pub markers: Publisher<MarkerArray>,
    /// The service that resets the gate.
    pub reset: Server<TriggerRequest, TriggerResponse>,
    /// The service that returns the reason why the gate is closed.
    pub explain: Server<TriggerRequest, TriggerResponse>,
    /// The services of the parameters.
    pub parameters: ParameterServers,
    /// The services of the lifecycle, of a managed node alone.
    pub lifecycle: Option<LifecycleServers>,
    threads: DdsThreads,
    // Fields are dropped in their order: the node is the last one.
    _node: Node,
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
        let events = participant.status_listener();
        std::thread::sleep(SETTLE);
        let context = Context::from_domain_participant(participant)?;
        let node_name = NodeName::new(&names.namespace, &names.node);
        let node_name = node_name.map_err(|error| GraphError::Dds(format!("{error:?}")))?;
        // The library's services of parameters need its own loop, which would take the events of discovery.
        let options = NodeOptions::new()
            .enable_rosout(false)
            .start_parameter_services(false);
        let node = context.new_node(node_name, options);
        let mut builder = Builder {
            node: node.map_err(|error| GraphError::Dds(error.to_string()))?,
            services: environment.services,
        };
        let mut input = match settings.detector {
            None => {
                let kind = settings.poses.kind;
                let (name, delivery) = (names.of_poses(kind), settings.pose_delivery);
                let of = type_of(kind);
                match kind {
                    PoseType::WithCovariance => {
                        Input::Poses(builder.subscription(name, of, delivery)?)
                    }
                    PoseType::Odometry => {
                        Input::Odometry(builder.subscription(name, of, delivery)?)
                    }
                    PoseType::Pose => Input::Plain(builder.subscription(name, of, delivery)?),
                    PoseType::Transforms => {
                        Input::Transforms(builder.subscription(name, of, delivery)?)
                    }
                }
            }
            Some(_) => Input::Detections(
                builder.subscription(
                    &names.detections,
                    DETECTIONS,
                    settings.detections_delivery,
                )?,
                Box::new(builder.subscription(
                    &names.camera_info,
                    CAMERA_INFO,
                    settings.camera_info_delivery,
                )?),
            ),
        };
        let mut odom = match settings.tracker {
            Some(_) => Some(builder.subscription(&names.odom, ODOMETRY, settings.odom_delivery)?),
            None => None,
        };
        let latched = Delivery {
            reliable: true,
            transient_local: true,
        };
        let mut task = match takes_tasks {
            true => Some(builder.subscription(&names.task, ["std_msgs", "String"], latched)?),
            false => None,
        };
        let diagnostic = ["diagnostic_msgs", "DiagnosticArray"];
        let permission =
            builder.publisher(&names.permission, diagnostic, heartbeat_qos(settings))?;
        let latched = reliable().durability(Durability::TransientLocal);
        let permit = builder.publisher(&names.permit, ["std_msgs", "Bool"], latched)?;
        let several = reliable().history(History::KeepLast { depth: 10 });
        let diagnostics = builder.publisher(&names.diagnostics, diagnostic, several)?;
        let markers = builder.publisher(
            &names.markers,
            ["visualization_msgs", "MarkerArray"],
            reliable(),
        )?;
        let trigger = ["std_srvs", "Trigger"];
        let mut reset = builder.server(&names.reset, trigger)?;
        let mut explain = builder.server(&names.explain, trigger)?;
        let own = |name: &str| format!("{}/{name}", names.full_node());
        let of_parameters = |kind| ["rcl_interfaces", kind];
        let parameters = ParameterServers {
            get: builder.server(&own("get_parameters"), of_parameters("GetParameters"))?,
            types: builder.server(
                &own("get_parameter_types"),
                of_parameters("GetParameterTypes"),
            )?,
            set: builder.server(&own("set_parameters"), of_parameters("SetParameters"))?,
            set_at_once: builder.server(
                &own("set_parameters_atomically"),
                of_parameters("SetParametersAtomically"),
            )?,
            list: builder.server(&own("list_parameters"), of_parameters("ListParameters"))?,
            describe: builder.server(
                &own("describe_parameters"),
                of_parameters("DescribeParameters"),
            )?,
        };
        let of_lifecycle = |kind| ["lifecycle_msgs", kind];
        let lifecycle = match settings.is_managed {
            true => Some(LifecycleServers {
                change: builder.server(&own("change_state"), of_lifecycle("ChangeState"))?,
                current: builder.server(&own("get_state"), of_lifecycle("GetState"))?,
                states: builder.server(
                    &own("get_available_states"),
                    of_lifecycle("GetAvailableStates"),
                )?,
                transitions: builder.server(
                    &own("get_available_transitions"),
                    of_lifecycle("GetAvailableTransitions"),
                )?,
            }),
            false => None,
        };
        let mut events = events;
        let poll = Poll::new()?;
        let registry = poll.registry();
        match &mut input {
            Input::Poses(pose) => registry.register(pose, Token(0), Interest::READABLE)?,
            Input::Odometry(pose) => registry.register(pose, Token(0), Interest::READABLE)?,
            Input::Plain(pose) => registry.register(pose, Token(0), Interest::READABLE)?,
            Input::Transforms(pose) => registry.register(pose, Token(0), Interest::READABLE)?,
            Input::Detections(detections, camera_info) => {
                registry.register(detections, Token(0), Interest::READABLE)?;
                registry.register(camera_info.as_mut(), Token(5), Interest::READABLE)?;
            }
        }
        registry.register(&mut reset, Token(1), Interest::READABLE)?;
        registry.register(&mut explain, Token(2), Interest::READABLE)?;
        registry.register(events.as_status_source_mio1(), Token(3), Interest::READABLE)?;
        if let Some(odom) = &mut odom {
            registry.register(odom, Token(4), Interest::READABLE)?;
        }
        if let Some(task) = &mut task {
            registry.register(task, Token(6), Interest::READABLE)?;
        }
        Ok(Self {
            poll,
            events,
            input,
            odom,
            task,
            permission,
            permit,
            diagnostics,
            markers,
            reset,
            explain,
            parameters,
            lifecycle,
            threads: DdsThreads::now().without(&before),
            _node: builder.node,
        })
    }

    /// Returns `true` if the threads of DDS run.
    ///
    /// They end if one of their waits is interrupted: by SIGSTOP and SIGCONT, a debugger, or a suspended machine. The
    /// node then neither receives nor sends, and must join again.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.threads.run()
    }

    /// Returns the counts of a new subscription to poses or detections.
    #[must_use]
    pub fn received_poses(&self, names: &Names, settings: &NodeSettings) -> Received {
        let guid = match &self.input {
            Input::Poses(pose) => pose.guid(),
            Input::Odometry(pose) => pose.guid(),
            Input::Plain(pose) => pose.guid(),
            Input::Transforms(pose) => pose.guid(),
            Input::Detections(detections, _) => {
                return Received::new(
                    names.detections.clone(),
                    "detections_reliability to best_effort, or detections_durability to volatile",
                    settings.detections_delivery,
                    Peers::new(&names.detections, DETECTIONS, detections.guid()),
                );
            }
        };
        let kind = settings.poses.kind;
        let topic = names.of_poses(kind);
        let peers = Peers::new(topic, type_of(kind), guid);
        let peers = match kind {
            PoseType::Transforms => peers.shared(),
            _ => peers,
        };
        let parameters = "pose_reliability to best_effort, or pose_durability to volatile";
        Received::new(topic.into(), parameters, settings.pose_delivery, peers)
    }

    /// Returns the counts of a new subscription to the camera info; `None` if it is not used.
    #[must_use]
    pub fn received_camera_info(&self, names: &Names, settings: &NodeSettings) -> Option<Received> {
        let Input::Detections(_, camera_info) = &self.input else {
            return None;
        };
        Some(Received::new(
            names.camera_info.clone(),
            "camera_info_reliability to best_effort",
            settings.camera_info_delivery,
            Peers::new(&names.camera_info, CAMERA_INFO, camera_info.guid()),
        ))
    }

    /// Returns the counts of a new subscription to the odometry; `None` if it is not used.
    #[must_use]
    pub fn received_odometry(&self, names: &Names, settings: &NodeSettings) -> Option<Received> {
        let guid = self.odom.as_ref()?.guid();
        let peers = Peers::new(&names.odom, ODOMETRY, guid);
        let parameters = "odom_reliability to best_effort, or odom_durability to volatile";
        Some(Received::new(
            names.odom.clone(),
            parameters,
            settings.odom_delivery,
            peers,
        ))
    }
}

/// The quality of service of the node's publishers: reliable, and a publication never waits for a slow subscriber.
const fn reliable() -> QosProfile {
    QosProfile::publisher_default().reliability_reliable(WhenFull::Fail)
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

struct Builder {
    node: Node,
    services: ServiceMapping,
}

impl Builder {
    fn subscription<M: 'static>(
        &mut self,
        name: &str,
        [package, kind]: [&str; 2],
        delivery: Delivery,
    ) -> Result<Subscription<M>, GraphError> {
        let mut qos =
            QosProfile::subscription_default().history(History::KeepLast { depth: DEPTH });
        if delivery.reliable {
            qos = qos.reliability_reliable(WhenFull::Fail);
        }
        if delivery.transient_local {
            qos = qos.durability(Durability::TransientLocal);
        }
        let topic =
            self.node
                .create_topic(&parsed(name)?, MessageTypeName::new(package, kind), &qos)?;
        Ok(self.node.create_subscription(&topic, Some(qos))?)
    }

    fn publisher<M: Serialize>(
        &mut self,
        name: &str,
        [package, kind]: [&str; 2],
        qos: QosProfile,
    ) -> Result<Publisher<M>, GraphError> {
        let topic =
            self.node
                .create_topic(&parsed(name)?, MessageTypeName::new(package, kind), &qos)?;
        Ok(self.node.create_publisher(&topic, Some(qos))?)
    }

    fn server<Q: Message + Clone + 'static, R: Message + 'static>(
        &mut self,
        name: &str,
        [package, kind]: [&str; 2],
    ) -> Result<Server<Q, R>, GraphError> {
        let qos = reliable().history(History::KeepLast { depth: 10 });
        let kind = ServiceTypeName::new(package, kind);
        let server =
            self.node
                .create_server(self.services, &parsed(name)?, &kind, qos.clone(), qos);
        Ok(server?)
    }
}

fn parsed(name: &str) -> Result<Name, GraphError> {
    Name::parse(name).map_err(|error| GraphError::Dds(format!("the name {name}: {error:?}")))
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
