// soth (LGPL-3.0, https://github.com/stack-of-tasks/soth) behind the functions of `compiled.py`.
// Compiled with the user's compiler against the user's copy, of which no line is here.
#include <soth/HCOD.hpp>

#include <cmath>
#include <list>
#include <memory>
#include <vector>

#include "timed.h"

namespace {
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

soth::Bound bound(double lower, double upper) {
  if (lower == upper) return soth::Bound(lower);
  if (std::isinf(lower)) return soth::Bound(upper, soth::Bound::BOUND_SUP);
  if (std::isinf(upper)) return soth::Bound(lower, soth::Bound::BOUND_INF);
  return soth::Bound(lower, upper);
}

struct Prepared {
  std::list<Eigen::MatrixXd> rows;  // the solver keeps no copy
  std::list<soth::VectorBound> bounds;
  std::unique_ptr<soth::HCOD> solver;
  Eigen::VectorXd x;
  std::vector<soth::cstref_vector_t> active;  // of the answer
};

void add(Prepared* p, const Eigen::MatrixXd& rows, const soth::VectorBound& bounds) {
  p->rows.push_back(rows), p->bounds.push_back(bounds);
  p->solver->pushBackStage(p->rows.back(), p->bounds.back());
}

int search(Prepared* p) {
  p->active.clear();
  try {
    p->solver->activeSearch(p->x);
  } catch (int) {  // too many iterations
    return 0;
  }
  p->active = p->solver->getOptimalActiveSet();
  return p->x.allFinite();
}
}  // namespace

extern "C" {
void* prepare(int n, int levels, const long* sizes, const double* A, const double* lower,
              const double* upper, const double* reference) {
  auto* p = new Prepared;
  p->solver.reset(new soth::HCOD(n, 0));
  p->x = Eigen::VectorXd::Zero(n);
  for (int k = 0; k < levels; A += sizes[k] * n, lower += sizes[k], upper += sizes[k], ++k) {
    if (sizes[k] == 0) continue;
    soth::VectorBound b(sizes[k]);
    for (long i = 0; i < sizes[k]; ++i) b[i] = bound(lower[i], upper[i]);
    add(p, Eigen::Map<const RowMajor>(A, sizes[k], n), b);
  }
  if (reference != nullptr) {  // the shortest x by itself, so zero needs no level
    soth::VectorBound b(n);
    for (int i = 0; i < n; ++i) b[i] = soth::Bound(reference[i]);
    add(p, Eigen::MatrixXd::Identity(n, n), b);
  }
  p->solver->setNameByOrder("level");
  p->solver->setDamping(0.0);
  return p;
}

int solve(void* handle) {
  auto* p = static_cast<Prepared*>(handle);
  p->solver->reset();
  p->solver->setInitialActiveSet();
  return search(p);
}

int solve_from(void* handle, void* before) {
  auto* p = static_cast<Prepared*>(handle);
  const auto& active = static_cast<Prepared*>(before)->active;
  p->solver->reset();
  if (active.size() == p->rows.size()) {
    p->solver->setInitialActiveSet(active);
  } else {  // there was no answer
    p->solver->setInitialActiveSet();
  }
  return search(p);
}

int solve_timed(void* handle, const repeats* limits, long long* times) {
  return timed([=] { solve(handle); }, limits, times);
}

int solve_from_timed(void* handle, void* before, const repeats* limits, long long* times) {
  return timed([=] { solve_from(handle, before); }, limits, times);
}

void answer(void* handle, double* x, int* iterations) {
  auto* p = static_cast<Prepared*>(handle);
  Eigen::Map<Eigen::VectorXd>(x, p->x.size()) = p->x;
  *iterations = -1;
}

void release(void* handle) { delete static_cast<Prepared*>(handle); }
}
