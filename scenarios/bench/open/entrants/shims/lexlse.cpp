// LexLS's kernel for equalities behind the functions of `compiled.py`; see lexls.cpp.
#include <lexls/lexlse.h>

#include <memory>
#include <vector>

#include "timed.h"

namespace {
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

struct Prepared {
  std::vector<Eigen::MatrixXd> data;  // [A, b - A reference] of each level
  std::vector<LexLS::Index> rows;
  Eigen::VectorXd reference;
  std::unique_ptr<LexLS::internal::LexLSE> solver;
};
}  // namespace

extern "C" {
void* prepare(int n, int levels, const long* sizes, const double* A, const double* lower,
              const double*, const double* reference) {
  auto* p = new Prepared;
  p->reference = Eigen::VectorXd::Zero(n);
  if (reference) p->reference = Eigen::Map<const Eigen::VectorXd>(reference, n);
  for (int k = 0; k < levels; A += sizes[k] * n, lower += sizes[k], ++k) {
    if (sizes[k] == 0) continue;
    Eigen::MatrixXd data(sizes[k], n + 1);
    data.leftCols(n) = Eigen::Map<const RowMajor>(A, sizes[k], n);
    data.col(n) = Eigen::Map<const Eigen::VectorXd>(lower, sizes[k]);
    data.col(n) -= data.leftCols(n) * p->reference;
    p->data.push_back(data), p->rows.push_back(sizes[k]);
  }
  p->solver.reset(new LexLS::internal::LexLSE(n, p->data.size(), p->rows.data()));
  return p;
}

int solve(void* handle) {
  auto* p = static_cast<Prepared*>(handle);
  p->solver->setObjDim(p->rows.data());
  for (size_t k = 0; k < p->data.size(); ++k) {
    p->solver->setData(k, p->data[k]);
    for (LexLS::Index i = 0; i < p->rows[k]; ++i)
      p->solver->setCtrType(k, i, LexLS::CTR_ACTIVE_EQ);
  }
  p->solver->factorize();
  p->solver->solveLeastNorm_1();
  return p->solver->get_x().allFinite();
}

int solve_timed(void* handle, const repeats* limits, long long* times) {
  return timed([=] { solve(handle); }, limits, times);
}

void answer(void* handle, double* x, int* iterations) {
  auto* p = static_cast<Prepared*>(handle);
  Eigen::Map<Eigen::VectorXd>(x, p->reference.size()) = p->solver->get_x() + p->reference;
  *iterations = -1;
}

void release(void* handle) { delete static_cast<Prepared*>(handle); }
}
