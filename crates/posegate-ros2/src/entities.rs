//! What a node has on DDS: topics that it receives, publishers and services.

use crate::peers::Peers;
use crate::permit_gate::Origin;
use crate::received::Received;
use crate::settings::Delivery;
use ros2_client::error::CreateError;
use ros2_client::qos::{Durability, History, WhenFull};
use ros2_client::{
    Message, MessageTypeName, Name, Node, Publisher, QosProfile, Server, ServiceMapping,
    ServiceTypeName, Subscription,
};
use rustdds::mio1::event::Source;
use rustdds::mio1::{Interest, Poll, Token};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Messages that wait for the node: those of one cycle at 1,000 per second, and a reserve.
const DEPTH: usize = 64;

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

/// A message with its origin; `None` if it could not be decoded.
type Taken<T> = Option<(T, Origin)>;

/// A topic that the node receives: messages of any type as `T`, and their counts.
pub struct Topic<T> {
    take: Box<dyn Fn() -> Option<Taken<T>>>,
    /// The counts.
    pub received: Received,
}

impl<T> Topic<T> {
    /// Processes the messages that have arrived, at most `most`, and counts those that cannot be decoded. `process` gets
    /// `None` for such a message.
    pub fn drain(&mut self, most: usize, mut process: impl FnMut(&mut Received, Taken<T>)) {
        for taken in std::iter::from_fn(&self.take).take(most) {
            self.received.unreadable += u64::from(taken.is_none());
            process(&mut self.received, taken);
        }
    }
}

/// Makes the entities of a node.
pub struct Entities {
    /// The node.
    pub node: Node,
    /// The mapping of services.
    pub services: ServiceMapping,
    /// Waits for messages.
    pub poll: Poll,
}

impl Entities {
    /// Wakes the node at messages of a source.
    ///
    /// # Errors
    /// [`GraphError::Poll`]
    pub fn wake_at(&self, source: &mut (impl Source + ?Sized)) -> Result<(), GraphError> {
        // The node looks at everything whenever it wakes, so sources need no numbers.
        let registry = self.poll.registry();
        Ok(registry.register(source, Token(0), Interest::READABLE)?)
    }

    /// Subscribes to a topic whose messages of type `M` become `T`. `parameters` are those that set its quality of
    /// service, with values, as text.
    ///
    /// # Errors
    /// [`GraphError`]
    pub fn topic<M: DeserializeOwned + 'static, T>(
        &mut self,
        name: &str,
        of: [&str; 2],
        delivery: Delivery,
        parameters: &'static str,
        become_t: fn(M) -> T,
    ) -> Result<Topic<T>, GraphError>
    where
        T: 'static,
    {
        let mut qos =
            QosProfile::subscription_default().history(History::KeepLast { depth: DEPTH });
        if delivery.reliable {
            qos = qos.reliability_reliable(WhenFull::Fail);
        }
        if delivery.transient_local {
            qos = qos.durability(Durability::TransientLocal);
        }
        let topic = self.dds_topic(name, of, &qos)?;
        let mut subscription: Subscription<M> = self.node.create_subscription(&topic, Some(qos))?;
        self.wake_at(&mut subscription)?;
        let peers = Peers::new(name, of, subscription.guid());
        Ok(Topic {
            received: Received::new(name.into(), parameters, delivery, peers),
            take: Box::new(move || match subscription.take() {
                Ok(None) => None,
                Err(_) => Some(None),
                Ok(Some((message, info))) => {
                    let origin = Origin {
                        publisher: info.publisher_gid().to_bytes16(),
                        number: info.sequence_number(),
                    };
                    Some(Some((become_t(message), origin)))
                }
            }),
        })
    }

    /// Publishes a topic.
    ///
    /// # Errors
    /// [`GraphError`]
    pub fn publisher<M: Serialize>(
        &mut self,
        name: &str,
        of: [&str; 2],
        qos: QosProfile,
    ) -> Result<Publisher<M>, GraphError> {
        let topic = self.dds_topic(name, of, &qos)?;
        Ok(self.node.create_publisher(&topic, Some(qos))?)
    }

    fn dds_topic(
        &self,
        name: &str,
        [package, kind]: [&str; 2],
        qos: &QosProfile,
    ) -> Result<rustdds::Topic, GraphError> {
        let kind = MessageTypeName::new(package, kind);
        Ok(self.node.create_topic(&parsed(name)?, kind, qos)?)
    }

    /// Offers a service.
    ///
    /// # Errors
    /// [`GraphError`]
    pub fn server<Q: Message + Clone + 'static, R: Message + 'static>(
        &mut self,
        name: &str,
        [package, kind]: [&str; 2],
    ) -> Result<Server<Q, R>, GraphError> {
        let qos = reliable().history(History::KeepLast { depth: 10 });
        let (name, kind) = (parsed(name)?, ServiceTypeName::new(package, kind));
        let mut server = self
            .node
            .create_server(self.services, &name, &kind, qos.clone(), qos)?;
        self.wake_at(&mut server)?;
        Ok(server)
    }
}

/// The quality of service of the node's publishers: reliable, and a publication never waits for a slow subscriber.
#[must_use]
pub const fn reliable() -> QosProfile {
    QosProfile::publisher_default().reliability_reliable(WhenFull::Fail)
}

fn parsed(name: &str) -> Result<Name, GraphError> {
    Name::parse(name).map_err(|error| GraphError::Dds(format!("the name {name}: {error:?}")))
}
