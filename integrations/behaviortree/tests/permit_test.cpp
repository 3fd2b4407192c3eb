// Runs the rules of the permit, the condition, and the tree with DockRobot and NavigateToPose of this test. Usage: permit_test TREE.xml

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include "behaviortree_cpp/bt_factory.h"
#include "posegate_behaviortree/permit_watch.hpp"
#include "posegate_behaviortree/pose_permitted.hpp"

namespace {

using posegate::Heartbeat;
using posegate::Permit;
using posegate::PermitSource;
using posegate::PermitWatch;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kNow = 1'800'000'000'000'000'000;

void require(bool holds, const std::string& what) {
  if (!holds) {
    std::fprintf(stderr, "failed: %s\n", what.c_str());
    std::exit(1);
  }
}

void figure(const char* name, long value, const char* unit, long goal) {
  std::printf("{\"name\": \"behaviortree: %s\", \"value\": %ld, \"unit\": \"%s\", \"goal\": %ld}\n", name, value, unit, goal);
  require(value == goal, name);
}

Heartbeat good(std::int64_t stamp_ns = kNow, int sequence = 1) {
  Heartbeat message;
  message.stamp_ns = stamp_ns;
  message.statuses = 1;
  message.level = 0;
  message.name = "posegate";
  message.message = "permit";
  message.values = {{"format", "2"}, {"task", "dock"}, {"robot", "/robot1/posegate"}, {"table", "abc"}, {"run", "r1"},
                    {"sequence", std::to_string(sequence)}, {"valid_ms", "250"}, {"state", "permitted"}, {"reason", ""}};
  return message;
}

Heartbeat with(const std::string& key, const std::string& value) {
  Heartbeat message = good();
  for (auto& pair : message.values) {
    if (pair.first == key) {
      pair.second = value;
    }
  }
  return message;
}

Heartbeat without(const std::string& key) {
  Heartbeat message = good();
  for (std::size_t k = 0; k < message.values.size(); ++k) {
    if (message.values[k].first == key) {
      message.values.erase(message.values.begin() + static_cast<long>(k));
      break;
    }
  }
  return message;
}

bool decides(const Heartbeat& message, const std::string& robot = "/robot1/posegate", const std::string& table = "abc") {
  PermitWatch watch("dock", robot, table, [] { return std::int64_t{0}; });
  watch.heartbeat(message, kNow);
  return watch.permit().permitted;
}

void rules() {
  require(decides(good()), "a good heartbeat does not permit");
  std::vector<Heartbeat> refused = {Heartbeat{}};
  for (const char* key : {"format", "task", "robot", "table", "run", "sequence", "valid_ms", "state", "reason"}) {
    refused.push_back(without(key));
    refused.push_back(with(key, "9999999999999999999"));
    if (std::string(key) != "run") {
      refused.push_back(with(key, "x1"));
    } else {
      refused.pop_back();
    }
  }
  for (const char* valid : {"0", "-5", "1001", "", "250 "}) {
    refused.push_back(with("valid_ms", valid));
  }
  Heartbeat changed = good();
  changed.level = 1;
  refused.push_back(changed);
  changed = good();
  changed.message = "deny";
  refused.push_back(changed);
  changed = good();
  changed.name = "other";
  refused.push_back(changed);
  changed = good();
  changed.statuses = 2;
  refused.push_back(changed);
  changed = good();
  changed.values.push_back(changed.values.front());
  refused.push_back(changed);
  refused.push_back(good(kNow - 250 * kMs));
  refused.push_back(good(kNow + 21 * kMs));
  long count = 0;
  for (const Heartbeat& message : refused) {
    require(!decides(message), "permitted: heartbeat " + std::to_string(count));
    ++count;
  }
  require(!decides(good(), "/robot2/posegate") && !decides(good(), "/robot1/posegate", "def"), "another robot or table");
  require(!decides(with("robot", ""), "") && !decides(with("table", ""), "/robot1/posegate", ""), "an empty name");
  figure("heartbeats that are refused", count, "heartbeats", 38);

  std::int64_t monotonic = 5000 * kMs;
  PermitWatch watch("dock", "/robot1/posegate", "abc", [&monotonic] { return monotonic; });
  require(!watch.permit().permitted && watch.permit().reason == "silent", "a watch that heard nothing permits");
  watch.heartbeat(good(), kNow + 100 * kMs);
  monotonic = 5149 * kMs;
  require(watch.permit().permitted, "the permit ends early");
  monotonic = 5150 * kMs;
  require(!watch.permit().permitted, "the permit does not end");
  monotonic = 5140 * kMs;
  require(!watch.permit().permitted, "a permit that has ended came back");
  watch.heartbeat(good(kNow, 2), kNow);
  require(watch.permit().permitted, "no second permit");
  watch.heartbeat(good(kNow, 2), kNow);
  require(!watch.permit().permitted, "a repeated heartbeat permits");
  // Two runs that alternate deny; one that stays permits ten seconds after the other's last heartbeat.
  watch.heartbeat(good(kNow, 3), kNow);
  require(watch.permit().permitted, "no third permit");
  long asks = 0;
  for (int k = 1; k <= 100; ++k) {
    monotonic += 25 * kMs;
    Heartbeat message = good(kNow, 3 + k);
    for (auto& pair : message.values) {
      if (pair.first == "run" && k % 2 == 1) {
        pair.second = "r2";
      }
    }
    watch.heartbeat(message, kNow);
    asks += watch.permit().permitted ? 0 : 1;
  }
  figure("asks denied while two runs alternate", asks, "asks", 100);
  monotonic += 9999 * kMs;
  watch.heartbeat(good(kNow, 200), kNow);
  require(!watch.permit().permitted, "a run that is alone for less than ten seconds permits");
  monotonic += 1 * kMs;
  watch.heartbeat(good(kNow, 201), kNow);
  require(watch.permit().permitted, "a run that stays alone does not permit");
}

/// A source whose permit the test sets.
struct Switch : PermitSource {
  bool is_on = false;
  bool throws = false;
  Permit permit() override {
    if (throws) {
      throw std::runtime_error("gone");
    }
    return is_on ? Permit{true, ""} : Permit{};
  }
};

/// Replaces Nav2's action of this name: runs until the test ends it, and counts its calls.
class Action : public BT::StatefulActionNode {
 public:
  using BT::StatefulActionNode::StatefulActionNode;
  static BT::PortsList providedPorts() {
    return {BT::InputPort<std::string>("dock_id"), BT::InputPort<bool>("navigate_to_staging_pose", true, ""),
            BT::InputPort<std::string>("goal"), BT::OutputPort<int>("error_code_id")};
  }
  struct Counts {
    int started = 0;
    int halted = 0;
    int ticks_to_run = 0;
    Switch* turns_on = nullptr;
  };
  static Counts dock, navigate;

 private:
  Counts& counts() { return registrationName() == "DockRobot" ? dock : navigate; }
  BT::NodeStatus onStart() override {
    ++counts().started;
    left_ = counts().ticks_to_run;
    return onRunning();
  }
  BT::NodeStatus onRunning() override {
    if (left_-- > 0) {
      return BT::NodeStatus::RUNNING;
    }
    if (counts().turns_on != nullptr) {
      counts().turns_on->is_on = true;
    }
    return BT::NodeStatus::SUCCESS;
  }
  void onHalted() override { ++counts().halted; }
  int left_ = 0;
};
Action::Counts Action::dock, Action::navigate;

BT::Blackboard::Ptr board(const std::shared_ptr<PermitSource>& source) {
  auto blackboard = BT::Blackboard::create();
  if (source) {
    blackboard->set<std::shared_ptr<PermitSource>>(posegate::kSourceEntry, source);
  }
  blackboard->set<std::string>("dock_id", "home");
  blackboard->set<std::string>("next_look", "look 1");
  return blackboard;
}

void condition(BT::BehaviorTreeFactory& factory) {
  const std::string text =
      "<root BTCPP_format=\"4\"><BehaviorTree ID=\"One\"><PosePermitted reason=\"{why}\"/></BehaviorTree></root>";
  const auto ticked = [&](const std::shared_ptr<PermitSource>& source, std::string& why) {
    auto blackboard = board(source);
    auto tree = factory.createTreeFromText(text, blackboard);
    const auto status = tree.tickExactlyOnce();
    why = blackboard->get<std::string>("why");
    return status;
  };
  std::string why;
  auto source = std::make_shared<Switch>();
  require(ticked(nullptr, why) == BT::NodeStatus::FAILURE && why.find("no source") == 0, "without a source: " + why);
  require(ticked(source, why) == BT::NodeStatus::FAILURE && why == "silent", "a silent source: " + why);
  source->is_on = true;
  require(ticked(source, why) == BT::NodeStatus::SUCCESS && why.empty(), "a permit: " + why);
  source->throws = true;
  require(ticked(source, why) == BT::NodeStatus::FAILURE && why.find("gone") != std::string::npos, "a source that throws: " + why);
  // A real watch: silence fails, a heartbeat of now succeeds, silence after it fails again.
  auto watch = std::make_shared<PermitWatch>("dock", "/robot1/posegate", "abc");
  require(ticked(watch, why) == BT::NodeStatus::FAILURE, "a watch that heard nothing");
  watch->heartbeat(good(), kNow);
  require(ticked(watch, why) == BT::NodeStatus::SUCCESS, "a heartbeat of now: " + why);
  std::this_thread::sleep_for(std::chrono::milliseconds(251));
  require(ticked(watch, why) == BT::NodeStatus::FAILURE && why.find("no heartbeat") == 0, "silence: " + why);
  figure("answers of the condition", 7, "answers", 7);
}

BT::NodeStatus run(BT::Tree& tree, int ticks, const std::function<void(int)>& before) {
  BT::NodeStatus status = BT::NodeStatus::RUNNING;
  for (int k = 0; k < ticks && status == BT::NodeStatus::RUNNING; ++k) {
    before(k);
    status = tree.tickOnce();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return status;
}

void tree(BT::BehaviorTreeFactory& factory, const std::string& file) {
  const auto nothing = [](int) {};
  auto source = std::make_shared<Switch>();
  const auto made = [&] {
    Action::dock = Action::navigate = {};
    Action::dock.ticks_to_run = 10;
    Action::navigate.ticks_to_run = 3;
    return factory.createTreeFromFile(file, board(source));
  };
  // With a permit it docks at once.
  source->is_on = true;
  auto permitted = made();
  require(run(permitted, 100, nothing) == BT::NodeStatus::SUCCESS, "with a permit it does not dock");
  require(Action::dock.started == 1 && Action::navigate.started == 0, "with a permit it drives to a look");
  // Without one it drives to the next look, and docks if that gives the permit.
  source->is_on = false;
  auto looking = made();
  Action::navigate.turns_on = source.get();
  require(run(looking, 400, nothing) == BT::NodeStatus::SUCCESS, "after a look it does not dock");
  require(Action::dock.started == 1 && Action::navigate.started == 1, "it does not look once");
  // If the permit ends while it docks, docking is halted, and it looks again.
  source->is_on = true;
  auto losing = made();
  Action::navigate.turns_on = source.get();
  const auto lose = [&](int tick) {
    if (tick == 5) {
      source->is_on = false;
    }
  };
  require(run(losing, 400, lose) == BT::NodeStatus::SUCCESS, "it does not dock after it lost the permit once");
  require(Action::dock.halted == 1 && Action::dock.started == 2 && Action::navigate.started == 1, "docking was not halted");
  // Without any permit it never docks, and gives up.
  source->is_on = false;
  auto denied = made();
  require(run(denied, 5000, nothing) == BT::NodeStatus::FAILURE, "without a permit it does not give up");
  require(Action::dock.started == 0 && Action::navigate.started == 3, "without a permit it docks");
  figure("runs of the tree", 4, "runs", 4);
}

}  // namespace

int main(int argc, char** argv) {
  require(argc == 2, "usage: permit_test TREE.xml");
  BT::BehaviorTreeFactory factory;
  // As Nav2 loads it: from the shared library.
  factory.registerFromPlugin(POSEGATE_PLUGIN);
  factory.registerNodeType<Action>("DockRobot");
  factory.registerNodeType<Action>("NavigateToPose");
  rules();
  condition(factory);
  tree(factory, argv[1]);
  return 0;
}
