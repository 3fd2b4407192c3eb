#include "posegate_behaviortree/permit_watch.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>

namespace posegate {

namespace {

constexpr std::int64_t kMs = 1'000'000;

/// Returns a whole number, or nothing for any other text.
std::optional<std::int64_t> whole(const std::string& text) {
  std::int64_t value = 0;
  const char* end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stopped != end) {
    return std::nullopt;
  }
  return value;
}

}  // namespace

PermitWatch::PermitWatch(std::string task, std::string robot, std::string table, Clock monotonic)
    : task_(std::move(task)), robot_(std::move(robot)), table_(std::move(table)), monotonic_(std::move(monotonic)) {}

std::int64_t PermitWatch::steady_ns() {
  const auto since = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since).count();
}

void PermitWatch::heartbeat(const Heartbeat& message, std::int64_t system_ns) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto [refused, valid_ms] = checked(message, system_ns);
  if (refused) {
    ends_ns_.reset();
    reason_ = *refused;
    return;
  }
  const std::int64_t age_ns = std::max<std::int64_t>(0, system_ns - message.stamp_ns);
  ends_ns_ = monotonic_() + valid_ms * kMs - age_ns;
  reason_.clear();
}

Permit PermitWatch::permit() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (ends_ns_ && monotonic_() >= *ends_ns_) {
    ends_ns_.reset();
    reason_ = "no heartbeat: the node has stopped, or messages do not arrive";
  }
  return Permit{ends_ns_.has_value(), reason_};
}

std::pair<std::optional<std::string>, std::int64_t> PermitWatch::checked(const Heartbeat& message, std::int64_t system_ns) {
  const auto refused = [](std::string why) { return std::make_pair(std::optional<std::string>(std::move(why)), std::int64_t{0}); };
  if (message.statuses != 1) {
    return refused("not a heartbeat of posegate-node");
  }
  std::map<std::string, std::string> values;
  for (const auto& [key, value] : message.values) {
    if (!values.emplace(key, value).second) {
      return refused("a value is given twice");
    }
  }
  const auto value = [&values](const char* key) {
    const auto found = values.find(key);
    return found == values.end() ? std::optional<std::string>() : found->second;
  };
  if (message.name != "posegate" || value("format") != "2") {
    return refused("not a heartbeat of posegate-node, or of another version");
  }
  const auto run = value("run");
  const auto sequence = whole(value("sequence").value_or(""));
  if (!run || run->empty() || !sequence) {
    return refused("a heartbeat without its number");
  }
  // A late message of the same run says nothing about now.
  if (*run == run_ && *sequence <= sequence_) {
    return refused("heartbeats out of order");
  }
  if (!run_.empty() && *run != run_) {
    const bool has_come_back = std::find(earlier_.begin(), earlier_.end(), *run) != earlier_.end();
    const std::int64_t until_ns = monotonic_() + (has_come_back ? kTwoNodesMs : kMostValidMs) * kMs;
    alone_ns_ = std::max(alone_ns_.value_or(until_ns), until_ns);
    if (earlier_.size() == kMostRuns) {
      earlier_.pop_front();
    }
    earlier_.push_back(run_);
  }
  run_ = *run;
  sequence_ = *sequence;
  if (robot_.empty() || value("robot") != robot_) {
    return refused("a heartbeat of the robot " + value("robot").value_or("") + ", expected " + robot_);
  }
  if (alone_ns_ && monotonic_() < *alone_ns_) {
    return refused("two nodes send heartbeats, or the node was just started again: another run came a moment ago");
  }
  if (message.level != 0 || message.message != "permit" || value("state") != "permitted") {
    const std::string reason = value("reason").value_or("");
    return refused(reason.empty() ? "denied" : reason);
  }
  if (value("reason") != "") {
    return refused("a heartbeat that contradicts itself");
  }
  if (value("task") != task_) {
    return refused("a permit for the task " + value("task").value_or("") + ", expected " + task_);
  }
  if (table_.empty() || value("table") != table_) {
    return refused("a permit by the table " + value("table").value_or("") + ", expected " + table_);
  }
  const auto valid_ms = whole(value("valid_ms").value_or(""));
  if (!valid_ms || *valid_ms < 1 || *valid_ms > kMostValidMs) {
    return refused("a heartbeat without its time, or of too long a time");
  }
  const std::int64_t age_ns = system_ns - message.stamp_ns;
  if (age_ns < -kMostAheadMs * kMs) {
    return refused("a heartbeat from the future: the clocks of the machines differ");
  }
  if (age_ns >= *valid_ms * kMs) {
    return refused("an old heartbeat: delayed on the way, or the clocks of the machines differ");
  }
  return {std::nullopt, *valid_ms};
}

}  // namespace posegate
