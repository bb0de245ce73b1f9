/* Our C library behind the functions of solver.h. -DSOLVE=th_solve_tpm: another of its resolvers. */
#include "solver.h"

#include <stdlib.h>
#include <string.h>

#include "task_hierarchy.h"

#ifndef SOLVE
#define SOLVE th_solve_hcod
#endif

typedef struct prepared {
  th_problem problem;
  th_record record;
  double *work;
  int64_t size;
} prepared;

static void *copy(const void *from, size_t size) { return memcpy(malloc(size + 1), from, size); }

void *prepare(int64_t n, int64_t levels, const int64_t *sizes, const double *A,
              const double *lower, const double *upper, const double *reference) {
  const size_t each = sizeof(double);
  prepared *p = calloc(1, sizeof *p);
  double *x = malloc(n * each);
  int64_t m = 0, refused;
  for (int64_t k = 0; k < levels; ++k) m += sizes[k];
  p->problem = (th_problem){n, m, levels, copy(A, m * n * each), copy(lower, m * each),
                            copy(upper, m * each), copy(sizes, levels * sizeof *sizes),
                            copy(reference, n * each)};
  p->size = th_work_size(n, m, levels);
  p->work = malloc(p->size * each);
  p->record.size = th_record_size(n, m, levels);
  p->record.values = malloc(p->record.size * each);
  refused = SOLVE(&p->problem, NULL, &p->record, x, p->work, p->size) == TH_REFUSED;
  free(x);
  if (!refused) return p;
  release(p);
  return NULL;
}

int solve(void *handle, void *before, double *x, int64_t *iterations) {
  prepared *p = handle, *from = before;
  int status;
  p->record.warm = from && from->record.size == p->record.size;
  if (p->record.warm) { /* a solve writes over what it starts from */
    p->record.used = from->record.used;
    memcpy(p->record.values, from->record.values, from->record.used * sizeof(double));
  }
  status = SOLVE(&p->problem, NULL, &p->record, x, p->work, p->size);
  *iterations = p->record.iterations;
  return status == TH_SOLVED;
}

void release(void *handle) {
  prepared *p = handle;
  free((void *)p->problem.A), free((void *)p->problem.lower), free((void *)p->problem.upper);
  free((void *)p->problem.sizes), free((void *)p->problem.reference);
  free(p->work), free(p->record.values), free(p);
}
