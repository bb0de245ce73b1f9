// A controller of ros2_control for the efforts of an arm of seven joints, with pinocchio for its model:
// first the torque limits, then the limits of the joints, then the hand at a goal, then the posture.
// Like hierarchy_controller.cpp it has been compiled against the headers in stub/ only, and has moved
// nothing but the simulated arm in simulated_effort.cpp.
#include <string>

#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include "controller_interface/controller_interface.hpp"
#include "limits.hpp"
#include "pluginlib/class_list_macros.hpp"
#define TASK_HIERARCHY_EIGEN
#include "task_hierarchy.hpp"

namespace hierarchy_controller {

using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::interface_configuration_type;
using controller_interface::return_type;

constexpr int JOINTS = 7;
constexpr double ACCELERATION = 10.0;                   // [rad/s^2]
constexpr double STIFFNESS = 100.0, DAMPING = 20.0;     // of the hand [1/s^2], [1/s]
constexpr double POSTURE = 10.0, POSTURE_DAMPING = 5.0; // [1/s^2], [1/s]
constexpr const char *HAND = "end_effector";

class EffortController : public controller_interface::ControllerInterface {
 public:
  CallbackReturn on_init() override {
    pinocchio::urdf::buildModelFromXML(get_robot_description(), model_);
    if (model_.nq != JOINTS || model_.nv != JOINTS || !model_.existFrame(HAND) || !th_matches())
      return CallbackReturn::ERROR;
    data_ = pinocchio::Data(model_);
    hand_ = model_.getFrameId(HAND);
    solver_.A(1).setIdentity();
    solver_.A(3).setIdentity();
    return CallbackReturn::SUCCESS;
  }

  InterfaceConfiguration command_interface_configuration() const override {
    return {interface_configuration_type::INDIVIDUAL, names({"effort"})};
  }

  InterfaceConfiguration state_interface_configuration() const override {
    return {interface_configuration_type::INDIVIDUAL, names({"position", "velocity"})};
  }

  // Starts where the arm is, at rest.
  CallbackReturn on_activate(const rclcpp_lifecycle::State &) override {
    read();
    pinocchio::forwardKinematics(model_, data_, q_);
    goal_ = pinocchio::updateFramePlacement(model_, data_, hand_).translation();
    posture_ = q_;
    solver_.forget();
    return CallbackReturn::SUCCESS;
  }

  return_type update(const rclcpp::Time &, const rclcpp::Duration &period) override {
    read();
    write_rows(period.seconds());
    const th_status status = solver_.solve();
    const bool answered = status == TH_SOLVED || status == TH_INACCURATE;
    torque_ = data_.nle - POSTURE_DAMPING * v_; // without an answer: gravity, and brake
    if (answered) torque_ = data_.nle + data_.M * solver_.answer();
    if (!torque_.allFinite()) torque_.setZero(); // what was read is not finite
    for (int i = 0; i < JOINTS; ++i) {
      const double limit = model_.upperEffortLimit[i];
      command_interfaces_[i].set_value(std::clamp(torque_[i], -limit, limit));
    }
    return answered ? return_type::OK : return_type::ERROR;
  }

  // Where the hand goes [m]; a subscription would call this.
  void go_to(const Eigen::Vector3d &goal) { goal_ = goal; }
  const Eigen::Vector3d &goal() const { return goal_; }

 private:
  static std::vector<std::string> names(const std::vector<std::string> &kinds) {
    std::vector<std::string> found;
    for (const auto &kind : kinds)
      for (int i = 0; i < JOINTS; ++i) found.push_back("joint_" + std::to_string(i) + "/" + kind);
    return found;
  }

  void read() {
    for (int i = 0; i < JOINTS; ++i) {
      q_[i] = state_interfaces_[i].get_value();
      v_[i] = state_interfaces_[JOINTS + i].get_value();
    }
  }

  // Rows over the accelerations a: M a + h within the torque limits, and so on.
  void write_rows(double period) {
    using pinocchio::LOCAL_WORLD_ALIGNED;
    pinocchio::crba(model_, data_, q_);
    data_.M.triangularView<Eigen::StrictlyLower>() = data_.M.transpose();
    pinocchio::nonLinearEffects(model_, data_, q_, v_);
    solver_.A(0) = data_.M;
    solver_.lower(0) = -model_.upperEffortLimit - data_.nle;
    solver_.upper(0) = model_.upperEffortLimit - data_.nle;
    for (int i = 0; i < JOINTS; ++i) {
      const auto [low, up] = limits::accelerations(
          {model_.lowerPositionLimit[i], model_.upperPositionLimit[i],
           model_.upperVelocityLimit[i], ACCELERATION, period}, q_[i], v_[i]);
      solver_.sides(JOINTS + i, low, up);
    }
    pinocchio::forwardKinematics(model_, data_, q_, v_, rest_);
    const Eigen::Vector3d hand =
        pinocchio::updateFramePlacement(model_, data_, hand_).translation();
    J_.setZero();
    pinocchio::computeFrameJacobian(model_, data_, q_, hand_, LOCAL_WORLD_ALIGNED, J_);
    const Eigen::Vector3d drift =  // of the hand where no joint accelerates
        pinocchio::getFrameClassicalAcceleration(model_, data_, hand_, LOCAL_WORLD_ALIGNED).linear();
    solver_.A(2) = J_.topRows<3>();
    solver_.lower(2) = solver_.upper(2) =
        STIFFNESS * (goal_ - hand) - DAMPING * (J_.topRows<3>() * v_) - drift;
    solver_.lower(3) = solver_.upper(3) = POSTURE * (posture_ - q_) - POSTURE_DAMPING * v_;
  }

  pinocchio::Model model_;
  pinocchio::Data data_;
  pinocchio::FrameIndex hand_ = 0;
  task_hierarchy::Solver solver_{th_solve_hcod, JOINTS, {JOINTS, JOINTS, 3, JOINTS}};
  // Sizes as in the compiled parts of pinocchio; none changes, so none is allocated in a tick.
  Eigen::VectorXd q_{JOINTS}, v_{JOINTS}, posture_{JOINTS}, torque_{JOINTS};
  const Eigen::VectorXd rest_ = Eigen::VectorXd::Zero(JOINTS);
  pinocchio::Data::Matrix6x J_{6, JOINTS};
  Eigen::Vector3d goal_;
};

}  // namespace hierarchy_controller

PLUGINLIB_EXPORT_CLASS(hierarchy_controller::EffortController,
                       controller_interface::ControllerInterface)
