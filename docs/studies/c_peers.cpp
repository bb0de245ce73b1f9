// Times a solver behind the functions of scenarios/bench/open/entrants/compiled.py, without Python.
//
//   c_peers LIBRARY PROBLEMS ANSWERS WARM PASSES
//
// PROBLEMS is written by recorded.py. With WARM = 1 a problem starts from the one before. ANSWERS: x
// of each problem in the last pass, then the time of each solve of each pass [ns], as double. A first
// pass is not written.
#include <dlfcn.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

template <class Function>
static Function *named(void *library, const char *name) {
  return reinterpret_cast<Function *>(dlsym(library, name));
}

int main(int count, char **arguments) {
  if (count != 6) return 2;
  void *library = dlopen(arguments[1], RTLD_NOW);
  std::ifstream file(arguments[2], std::ios::binary);
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
  if (!library || bytes.empty()) return 2;
  const auto *head = reinterpret_cast<const std::int64_t *>(bytes.data());
  const std::int64_t n = head[0], m = head[1], levels = head[2], problems = head[3];
  const std::vector<long> sizes(head + 4, head + 4 + levels);
  const auto *data = reinterpret_cast<const double *>(head + 4 + levels);
  const bool warm = std::atoi(arguments[4]) == 1;
  const long passes = std::atol(arguments[5]);

  auto *prepare = named<void *(int, int, const long *, const double *, const double *,
                               const double *, const double *)>(library, "prepare");
  auto *solve = named<int(void *)>(library, "solve");
  auto *solve_from = named<int(void *, void *)>(library, "solve_from");
  auto *answer = named<void(void *, double *, int *)>(library, "answer");
  if (!prepare || !solve || !answer || (warm && !solve_from)) return 2;

  std::vector<void *> prepared;
  for (std::int64_t i = 0; i < problems; ++i) {
    const double *A = data + i * (m * n + 2 * m + n), *lower = A + m * n, *upper = lower + m;
    bool zero = true;
    for (std::int64_t j = 0; j < n; ++j) zero = zero && upper[m + j] == 0.0;
    prepared.push_back(prepare(static_cast<int>(n), static_cast<int>(levels), sizes.data(), A, lower,
                               upper, zero ? nullptr : upper + m));
  }
  std::vector<double> times;
  times.reserve(passes * problems);
  for (long pass = -1; pass < passes; ++pass) {
    for (std::int64_t i = 0; i < problems; ++i) {
      const bool first = pass == -1 && i == 0;
      void *before = prepared[(i + problems - 1) % problems];
      const auto begin = std::chrono::steady_clock::now();
      warm && !first ? solve_from(prepared[i], before) : solve(prepared[i]);
      const auto end = std::chrono::steady_clock::now();
      if (pass >= 0) times.push_back(std::chrono::duration<double, std::nano>(end - begin).count());
    }
  }
  std::ofstream answers(arguments[3], std::ios::binary);
  std::vector<double> x(n);
  for (void *one : prepared) {
    int iterations = 0;
    answer(one, x.data(), &iterations);
    answers.write(reinterpret_cast<const char *>(x.data()), 8 * n);
  }
  answers.write(reinterpret_cast<const char *>(times.data()), 8 * times.size());
  return answers.flush() ? 0 : 2;
}
