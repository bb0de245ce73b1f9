// The arm: the hand of a KUKA LWR IV and its Jacobian, and its limits. Written out so that the example
// needs nothing but the library; effort_controller.cpp takes them from a URDF, through pinocchio.
#ifndef ARM_HPP
#define ARM_HPP

#include <array>
#include <cmath>

#include "limits.hpp"

namespace arm {

constexpr int JOINTS = 7;
constexpr double DEGREE = 3.14159265358979323846 / 180.0;
using Joints = std::array<double, JOINTS>;
using Vector = std::array<double, 3>;

// Standard Denavit-Hartenberg parameters [m], [deg]; a is zero. Limits [deg], [deg/s].
constexpr Joints D{0.0, 0.0, 0.4, 0.0, 0.39, 0.0, 0.078};
constexpr Joints ALPHA{90.0, -90.0, -90.0, 90.0, 90.0, -90.0, 0.0};
constexpr Joints RANGE{170.0, 120.0, 170.0, 120.0, 170.0, 120.0, 170.0};
constexpr Joints FASTEST{110.0, 110.0, 128.0, 128.0, 204.0, 184.0, 184.0};

inline Vector cross(const Vector &a, const Vector &b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Position of the hand [m], and its Jacobian J (3, JOINTS) row after row.
inline Vector hand(const Joints &q, double *J) {
  Vector x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, p{};
  std::array<Vector, JOINTS> axis, origin;
  for (int i = 0; i < JOINTS; ++i) {
    axis[i] = z;
    origin[i] = p;
    const double c = std::cos(q[i]), s = std::sin(q[i]);
    const double ca = std::cos(ALPHA[i] * DEGREE), sa = std::sin(ALPHA[i] * DEGREE);
    for (int k = 0; k < 3; ++k) {
      p[k] += D[i] * z[k];
      const double turned = c * x[k] + s * y[k], side = c * y[k] - s * x[k], up = z[k];
      x[k] = turned;
      y[k] = ca * side + sa * up;
      z[k] = ca * up - sa * side;
    }
  }
  for (int i = 0; i < JOINTS; ++i) {
    const Vector column =
        cross(axis[i], {p[0] - origin[i][0], p[1] - origin[i][1], p[2] - origin[i][2]});
    for (int k = 0; k < 3; ++k) J[k * JOINTS + i] = column[k];
  }
  return p;
}

// Least and greatest velocity of joint i at angle q and velocity v, with acceleration A [rad/s^2]
// and period T [s].
inline std::array<double, 2> box(int i, double q, double v, double A, double T) {
  return limits::velocities({-RANGE[i] * DEGREE, RANGE[i] * DEGREE, FASTEST[i] * DEGREE, A, T}, q, v);
}

}  // namespace arm

#endif
