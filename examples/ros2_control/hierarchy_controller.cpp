// A controller of ros2_control for the velocities of a KUKA LWR IV: first the limits of the joints,
// then the hand at a goal. It has been compiled against the headers in stub/ only, never against
// ROS 2, and has moved nothing but the simulated arm in simulated.cpp.
#include <algorithm>
#include <array>
#include <string>

#include "arm.hpp"
#include "controller_interface/controller_interface.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "task_hierarchy.hpp"

namespace hierarchy_controller {

using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::interface_configuration_type;
using controller_interface::return_type;

constexpr double GAIN = 5.0, ACCELERATION = 10.0;  // [1/s], [rad/s^2]
constexpr std::int64_t ITERATIONS = 100;           // the budget of a tick

class HierarchyController : public controller_interface::ControllerInterface {
 public:
  CallbackReturn on_init() override {
    for (std::int64_t i = 0; i < arm::JOINTS; ++i) solver_.row(i)[i] = 1.0;
    return th_matches() ? CallbackReturn::SUCCESS : CallbackReturn::ERROR;
  }

  InterfaceConfiguration command_interface_configuration() const override {
    return {interface_configuration_type::INDIVIDUAL, names({"velocity"})};
  }

  InterfaceConfiguration state_interface_configuration() const override {
    return {interface_configuration_type::INDIVIDUAL, names({"position", "velocity"})};
  }

  // Starts where the arm is, at rest.
  CallbackReturn on_activate(const rclcpp_lifecycle::State &) override {
    solver_.forget();
    goal_ = arm::hand(angles(), solver_.row(arm::JOINTS));
    return CallbackReturn::SUCCESS;
  }

  return_type update(const rclcpp::Time &, const rclcpp::Duration &period) override {
    const arm::Joints q = angles();
    const arm::Vector hand = arm::hand(q, solver_.row(arm::JOINTS));
    std::array<std::array<double, 2>, arm::JOINTS> box;
    for (int i = 0; i < arm::JOINTS; ++i) {
      const double v = state_interfaces_[arm::JOINTS + i].get_value();
      box[i] = arm::box(i, q[i], v, ACCELERATION, period.seconds());
      solver_.sides(i, box[i][0], box[i][1]);
    }
    for (int k = 0; k < 3; ++k) solver_.sides(arm::JOINTS + k, GAIN * (goal_[k] - hand[k]));
    const th_status status = solver_.solve();
    const bool answered = status == TH_SOLVED || status == TH_INACCURATE;
    for (int i = 0; i < arm::JOINTS; ++i)  // the guard of what is not verified: it may leave the box
      command_interfaces_[i].set_value(
          answered ? std::clamp(solver_.x()[i], box[i][0], box[i][1]) : 0.0);
    return answered ? return_type::OK : return_type::ERROR;
  }

  // Where the hand goes [m]; a subscription would call this.
  void go_to(const arm::Vector &goal) { goal_ = goal; }

 private:
  static th_settings budget() {
    th_settings settings = th_defaults();
    settings.max_iterations = ITERATIONS;
    return settings;
  }

  static std::vector<std::string> names(const std::vector<std::string> &kinds) {
    std::vector<std::string> found;
    for (const auto &kind : kinds)
      for (int i = 0; i < arm::JOINTS; ++i)
        found.push_back("joint_" + std::to_string(i) + "/" + kind);
    return found;
  }

  arm::Joints angles() const {
    arm::Joints q;
    for (int i = 0; i < arm::JOINTS; ++i) q[i] = state_interfaces_[i].get_value();
    return q;
  }

  task_hierarchy::Solver solver_{th_solve_hcod, arm::JOINTS, {arm::JOINTS, 3}, budget()};
  arm::Vector goal_{};
};

}  // namespace hierarchy_controller

PLUGINLIB_EXPORT_CLASS(hierarchy_controller::HierarchyController,
                       controller_interface::ControllerInterface)
