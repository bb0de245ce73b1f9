// The same with Eigen: levels are written as matrices, the answer is a vector.
// c++ -std=c++17 -DTASK_HIERARCHY_EIGEN eigen.cpp -I LIB/include -I/usr/include/eigen3
//     LIB/lib/libtask_hierarchy.a -lm -o eigen
#include <iostream>
#include "task_hierarchy.hpp"

int main() {
  task_hierarchy::Solver solver(th_solve_hcod, 2, {2, 1, 1});
  solver.A(0).setIdentity();
  solver.lower(0).setConstant(-0.5);
  solver.upper(0).setConstant(0.9);
  solver.A(1) << 1, 1;
  solver.lower(1) = solver.upper(1) = Eigen::VectorXd::Constant(1, 1.0);
  solver.A(2) << 1, 0;
  solver.lower(2) = solver.upper(2) = Eigen::VectorXd::Constant(1, 2.0);
  const th_status status = solver.solve();
  std::cout << "status " << status << ", x = " << solver.answer().transpose() << '\n';
  return status;
}
