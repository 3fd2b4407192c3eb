//! The services of the node's parameters, and of the lifecycle of a managed node.

use crate::entities::{Entities, GraphError};
use crate::lifecycle::State;
use crate::message::Single;
use crate::parameter_services::{ReportedParameters, refused};
use ros2_client::parameters::raw::Parameter;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A service: answers the requests that have arrived.
pub type Service = Box<dyn Fn(&mut Served<'_>)>;

/// What services report and change.
pub struct Served<'s> {
    /// The parameters.
    pub parameters: &'s ReportedParameters,
    /// The state of the node.
    pub state: State,
}

/// Offers services under the name of a node.
struct Services<'e> {
    entities: &'e mut Entities,
    node: String,
    package: &'static str,
    all: Vec<Service>,
}

impl Services<'_> {
    /// Offers a service whose request and response have one field each, or are `Q` and `R` themselves. Its type is its
    /// name in capitals, such as `GetState` of `get_state`. Responses that cannot be sent are not repeated: the caller asks again.
    fn add<Q, R>(
        &mut self,
        name: &str,
        response: impl Fn(&mut Served<'_>, Q) -> R + 'static,
    ) -> Result<(), GraphError>
    where
        Q: Serialize + DeserializeOwned + Clone + 'static,
        R: Serialize + DeserializeOwned + 'static,
    {
        let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
        let kind: String = name.split('_').map(capital).collect();
        let (name, kind) = (format!("{}/{name}", self.node), [self.package, &kind]);
        let server = self.entities.server::<Single<Q>, Single<R>>(&name, kind)?;
        self.all.push(Box::new(move |served| {
            while let Ok(Some((id, Single(request)))) = server.receive_request() {
                let _ = server.send_response(id, Single(response(served, request)));
            }
        }));
        Ok(())
    }
}

/// Offers the six services of a node's parameters, of which none can be set, and those of the lifecycle of a managed node. `node` is its
/// full name.
///
/// # Errors
/// [`GraphError`]
pub fn offer(
    entities: &mut Entities,
    node: String,
    is_managed: bool,
) -> Result<Vec<Service>, GraphError> {
    type Names = Vec<String>;
    type Wanted = Vec<Parameter>;
    let mut services = Services {
        entities,
        node,
        package: "rcl_interfaces",
        all: Vec::new(),
    };
    services.add("get_parameters", |of, names: Names| {
        of.parameters.values(&names)
    })?;
    services.add("get_parameter_types", |of, names: Names| {
        of.parameters.types(&names)
    })?;
    services.add("describe_parameters", |of, names: Names| {
        of.parameters.descriptors(&names)
    })?;
    services.add("list_parameters", |of, request| {
        of.parameters.list(&request)
    })?;
    services.add("set_parameters_atomically", |_, wanted: Wanted| {
        refused(&wanted)
    })?;
    services.add("set_parameters", |_, wanted: Wanted| -> Vec<_> {
        wanted.chunks(1).map(refused).collect()
    })?;
    if !is_managed {
        return Ok(services.all);
    }
    // An empty request has one byte.
    services.package = "lifecycle_msgs";
    services.add("get_state", |of, _: u8| of.state.labelled())?;
    services.add("get_available_states", |_, _: u8| State::all())?;
    services.add("get_available_transitions", |of, _: u8| {
        of.state.available()
    })?;
    services.add("change_state", |of, wanted| {
        let next = of.state.after(&wanted);
        of.state = next.unwrap_or(of.state);
        next.is_some()
    })?;
    Ok(services.all)
}
