// Our C library behind the functions of `compiled.py`.
//   -DSOLVE=th_solve_hcod: which resolver.
#include <cstdint>
#include <cstring>
#include <vector>

#include "task_hierarchy.h"
#include "timed.h"

namespace {
struct Prepared {
  th_problem problem;
  std::vector<std::int64_t> sizes;
  std::vector<double> A, lower, upper, reference, x, values, work;
  th_record record;
};

int search(Prepared* p) {
  return SOLVE(&p->problem, nullptr, &p->record, p->x.data(), p->work.data(),
               static_cast<std::int64_t>(p->work.size())) == TH_SOLVED;
}
}  // namespace

extern "C" {
void* prepare(int n, int levels, const long* sizes, const double* A, const double* lower,
              const double* upper, const double* reference) {
  auto* p = new Prepared{};
  p->sizes.assign(sizes, sizes + levels);
  long m = 0;
  for (const auto size : p->sizes) m += size;
  p->A.assign(A, A + m * n);
  p->lower.assign(lower, lower + m), p->upper.assign(upper, upper + m);
  if (reference) p->reference.assign(reference, reference + n);
  p->x.resize(n);
  p->values.resize(th_record_size(n, m, levels)), p->work.resize(th_work_size(n, m, levels));
  p->problem = {n, m, levels, p->A.data(), p->lower.data(), p->upper.data(), p->sizes.data(),
                reference ? p->reference.data() : nullptr};
  p->record.values = p->values.data();
  p->record.size = static_cast<std::int64_t>(p->values.size());
  return p;
}

int solve(void* handle) {
  auto* p = static_cast<Prepared*>(handle);
  p->record.warm = 0;
  return search(p);
}

int solve_from(void* handle, void* before) {
  auto* p = static_cast<Prepared*>(handle);
  const auto* from = static_cast<Prepared*>(before);
  const bool warm = from->values.size() == p->values.size();
  if (warm) p->values = from->values;  // a solve writes over what it starts from
  p->record.used = warm ? from->record.used : 0;
  p->record.warm = warm;
  return search(p);
}

int solve_timed(void* handle, const repeats* limits, long long* times) {
  return timed([=] { solve(handle); }, limits, times);
}

int solve_from_timed(void* handle, void* before, const repeats* limits, long long* times) {
  return timed([=] { solve_from(handle, before); }, limits, times);
}

void answer(void* handle, double* x, int* iterations) {
  const auto* p = static_cast<Prepared*>(handle);
  std::memcpy(x, p->x.data(), p->x.size() * sizeof *x);
  *iterations = static_cast<int>(p->record.iterations);
}

void release(void* handle) { delete static_cast<Prepared*>(handle); }
}
