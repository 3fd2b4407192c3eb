// The condition PosePermitted: SUCCESS while the robot is localized well enough for a task.

#pragma once

#include <memory>
#include <string>

#include "behaviortree_cpp/condition_node.h"
#include "posegate_behaviortree/permit_source.hpp"

namespace posegate {

/// The entry of the blackboard with the source: `std::shared_ptr<posegate::PermitSource>`.
constexpr const char* kSourceEntry = "permit_source";

/// SUCCESS while the source permits, else FAILURE: also without a source, and if the source throws. Never RUNNING.
///
/// Ports: `permit_source` (input, the blackboard's entry of the same name by default), `reason` (output: why the task may not run).
class PosePermitted : public BT::ConditionNode {
 public:
  PosePermitted(const std::string& name, const BT::NodeConfig& config);

  static BT::PortsList providedPorts();

  BT::NodeStatus tick() override;

 private:
  Permit ask();
};

}  // namespace posegate
