// Asks a watch that heard nothing.

#include "posegate_behaviortree/permit_watch.hpp"
#include "posegate_behaviortree/pose_permitted.hpp"

int main() {
  posegate::PermitWatch watch("dock");
  return watch.permit().permitted ? 1 : 0;
}
