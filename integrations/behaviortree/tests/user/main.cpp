// Asks a watch that has received no heartbeat.

#include "posegate_behaviortree/permit_watch.hpp"
#include "posegate_behaviortree/pose_permitted.hpp"

int main() {
  posegate::PermitWatch watch("dock", "/robot1/posegate", "abc");
  return watch.permit().permitted ? 1 : 0;
}
