/* A solver in a shared library, for `hierarchy bench open --library FILE.so --name NAME`.
 *
 * A problem has levels of rows lower <= A x <= upper, the most important first. Each level minimises
 * the Euclidean norm of its violation without giving up any of the norms above it; of all such x the
 * answer is the one nearest to the reference. A solver without a reference solves for x - reference: it
 * subtracts A reference from the sides, and adds the reference to its answer.
 *
 * Compile these functions with your solver, on your side; library.c does it for our C library:
 *
 *   hierarchy library --out lib
 *   cc -O2 -fPIC -shared -Ilib/include library.c lib/lib/libtask_hierarchy.a -lm -o hcod.so
 *   hierarchy bench open --library hcod.so --name "hcod in C" --family EQ7
 *
 * One thread; nothing that one solve leaves may make the next one faster.
 */
#ifndef SOLVER_H
#define SOLVER_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Copies a problem into the solver's own form; not timed. sizes: rows of each level, which may be 0.
 * A: row after row. An equality has lower == upper, a missing side is infinite. reference: (n).
 * Returns NULL if the solver cannot be asked such a problem, which is not counted as failed. */
void *prepare(int64_t n, int64_t levels, const int64_t *sizes, const double *A,
              const double *lower, const double *upper, const double *reference);

/* Solves; timed. before: NULL for a cold start, or else a prepared problem of a tick before, which
 * has been solved, and from whose answer this solve may start. Writes x (n) and the iterations, or -1
 * if they are not known. Returns 1 if the solver calls x solved, 0 if not. */
int solve(void *prepared, void *before, double *x, int64_t *iterations);

/* Frees what `prepare` returned. */
void release(void *prepared);

#ifdef __cplusplus
}
#endif
#endif
