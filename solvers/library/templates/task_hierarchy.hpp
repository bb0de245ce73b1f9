// A thin C++17 face of task_hierarchy.h: buffers with an owner, a problem filled level by level.
//
// Memory is allocated when a Solver is made, never while it solves; nothing here throws but what
// std::vector throws when memory is short. Sizes out of range are TH_INVALID when it solves. With
// TASK_HIERARCHY_EIGEN defined before the include, levels and answers may be Eigen objects.
#ifndef TASK_HIERARCHY_HPP
#define TASK_HIERARCHY_HPP

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "task_hierarchy.h"

#ifdef TASK_HIERARCHY_EIGEN
#include <Eigen/Core>
#endif

namespace task_hierarchy {

using Resolve = int (*)(const th_problem *, const th_settings *, th_record *, double *, double *,
                        std::int64_t);

// A resolver with room for a hierarchy of n unknowns whose levels have these sizes. The reference
// and all rows are zero at first. Rows are counted over all levels.
class Solver {
 public:
  Solver(Resolve resolve, std::int64_t n, std::vector<std::int64_t> sizes,
         const th_settings &settings = th_defaults())
      : resolve_(resolve), settings_(settings), sizes_(std::move(sizes)), n_(n) {
    for (const auto size : sizes_) m_ += size;
    const auto levels = static_cast<std::int64_t>(sizes_.size());
    if (th_work_size(n_, m_, levels) < 0) return;
    const auto unknowns = static_cast<std::size_t>(n_), rows = static_cast<std::size_t>(m_);
    A_.resize(rows * unknowns);
    lower_.resize(rows);
    upper_.resize(rows);
    x_.resize(unknowns);
    reference_.resize(unknowns);
    work_.resize(static_cast<std::size_t>(th_work_size(n_, m_, levels)));
    values_.resize(static_cast<std::size_t>(th_record_size(n_, m_, levels)));
  }
  Solver(Solver &&) = default;  // a copy's record would have the numbers of another
  Solver &operator=(Solver &&) = default;

  std::int64_t n() const noexcept { return n_; }
  std::int64_t m() const noexcept { return m_; }
  std::int64_t first_row(std::size_t level) const noexcept {
    std::int64_t first = 0;
    for (std::size_t k = 0; k < level; ++k) first += sizes_[k];
    return first;
  }

  // Row i of A, to be written: n entries.
  double *row(std::int64_t i) noexcept { return A_.data() + i * n_; }
  // lower <= A x <= upper in row i; the second form is an equality.
  void sides(std::int64_t i, double lower, double upper) noexcept {
    lower_.data()[i] = lower;
    upper_.data()[i] = upper;
  }
  void sides(std::int64_t i, double target) noexcept { sides(i, target, target); }
  // The x preferred where the levels leave freedom: n entries.
  double *reference() noexcept { return reference_.data(); }

  // Solve, from the record of the solve before where there is one.
  th_status solve() noexcept {
    const th_problem problem = described();
    record_.values = values_.data();
    record_.size = static_cast<std::int64_t>(values_.size());
    return static_cast<th_status>(resolve_(&problem, &settings_, &record_, x_.data(), work_.data(),
                                           static_cast<std::int64_t>(work_.size())));
  }
  // What each level still misses at x: norms has one entry per level.
  th_status violations(double *norms) const noexcept {
    const th_problem problem = described();
    return static_cast<th_status>(th_violations(&problem, x_.data(), norms));
  }
  // Whether x and the rows that act prove each other on the data, see th_verify.
  bool verified() noexcept {
    const th_problem problem = described();
    return th_verify(&problem, &settings_, &record_, x_.data(), work_.data(),
                     static_cast<std::int64_t>(work_.size())) == TH_SOLVED;
  }
  // Let the next solve start cold.
  void forget() noexcept { record_.warm = 0; }

  const double *x() const noexcept { return x_.data(); }
  const th_record &record() const noexcept { return record_; }

#ifdef TASK_HIERARCHY_EIGEN
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // The rows of a level, to be written: A (m_k, n), lower and upper (m_k).
  Eigen::Map<Rows> A(std::size_t level) noexcept {
    return {row(first_row(level)), sizes_[level], n_};
  }
  Eigen::Map<Eigen::VectorXd> lower(std::size_t level) noexcept {
    return {lower_.data() + first_row(level), sizes_[level]};
  }
  Eigen::Map<Eigen::VectorXd> upper(std::size_t level) noexcept {
    return {upper_.data() + first_row(level), sizes_[level]};
  }
  Eigen::Map<Eigen::VectorXd> reference_vector() noexcept { return {reference_.data(), n_}; }
  Eigen::Map<const Eigen::VectorXd> answer() const noexcept { return {x_.data(), n_}; }
#endif

 private:
  th_problem described() const noexcept {
    return {n_, m_, static_cast<std::int64_t>(sizes_.size()), A_.data(), lower_.data(),
            upper_.data(), sizes_.data(), reference_.data()};
  }

  Resolve resolve_;
  th_settings settings_;
  std::vector<std::int64_t> sizes_;
  std::int64_t n_ = 0, m_ = 0;
  std::vector<double> A_, lower_, upper_, reference_, x_, work_, values_;
  th_record record_{};
};

}  // namespace task_hierarchy

#endif
