// The problem of once.c through task_hierarchy.hpp, without Eigen.
// c++ -std=c++17 once.cpp -I LIB/include LIB/lib/libtask_hierarchy.a -lm -o once_cpp
#include <cstdio>
#include "task_hierarchy.hpp"

int main() {
  task_hierarchy::Solver solver(th_solve_hcod, 2, {2, 1, 1});
  for (int i = 0; i < 2; ++i) {
    solver.row(i)[i] = 1.0;
    solver.sides(i, -0.5, 0.9);
  }
  solver.row(2)[0] = solver.row(2)[1] = 1.0;
  solver.sides(2, 1.0);
  solver.row(3)[0] = 1.0;
  solver.sides(3, 2.0);
  const th_status status = solver.solve();
  std::printf("status %d, x = %g %g\n", status, solver.x()[0], solver.x()[1]);
  return status;
}
