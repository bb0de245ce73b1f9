// LexLS (BSD-2-Clause, https://github.com/jrl-umi3218/lexls) behind the functions of `compiled.py`.
// Compiled with the user's compiler against the user's copy, of which no line is here.
//   -DBOUNDS: a first level of the identity as simple bounds.
#include <lexls/lexlsi.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "timed.h"

namespace {
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
const double UNBOUNDED = 1e10;  // how a missing side is written

struct Prepared {
  std::vector<Eigen::MatrixXd> data;  // [A, lower, upper] of each level, or [lower, upper]
  std::vector<LexLS::Index> rows, variables;
  std::vector<LexLS::ObjectiveType> types;
  std::unique_ptr<LexLS::internal::LexLSI> solver;
  std::vector<std::vector<LexLS::ConstraintActivationType>> active;  // of the answer
};

// Whether the last level leaves no freedom: equalities of rank n.
bool decides(const Prepared& p, int n) {
  if (p.data.empty() || p.types.back() != LexLS::GENERAL_OBJECTIVE) return false;
  const Eigen::MatrixXd& last = p.data.back();
  return last.col(n) == last.col(n + 1) &&
         Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(last.leftCols(n)).rank() == n;
}

void load(Prepared* p) {
  p->solver->reset();
  for (size_t k = 0; k < p->data.size(); ++k) {
    if (p->types[k] == LexLS::SIMPLE_BOUNDS_OBJECTIVE)
      p->solver->setData(k, p->variables.data(), p->data[k]);
    else
      p->solver->setData(k, p->data[k]);
  }
}

int search(Prepared* p) {
  const auto status = p->solver->solve();
  p->active.resize(p->data.size());
  for (size_t k = 0; k < p->data.size(); ++k) p->solver->getActiveCtr(k, p->active[k]);
  return status == LexLS::PROBLEM_SOLVED && p->solver->get_x().allFinite();
}
}  // namespace

extern "C" {
void* prepare(int n, int levels, const long* sizes, const double* A, const double* lower,
              const double* upper, const double* reference) {
  auto* p = new Prepared;
  for (int i = 0; i < n; ++i) p->variables.push_back(i);
  for (int k = 0; k < levels; A += sizes[k] * n, lower += sizes[k], upper += sizes[k], ++k) {
    const long m = sizes[k];
    if (m == 0) continue;
    const Eigen::Map<const RowMajor> rows(A, m, n);
    bool simple = false;
#ifdef BOUNDS
    simple = p->data.empty() && m == n && rows.isIdentity(0.0) &&
             !std::equal(lower, lower + m, upper);
#endif
    Eigen::MatrixXd data(m, (simple ? 0 : n) + 2);
    if (!simple) data.leftCols(n) = rows;
    for (long i = 0; i < m; ++i) {
      data(i, data.cols() - 2) = std::max(lower[i], -UNBOUNDED);
      data(i, data.cols() - 1) = std::min(upper[i], UNBOUNDED);
    }
    p->types.push_back(simple ? LexLS::SIMPLE_BOUNDS_OBJECTIVE : LexLS::GENERAL_OBJECTIVE);
    p->data.push_back(data), p->rows.push_back(m);
  }
  if (!decides(*p, n)) {  // nearest to the reference
    Eigen::MatrixXd last = Eigen::MatrixXd::Identity(n, n + 2);
    for (int i = 0; i < n; ++i) last(i, n) = last(i, n + 1) = reference ? reference[i] : 0.0;
    p->data.push_back(last), p->rows.push_back(n), p->types.push_back(LexLS::GENERAL_OBJECTIVE);
  }
  p->solver.reset(new LexLS::internal::LexLSI(n, p->data.size(), p->rows.data(), p->types.data()));
  return p;
}

int solve(void* handle) {
  auto* p = static_cast<Prepared*>(handle);
  load(p);
  return search(p);
}

int solve_from(void* handle, void* before) {
  auto* p = static_cast<Prepared*>(handle);
  const auto& active = static_cast<Prepared*>(before)->active;
  load(p);
  for (size_t k = 0; k < active.size() && k < p->data.size(); ++k)
    for (size_t i = 0; i < active[k].size() && long(i) < p->data[k].rows(); ++i)
      if (active[k][i] == LexLS::CTR_ACTIVE_LB || active[k][i] == LexLS::CTR_ACTIVE_UB)
        p->solver->api_activate(k, i, active[k][i]);
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
  Eigen::Map<Eigen::VectorXd>(x, p->solver->get_x().size()) = p->solver->get_x();
  *iterations = p->solver->getFactorizationsCount();
}

void release(void* handle) { delete static_cast<Prepared*>(handle); }
}
