// The rules of the fail-safe permit of posegate-node, without ROS: integrations/ros2/permit_listener.py has the same in Python.

#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "posegate_behaviortree/permit_source.hpp"

namespace posegate {

/// The longest time for which a heartbeat is valid, whatever it states, milliseconds. After a change of the run, heartbeats of the new
/// run alone must come for this time before one permits.
constexpr std::int64_t kMostValidMs = 1000;
/// The same after an earlier run has come back, milliseconds: a node that was started again has a new run, so two nodes are alive, and
/// one of them may be slow.
constexpr std::int64_t kTwoNodesMs = 10'000;
/// The earlier runs that are kept.
constexpr std::size_t kMostRuns = 8;
/// A heartbeat from farther in the future shows that the clocks of the machines differ, milliseconds.
constexpr std::int64_t kMostAheadMs = 20;

/// The only status of a heartbeat (`diagnostic_msgs/msg/DiagnosticArray` on posegate/permission), with the stamp of the header.
/// A default heartbeat denies.
struct Heartbeat {
  /// Header: nanoseconds since 1970.
  std::int64_t stamp_ns = 0;
  /// `status.size()`.
  std::size_t statuses = 0;
  /// `status[0].level`.
  std::uint8_t level = 2;
  /// `status[0].name`.
  std::string name;
  /// `status[0].message`.
  std::string message;
  /// `status[0].values`, in their order.
  std::vector<std::pair<std::string, std::string>> values;
};

/// Follows heartbeats. The permit ends by itself `valid_ms` after the stamp of the last heartbeat that permits. All functions may be
/// called from any thread.
class PermitWatch : public PermitSource {
 public:
  /// Returns nanoseconds of a monotonic clock.
  using Clock = std::function<std::int64_t()>;

  /// A permit must name the task, the robot (the full name of the node that decides, such as `/robot1/posegate`, or its parameter `robot`)
  /// and the table (`table_digest` of `posegate table info`). An empty robot or table is never permitted.
  PermitWatch(std::string task, std::string robot, std::string table, Clock monotonic = steady_ns);

  /// Takes a heartbeat at a moment of the system's clock (not of simulated time), nanoseconds since 1970.
  void heartbeat(const Heartbeat& message, std::int64_t system_ns);

  Permit permit() override;

  /// Nanoseconds of std::chrono::steady_clock.
  static std::int64_t steady_ns();

 private:
  /// Returns the reason if a heartbeat does not permit; otherwise how long it permits from its stamp, milliseconds.
  std::pair<std::optional<std::string>, std::int64_t> checked(const Heartbeat& message, std::int64_t system_ns);

  const std::string task_;
  const std::string robot_;
  const std::string table_;
  const Clock monotonic_;
  std::mutex mutex_;
  std::string run_;
  std::int64_t sequence_ = 0;
  /// Runs before this one, the last one last.
  std::deque<std::string> earlier_;
  /// Until this moment of the monotonic clock two runs may be alive.
  std::optional<std::int64_t> alone_ns_;
  std::optional<std::int64_t> ends_ns_;
  std::string reason_ = "silent";
};

}  // namespace posegate
