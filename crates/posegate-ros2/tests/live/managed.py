"""A node under a manager of lifecycles denies until it is active; a node's parameters are listed, and refused when set."""

from support import Peer, end, figure, pose, require, start
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, GetParameters, GetParameterTypes, ListParameters, SetParameters, SetParametersAtomically

STILL = "stands_still:=true"


def ask(peer, kind, name, request):
    """Calls a service of the node, while good poses go on."""
    client = peer.node.create_client(kind, f"/posegate/{name}")
    require(peer.drive(10.0, until=client.service_is_ready), f"no service {name}")
    answer = client.call_async(request)
    require(peer.drive(10.0, until=answer.done), f"{name} does not answer")
    return answer.result()


def change(peer, transition):
    """Asks for a transition; returns whether it was made."""
    return ask(peer, ChangeState, "change_state", ChangeState.Request(transition=Transition(id=transition))).success


def state(peer):
    return ask(peer, GetState, "get_state", GetState.Request()).current_state.label


def lifecycle():
    """Only an active node permits."""
    node = start(STILL, "lifecycle:=true")
    peer = Peer()
    denials = 0

    def denies(what):
        nonlocal denials
        require(not peer.drive(2.0, until=peer.listener.permitted), f"a node that is {what} permits")
        denials += 1

    denies("unconfigured")
    require(state(peer) == "unconfigured", state(peer))
    require(not change(peer, Transition.TRANSITION_ACTIVATE), "unconfigured to active")
    require(change(peer, Transition.TRANSITION_CONFIGURE), "configure")
    denies("inactive")
    require("the node is inactive" in peer.call("/posegate/explain", pose).message, "explain")
    require(change(peer, Transition.TRANSITION_ACTIVATE) and state(peer) == "active", "activate")
    peer.open()
    require(change(peer, Transition.TRANSITION_DEACTIVATE), "deactivate")
    took = peer.wait(1.0, lambda: not peer.listener.permitted())
    require(took is not None, "a node that was deactivated permits")
    denies("inactive again")
    states = ask(peer, GetAvailableStates, "get_available_states", GetAvailableStates.Request()).available_states
    require([each.id for each in states] == [1, 2, 3, 4], states)
    ways = ask(peer, GetAvailableTransitions, "get_available_transitions", GetAvailableTransitions.Request())
    require([way.transition.label for way in ways.available_transitions] == ["cleanup", "activate", "shutdown"], ways)
    require(change(peer, Transition.TRANSITION_ACTIVATE), "activate again")
    peer.open()
    require(change(peer, Transition.TRANSITION_ACTIVE_SHUTDOWN), "shutdown")
    require(node.wait(timeout=5) == 0 and not peer.drive(0.5, until=lambda: False), "the node does not end")
    require(not peer.listener.permitted(), "a node that has ended permits")
    figure("managed: states of a managed node that deny", denials, "states", 3)
    peer.close()


def parameters():
    """`ros2 param` reads any node, and changes nothing."""
    node = start(STILL, "permit_hold_ms:=700")
    peer = Peer()
    peer.open()
    names = ask(peer, ListParameters, "list_parameters", ListParameters.Request()).result.names
    require({"stands_still", "permit_hold_ms", "use_sim_time", "frame_id"} <= set(names), names)
    asked = ["permit_hold_ms", "frame_id", "stands_still", "no_such"]
    values = ask(peer, GetParameters, "get_parameters", GetParameters.Request(names=asked)).values
    require(values[0].integer_value == 700 and values[1].string_value == "map" and values[2].bool_value, values)
    types = list(ask(peer, GetParameterTypes, "get_parameter_types", GetParameterTypes.Request(names=asked)).types)
    require(types == [2, 4, 1, 0], types)
    described = ask(peer, DescribeParameters, "describe_parameters", DescribeParameters.Request(names=asked[:3])).descriptors
    require(all(each.read_only for each in described), described)
    wanted = [Parameter(name="stands_still", value=ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=False))]
    one = ask(peer, SetParameters, "set_parameters", SetParameters.Request(parameters=wanted)).results[0]
    all_of = ask(peer, SetParametersAtomically, "set_parameters_atomically", SetParametersAtomically.Request(parameters=wanted)).result
    require(not one.successful and not all_of.successful and "start it again" in one.reason, one)
    peer.open()
    node.kill()
    peer.close()
    figure("managed: parameters that are listed", len(names), "parameters", 20)


lifecycle()
parameters()
end()
