/* Solves a recorded sequence again and again, and says what that cost: time of each solve,
 * allocations, page faults.
 *
 *   c_speed FILE RESOLVER SOLVES
 *
 * FILE, written by recorded.py: n, m, levels, count and the sizes as int64; then count times A,
 * lower, upper and the reference. One line of numbers is printed, in the order of `printf` below. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "task_hierarchy.h"

/* These stand before those of the C library, for all code of the program. */
static volatile int armed;
static volatile long trapped;
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
void *malloc(size_t size) { trapped += armed; return __libc_malloc(size); }
void *calloc(size_t count, size_t size) { trapped += armed; return __libc_calloc(count, size); }
void *realloc(void *old, size_t size) { trapped += armed; return __libc_realloc(old, size); }
void *mmap(void *at, size_t size, int guard, int flags, int file, off_t offset) {
  trapped += armed;
  return (void *)syscall(SYS_mmap, at, size, guard, flags, file, offset);
}
void *sbrk(intptr_t more) { (void)more; trapped += armed; return (void *)-1; }

typedef int resolve(const th_problem *, const th_settings *, th_record *, double *, double *,
                    int64_t);

static resolve *named(const char *name) {
  if (strcmp(name, "hcod") == 0) return th_solve_hcod;
  if (strcmp(name, "tpm") == 0) return th_solve_tpm;
  if (strcmp(name, "recursive") == 0) return th_solve_recursive;
  return strcmp(name, "sns") == 0 ? th_solve_sns : NULL;
}

static void *read_all(const char *name) {
  FILE *file = fopen(name, "rb");
  if (!file || fseek(file, 0, SEEK_END)) return NULL;
  size_t size = (size_t)ftell(file);
  void *content = malloc(size);
  rewind(file);
  if (fread(content, 1, size, file) != size) return NULL;
  fclose(file);
  return content;
}

static long faults(void) {
  struct rusage used;
  getrusage(RUSAGE_SELF, &used);
  return used.ru_minflt + used.ru_majflt;
}

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b) {
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

int main(int count, char **arguments) {
  if (count != 4) return 2;
  int64_t *head = read_all(arguments[1]);
  resolve *solve = named(arguments[2]);
  long solves = atol(arguments[3]), failed = 0;
  if (!head || !solve || solves < 1 || !th_matches()) return 2;
  int64_t n = head[0], m = head[1], levels = head[2], ticks = head[3];
  double *data = (double *)(head + 4 + levels);
  int64_t size = th_work_size(n, m, levels), numbers = th_record_size(n, m, levels);
  double *work = calloc((size_t)size, sizeof *work), *x = calloc((size_t)n, sizeof *x);
  double *times = malloc((size_t)solves * sizeof *times);
  th_record record = {calloc((size_t)numbers, sizeof(double)), numbers, 0, 0, 0, 0};
  long before = 0;
  for (long i = 0; i < solves; ++i) times[i] = 0.0; /* touched before it is measured */
  for (long i = -ticks; i < solves; ++i) { /* once through the sequence to warm up */
    const double *tick = data + (i + ticks) % ticks * (m * n + 2 * m + n);
    th_problem problem = {n, m, levels, tick, tick + m * n, tick + m * n + m, head + 4,
                          tick + m * n + 2 * m};
    if (i == 0) armed = 1, before = faults();
    double begin = now();
    int status = solve(&problem, NULL, &record, x, work, size);
    double end = now();
    failed += status != TH_SOLVED && status != TH_INACCURATE;
    if (i >= 0) times[i] = end - begin;
  }
  armed = 0;
  before = faults() - before;
  qsort(times, (size_t)solves, sizeof *times, ascending);
  printf("%ld %ld %ld %ld %.0f %.0f %.0f\n", solves, failed, trapped, before, times[solves / 2],
         times[(long)((double)solves * 0.999)], times[solves - 1]);
  return 0;
}
