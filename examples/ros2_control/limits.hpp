// The box of commands from which a joint can always stop before its limits; hierarchy/limits.py proves
// what it guarantees.
#ifndef LIMITS_HPP
#define LIMITS_HPP

#include <algorithm>
#include <array>
#include <cmath>

namespace limits {

// Of a joint: positions [rad], velocity [rad/s], acceleration [rad/s^2]; period [s] of the loop.
struct Joint {
  double lower, upper, velocity, acceleration, period;
};

// The velocity from which a joint that loses A T per tick comes to rest after the distance s.
inline double fastest(double s, double A, double T) {
  const double distance = std::min(std::fabs(s), 1e100);  // a joint without limits is at infinity
  const double k = std::floor((std::sqrt(1 + 8 * distance / (A * T * T)) - 1) / 2);
  const double w = k * A * T + (distance - k * (k + 1) / 2 * A * T * T) / ((k + 1) * T);
  return s >= 0 ? w : -w;
}

// Least and greatest velocity at the end of a tick that begins at r.
inline std::array<double, 2> next(const Joint &j, double r) {
  const double V = j.velocity;
  return {std::clamp(fastest(j.lower - r, j.acceleration, j.period), -V, V),
          std::clamp(fastest(j.upper - r, j.acceleration, j.period), -V, V)};
}

// Least and greatest velocity to command at position q and velocity v.
inline std::array<double, 2> velocities(const Joint &j, double q, double v) {
  const double step = j.acceleration * j.period;
  const auto [low, up] = next(j, q);
  return {std::clamp(low, v - step, v + step), std::clamp(up, v - step, v + step)};
}

// Least and greatest acceleration to command at position q and velocity v.
inline std::array<double, 2> accelerations(const Joint &j, double q, double v) {
  const double A = j.acceleration, T = j.period, r = q + v * T / 2;
  const auto [slow, fast] = next(j, r);
  return {std::clamp((slow - v) / T, -A, A), std::clamp((fast - v) / T, -A, A)};
}

}  // namespace limits

#endif
