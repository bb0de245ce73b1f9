// Times of solves inside C++, in which the call from Python has no part; the rules of worker.py.
#include <time.h>

#include <algorithm>
#include <chrono>

namespace {
long long processor() {  // [ns] of this process
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return now.tv_sec * 1000000000LL + now.tv_nsec;
}

long long since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count();
}

struct repeats {  // see Repeats in entrant.py
  int least, most;
  long long turn, enough;
};

// Writes times [ns] of solves and returns how many.
template <class Solve>
int timed(Solve solve, const repeats* limits, long long* times) {
  int count = 0;
  const auto begin = std::chrono::steady_clock::now();
  while (!count || (count < limits->most &&
                    since(begin) < (count < limits->least ? limits->enough : limits->turn))) {
    const long long busy = processor();
    const auto start = std::chrono::steady_clock::now();
    solve();
    const long long passed = since(start);
    times[count++] = std::min(passed, processor() - busy);
  }
  return count;
}
}  // namespace
