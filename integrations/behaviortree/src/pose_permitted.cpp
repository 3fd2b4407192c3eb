#include "posegate_behaviortree/pose_permitted.hpp"

#include <exception>

#include "behaviortree_cpp/bt_factory.h"

namespace posegate {

using SourcePointer = std::shared_ptr<PermitSource>;

PosePermitted::PosePermitted(const std::string& name, const BT::NodeConfig& config) : BT::ConditionNode(name, config) {}

BT::PortsList PosePermitted::providedPorts() {
  return {
      BT::InputPort<SourcePointer>(kSourceEntry, std::string("{") + kSourceEntry + "}", "where the permit comes from"),
      BT::OutputPort<std::string>("reason", "why the task may not run; empty with a permit"),
  };
}

BT::NodeStatus PosePermitted::tick() {
  const Permit permit = ask();
  setOutput("reason", permit.permitted ? std::string() : permit.reason);
  return permit.permitted ? BT::NodeStatus::SUCCESS : BT::NodeStatus::FAILURE;
}

Permit PosePermitted::ask() {
  try {
    const auto source = getInput<SourcePointer>(kSourceEntry);
    if (!source || !source.value()) {
      return Permit{false, "no source: put a std::shared_ptr<posegate::PermitSource> on the blackboard as permit_source"};
    }
    return source.value()->permit();
  } catch (const std::exception& error) {
    return Permit{false, std::string("the source of the permit failed: ") + error.what()};
  }
}

}  // namespace posegate

BT_REGISTER_NODES(factory) {
  factory.registerNodeType<posegate::PosePermitted>("PosePermitted");
}
