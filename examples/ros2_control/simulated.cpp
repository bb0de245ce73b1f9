// The controller on an arm that follows its commands exactly, for two seconds at 1 kHz. Prints the
// commands of every tick, then the distance left to the goal [m].
#include <cstdio>

#include "hierarchy_controller.cpp"

int main() {
  constexpr double PERIOD = 0.001;
  arm::Joints q{0.0, 0.6, 0.0, -1.4, 0.0, 0.8, 0.0}, v{}, command{};
  hierarchy_controller::HierarchyController controller;
  for (const double &angle : q) controller.state_interfaces_.emplace_back(&angle);
  for (const double &speed : v) controller.state_interfaces_.emplace_back(&speed);
  for (double &one : command) controller.command_interfaces_.emplace_back(&one);
  using controller_interface::CallbackReturn;
  if (controller.on_init() != CallbackReturn::SUCCESS) return 1;
  if (controller.on_activate({}) != CallbackReturn::SUCCESS) return 1;
  double J[3 * arm::JOINTS];
  arm::Vector goal = arm::hand(q, J);
  goal[1] += 0.3;
  goal[2] += 0.2;
  controller.go_to(goal);
  for (int tick = 0; tick < 2000; ++tick) {
    if (controller.update({}, {PERIOD}) != controller_interface::return_type::OK) return 1;
    v = command;
    for (int i = 0; i < arm::JOINTS; ++i) q[i] += PERIOD * v[i];
    for (int i = 0; i < arm::JOINTS; ++i) std::printf("%.17g ", v[i]);
    std::printf("\n");
  }
  const arm::Vector hand = arm::hand(q, J);
  std::fprintf(stderr, "%.6f\n", std::hypot(goal[0] - hand[0], goal[1] - hand[1],
                                            goal[2] - hand[2]));
  return 0;
}
