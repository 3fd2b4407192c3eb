//! The services of the node's parameters, and of the lifecycle of a managed node.

use crate::lifecycle::{
    AvailableStates, AvailableTransitions, ChangeState, Changed, CurrentState, State,
};
use crate::message::TriggerRequest;
use crate::parameter_services::{ReportedParameters, refused};
use ros2_client::parameters::raw::SetParametersResult;
use ros2_client::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, SetParametersAtomicallyResponse, SetParametersRequest,
    SetParametersResponse,
};
use ros2_client::{Message, Server};

/// The six services of a node's parameters.
pub struct ParameterServers {
    /// `get_parameters`.
    pub get: Server<GetParametersRequest, GetParametersResponse>,
    /// `get_parameter_types`.
    pub types: Server<GetParameterTypesRequest, GetParameterTypesResponse>,
    /// `set_parameters`.
    pub set: Server<SetParametersRequest, SetParametersResponse>,
    /// `set_parameters_atomically`.
    pub set_at_once: Server<SetParametersRequest, SetParametersAtomicallyResponse>,
    /// `list_parameters`.
    pub list: Server<ListParametersRequest, ListParametersResponse>,
    /// `describe_parameters`.
    pub describe: Server<DescribeParametersRequest, DescribeParametersResponse>,
}

/// The services of a managed node. An empty request is that of `std_srvs/srv/Trigger`.
pub struct LifecycleServers {
    /// `change_state`.
    pub change: Server<ChangeState, Changed>,
    /// `get_state`.
    pub current: Server<TriggerRequest, CurrentState>,
    /// `get_available_states`.
    pub states: Server<TriggerRequest, AvailableStates>,
    /// `get_available_transitions`.
    pub transitions: Server<TriggerRequest, AvailableTransitions>,
}

/// Answers the requests that have arrived. Responses that cannot be sent are not repeated: the caller asks again.
pub fn answer<Q: Message + Clone + 'static, R: Message + 'static>(
    server: &Server<Q, R>,
    mut response: impl FnMut(Q) -> R,
) {
    while let Ok(Some((id, request))) = server.receive_request() {
        let _ = server.send_response(id, response(request));
    }
}

impl ParameterServers {
    /// Answers requests. No parameter can be set.
    pub fn serve(&self, reported: &ReportedParameters) {
        answer(&self.get, |request| GetParametersResponse {
            values: reported.values(&request.names),
        });
        answer(&self.types, |request| GetParameterTypesResponse {
            values: reported.types(&request.names),
        });
        answer(&self.set, |request| {
            let each = |given| -> SetParametersResult { refused(std::slice::from_ref(given)) };
            SetParametersResponse {
                results: request.parameter.iter().map(each).collect(),
            }
        });
        answer(&self.set_at_once, |request| {
            SetParametersAtomicallyResponse {
                result: refused(&request.parameter),
            }
        });
        answer(&self.list, |request| ListParametersResponse {
            result: reported.list(&request),
        });
        answer(&self.describe, |request| DescribeParametersResponse {
            values: reported.descriptors(&request.names),
        });
    }
}

impl LifecycleServers {
    /// Answers requests, and returns the state after them.
    pub fn serve(&self, before: State) -> State {
        let mut state = before;
        answer(&self.change, |request| {
            let next = state.after(&request.transition);
            state = next.unwrap_or(state);
            Changed {
                success: next.is_some(),
            }
        });
        answer(&self.current, |_| CurrentState {
            current_state: state.labelled(),
        });
        answer(&self.states, |_| State::all());
        answer(&self.transitions, |_| state.available());
        state
    }
}
