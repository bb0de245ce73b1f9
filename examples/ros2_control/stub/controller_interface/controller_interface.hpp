// Stands in for ros2_control where that is not installed: no more of its interface than the example
// uses, so that the example is compiled and runs on a simulated arm. Not for a robot.
#ifndef STUB_CONTROLLER_INTERFACE_HPP
#define STUB_CONTROLLER_INTERFACE_HPP

#include <string>
#include <vector>

namespace rclcpp {
struct Time {};
struct Duration {
  double length;
  double seconds() const { return length; }
};
}  // namespace rclcpp

namespace rclcpp_lifecycle {
struct State {};
}  // namespace rclcpp_lifecycle

namespace hardware_interface {
class LoanedStateInterface {
 public:
  explicit LoanedStateInterface(const double *value) : value_(value) {}
  double get_value() const { return *value_; }

 private:
  const double *value_;
};

class LoanedCommandInterface {
 public:
  explicit LoanedCommandInterface(double *value) : value_(value) {}
  void set_value(double value) { *value_ = value; }

 private:
  double *value_;
};
}  // namespace hardware_interface

namespace controller_interface {
enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
enum class return_type { OK, ERROR };
enum class interface_configuration_type { ALL, INDIVIDUAL, NONE };

struct InterfaceConfiguration {
  interface_configuration_type type;
  std::vector<std::string> names;
};

class ControllerInterface {
 public:
  virtual ~ControllerInterface() = default;
  virtual CallbackReturn on_init() = 0;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &) = 0;
  virtual return_type update(const rclcpp::Time &, const rclcpp::Duration &) = 0;

  const std::string &get_robot_description() const { return robot_description_; }

  std::string robot_description_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
};
}  // namespace controller_interface

#endif
