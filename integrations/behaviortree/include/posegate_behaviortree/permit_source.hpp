// Where a behaviour tree gets the permit from.

#pragma once

#include <string>

namespace posegate {

/// The permit at one moment.
struct Permit {
  /// `true` if the task may run now.
  bool permitted = false;
  /// Why the task may not run: a reason of Posegate in snake case, or a sentence. Empty with a permit.
  std::string reason = "silent";
};

/// A source of permits. It must deny by itself when no message arrives: a stored permit is not valid.
class PermitSource {
 public:
  virtual ~PermitSource() = default;

  /// Returns the permit at this moment. Called in every tick, from the thread of the tree.
  virtual Permit permit() = 0;
};

}  // namespace posegate
