/* Solves recorded problems again, one each millisecond as on the robot, and compares the answers
 * with the recorded ones of Python: are they the same bits, and in time? Exit code 1 if one differs
 * by more than 1e-8, relative to 1 + |x|.
 *
 *   python -m benchmark.studies.recorded stand-push standing.bin     a humanoid that is pushed
 *   cc replay.c -I LIB/include LIB/lib/libtask_hierarchy.a -lm -o replay && ./replay standing.bin
 *
 * The file: n, m, levels, count and the sizes as int64; count times A, lower, upper and the
 * reference; count times x. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>
#include "task_hierarchy.h"

static const long PERIOD = 1000000, BUDGET = 100; /* [ns]; active-set steps of a tick */

static void *read_all(const char *name) {
  FILE *file = fopen(name, "rb");
  if (!file || fseek(file, 0, SEEK_END)) return NULL;
  const size_t size = (size_t)ftell(file);
  void *content = malloc(size);
  rewind(file);
  if (!content || fread(content, 1, size, file) != size) return NULL;
  fclose(file);
  return content;
}

static double since(const struct timespec *start) { /* [us] */
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return 1e6 * (double)(now.tv_sec - start->tv_sec) + 1e-3 * (double)(now.tv_nsec - start->tv_nsec);
}

static int ascending(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

static double difference(const double *x, const double *y, int64_t n) {
  double apart = 0.0, size = 1.0;
  for (int64_t j = 0; j < n; ++j) {
    apart = fmax(apart, fabs(x[j] - y[j]));
    size = fmax(size, 1.0 + fabs(y[j]));
  }
  return apart / size;
}

int main(int count, char **arguments) {
  const int64_t *head = count == 2 ? read_all(arguments[1]) : NULL;
  if (!head || !th_matches()) return fprintf(stderr, "replay FILE\n"), 2;
  const int64_t n = head[0], m = head[1], levels = head[2], ticks = head[3];
  const double *data = (const double *)(head + 4 + levels);
  const int64_t of_tick = m * n + 2 * m + n;
  const double *recorded = data + ticks * of_tick;
  const int64_t size = th_work_size(n, m, levels), numbers = th_record_size(n, m, levels);
  double *work = calloc((size_t)size, sizeof *work), *x = calloc((size_t)n, sizeof *x);
  double *times = calloc((size_t)ticks, sizeof *times);
  th_record record = {calloc((size_t)numbers, sizeof(double)), numbers, 0, 0, 0, 0};
  th_settings settings = th_defaults();
  settings.max_iterations = BUDGET;
  const int locked = mlockall(MCL_CURRENT | MCL_FUTURE) == 0; /* no page is missing in the loop */
  long same = 0, unsolved = 0, missed = 0;
  double apart = 0.0; /* largest difference of an answer, relative to 1 + |x| */

  struct timespec due, woken;
  clock_gettime(CLOCK_MONOTONIC, &due);
  for (int64_t i = 0; i < ticks; ++i) {
    due.tv_nsec += PERIOD;
    if (due.tv_nsec >= 1000000000) due.tv_nsec -= 1000000000, ++due.tv_sec;
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
    clock_gettime(CLOCK_MONOTONIC, &woken);
    const double *tick = data + i * of_tick; /* a robot would write its rows here */
    const th_problem problem = {n, m, levels, tick, tick + m * n, tick + m * n + m, head + 4,
                                tick + m * n + 2 * m};
    const int status = th_solve_hcod(&problem, &settings, &record, x, work, size);
    times[i] = since(&woken);
    missed += since(&due) > 1e-3 * (double)PERIOD; /* woken late or solved slowly */
    unsolved += status != TH_SOLVED && status != TH_INACCURATE;
    same += memcmp(x, recorded + i * n, (size_t)n * sizeof *x) == 0;
    apart = fmax(apart, difference(x, recorded + i * n, n));
  }
  qsort(times, (size_t)ticks, sizeof *times, ascending);
  printf("%ld ticks of %ld unknowns and %ld rows: %ld with the bits of Python, others within "
         "%.0e, %ld unsolved\n", (long)ticks, (long)n, (long)m, same, apart, unsolved);
  printf("time of a solve: median %.1f us, p99 %.1f us, largest %.1f us; %ld ticks not done within "
         "their millisecond; memory %slocked\n", times[ticks / 2], times[ticks * 99 / 100],
         times[ticks - 1], missed, locked ? "" : "not ");
  return apart <= 1e-8 ? 0 : 1;
}
