// Prints boxes of the ros2_control example: of a joint with limits, and of one without.
#include <cstdio>
#include "limits.hpp"
int main() {
  for (double far : {0.5, double(INFINITY)}) {
    const limits::Joint joint{-far, far, 2.0, 10.0, 0.01};
    const auto v = limits::velocities(joint, 0.3, 0.1), a = limits::accelerations(joint, 0.3, 0.1);
    std::printf("%.17g %.17g %.17g %.17g ", v[0], v[1], a[0], a[1]);
  }
}
