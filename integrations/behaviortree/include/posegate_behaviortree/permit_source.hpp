// Where a behaviour tree gets the permit from.

#pragma once

#include <string>

namespace posegate {

/// The permit at one moment.
struct Permit {
  /// Whether the task may run now.
  bool permitted = false;
  /// Why not: a reason of Posegate in snake case, or a sentence. Empty with a permit.
  std::string reason = "silent";
};

/// A source of permits. It must deny by itself if nothing is heard: a stored permit is not one.
class PermitSource {
 public:
  virtual ~PermitSource() = default;

  /// Returns the permit at this moment. Called in every tick, from the thread of the tree.
  virtual Permit permit() = 0;
};

}  // namespace posegate
