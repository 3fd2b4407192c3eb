//! The services of the node's parameters, and of the lifecycle of a managed node.

use crate::entities::{Entities, GraphError};
use crate::lifecycle::{
    AvailableStates, AvailableTransitions, ChangeState, Changed, CurrentState, State,
};
use crate::message::TriggerRequest;
use crate::parameter_services::{ReportedParameters, refused};
use ros2_client::Message;
use ros2_client::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, SetParametersAtomicallyResponse, SetParametersRequest,
    SetParametersResponse,
};

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
    /// Offers a service. Responses that cannot be sent are not repeated: the caller asks again.
    fn add<Q: Message + Clone + 'static, R: Message + 'static>(
        &mut self,
        name: &str,
        kind: &str,
        response: impl Fn(&mut Served<'_>, Q) -> R + 'static,
    ) -> Result<(), GraphError> {
        let name = format!("{}/{name}", self.node);
        let server = self.entities.server::<Q, R>(&name, [self.package, kind])?;
        self.all.push(Box::new(move |served| {
            while let Ok(Some((id, request))) = server.receive_request() {
                let _ = server.send_response(id, response(served, request));
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
    let mut services = Services {
        entities,
        node,
        package: "rcl_interfaces",
        all: Vec::new(),
    };
    services.add(
        "get_parameters",
        "GetParameters",
        |served, request: GetParametersRequest| GetParametersResponse {
            values: served.parameters.values(&request.names),
        },
    )?;
    services.add(
        "get_parameter_types",
        "GetParameterTypes",
        |served, request: GetParameterTypesRequest| GetParameterTypesResponse {
            values: served.parameters.types(&request.names),
        },
    )?;
    services.add(
        "set_parameters",
        "SetParameters",
        |_, request: SetParametersRequest| SetParametersResponse {
            results: request.parameter.chunks(1).map(refused).collect(),
        },
    )?;
    services.add(
        "set_parameters_atomically",
        "SetParametersAtomically",
        |_, request: SetParametersRequest| SetParametersAtomicallyResponse {
            result: refused(&request.parameter),
        },
    )?;
    services.add(
        "list_parameters",
        "ListParameters",
        |served, request: ListParametersRequest| ListParametersResponse {
            result: served.parameters.list(&request),
        },
    )?;
    services.add(
        "describe_parameters",
        "DescribeParameters",
        |served, request: DescribeParametersRequest| DescribeParametersResponse {
            values: served.parameters.descriptors(&request.names),
        },
    )?;
    if !is_managed {
        return Ok(services.all);
    }
    services.package = "lifecycle_msgs";
    services.add(
        "change_state",
        "ChangeState",
        |served, request: ChangeState| {
            let next = served.state.after(&request.transition);
            served.state = next.unwrap_or(served.state);
            Changed {
                success: next.is_some(),
            }
        },
    )?;
    // An empty request is that of `std_srvs/srv/Trigger`.
    services.add("get_state", "GetState", |served, _: TriggerRequest| {
        CurrentState {
            current_state: served.state.labelled(),
        }
    })?;
    services.add(
        "get_available_states",
        "GetAvailableStates",
        |_, _: TriggerRequest| -> AvailableStates { State::all() },
    )?;
    services.add(
        "get_available_transitions",
        "GetAvailableTransitions",
        |served, _: TriggerRequest| -> AvailableTransitions { served.state.available() },
    )?;
    Ok(services.all)
}
