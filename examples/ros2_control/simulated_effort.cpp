// The effort controller on the arm of a URDF, simulated by pinocchio, for half a second at 1 kHz. Prints
// the torques of every tick.
#include <cstdio>
#include <fstream>
#include <sstream>

#include <pinocchio/algorithm/aba.hpp>

#include "effort_controller.cpp"

int main(int count, char **arguments) {
  if (count != 2) return 2;
  std::stringstream text;
  text << std::ifstream(arguments[1]).rdbuf();
  constexpr double PERIOD = 0.001;
  pinocchio::Model model;
  pinocchio::urdf::buildModelFromXML(text.str(), model);
  pinocchio::Data data(model);
  Eigen::VectorXd q(7), v = Eigen::VectorXd::Zero(7), torque = Eigen::VectorXd::Zero(7);
  q << 0.0, 0.6, 0.0, -1.4, 0.0, 0.8, 0.0;
  hierarchy_controller::EffortController controller;
  controller.robot_description_ = text.str();
  for (const double &angle : q) controller.state_interfaces_.emplace_back(&angle);
  for (const double &speed : v) controller.state_interfaces_.emplace_back(&speed);
  for (double &one : torque) controller.command_interfaces_.emplace_back(&one);
  using controller_interface::CallbackReturn;
  if (controller.on_init() != CallbackReturn::SUCCESS) return 1;
  if (controller.on_activate({}) != CallbackReturn::SUCCESS) return 1;
  controller.go_to(controller.goal() + Eigen::Vector3d(0.0, 0.3, 0.2));
  for (int tick = 0; tick < 500; ++tick) {
    if (controller.update({}, {PERIOD}) != controller_interface::return_type::OK) return 1;
    const Eigen::VectorXd a = pinocchio::aba(model, data, q, v, torque);
    q += PERIOD * (v + PERIOD / 2 * a);
    v += PERIOD * a;
    for (int i = 0; i < 7; ++i) std::printf("%.17g ", torque[i]);
    std::printf("\n");
  }
  return 0;
}
