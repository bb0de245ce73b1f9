/* Prioritized control problems, resolved without Python. Version @VERSION@, Apache-2.0.
 *
 * Made by `hierarchy library` for @MACHINE@,
 * out of kernels with the digest @DIGEST@.
 *
 * A hierarchy has levels of rows lower <= A x <= upper, the first level first. Each level minimises
 * the Euclidean norm of its violation without giving up any of the norms above it. Among all such x
 * the answer is the one nearest to the reference. The units are yours: x in rad/s or rad/s^2, say.
 *
 * Nothing is allocated, kept, locked or printed. All memory belongs to the caller. A function reads
 * its problem and settings, and writes only its record, x and work space; none of these may overlap.
 * Calls with different records, x and work spaces may run at the same time.
 *
 *   int64_t size = th_work_size(n, m, levels), numbers = th_record_size(n, m, levels);
 *   double *work = malloc(size * sizeof *work), *values = malloc(numbers * sizeof *values);
 *   th_record record = {values, numbers};
 *   int status = th_solve_hcod(&problem, NULL, &record, x, work, size);
 *
 * The next call with the same record starts from what this one found, if the resolver can.
 */
#ifndef TASK_HIERARCHY_H
#define TASK_HIERARCHY_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define TH_VERSION "@VERSION@"
#define TH_DIGEST "@DIGEST@"

#ifdef __cplusplus
extern "C" {
#endif

/* How a solve ended. x is finite, and zero where no answer is named here; it is left alone if it is
 * missing or n is out of range. */
typedef enum th_status {
  TH_SOLVED = 0,
  /* The budget max_iterations is spent. x is optimal for the levels above the unfinished one. */
  TH_ITERATION_LIMIT = 1,
  /* The data hold NaN, an infinite entry, lower > upper, or squares that over- or underflow. */
  TH_NUMERICAL_FAILURE = 2,
  /* x is an answer that could not be verified: rows are nearly parallel or differ greatly in scale.
   * th_violations says what each level still misses at x, not whether it could miss less. */
  TH_INACCURATE = 4,
  /* The work space or the record is smaller than th_work_size or th_record_size says. */
  TH_TOO_SMALL = 8,
  /* sns: two bounds on one unknown contradict each other, the second in the row of the record. */
  TH_CONTRADICTION = 10,
  /* The resolver does not handle an inequality such as the row of the record. */
  TH_REFUSED = 11,
  /* A pointer is missing, the sizes do not add up, or a setting is out of range. */
  TH_INVALID = 12
} th_status;

/* A hierarchy: n unknowns (1 to 2^20), m rows (0 to 2^20), levels. All arrays are only read. That the
 * sizes add up is checked in each call; how long your arrays are, no function of C can see. */
typedef struct th_problem {
  int64_t n;
  int64_t m;
  int64_t levels;
  const double *A;         /* (m, n), row after row: entry (i, j) is A[i * n + j] */
  const double *lower;     /* (m), -INFINITY for none; an equality has lower == upper */
  const double *upper;     /* (m), INFINITY for none */
  const int64_t *sizes;    /* (levels), rows of each level; the sum is m */
  const double *reference; /* (n), NULL for zero */
} th_problem;

/* What a solve leaves. Zero all fields but the first two before the first solve. */
typedef struct th_record {
  double *values;     /* numbers of the solve, laid out as each resolver says below */
  int64_t size;       /* numbers that fit into values: th_record_size or more */
  int64_t used;       /* numbers written by the last solve */
  int64_t warm;       /* 1 if the next solve starts from this one; set it to 0 for a cold start */
  int64_t iterations; /* of the last solve; 1 for a direct method */
  int64_t row;        /* with TH_REFUSED and TH_CONTRADICTION: which, from 0; else -1 */
} th_record;

/* Settings, with the names and the meaning that they have in Python. */
typedef struct th_settings {
  double damping;         /* >= 0; 0 is off. With damping every solve is a cold start. */
  double threshold;       /* > 0, singular value below which damping starts */
  double rank_tolerance;  /* 0 to 1, share of a row below which it depends on the rows above */
  double tolerance;       /* hcod, tpm, merged: of violations, relative to their terms; below 1e-3 */
  double isotropic;       /* recursive, TH_CHIAVERINI: damping of all directions */
  double largest;         /* recursive, TH_SELECTIVE: largest step; INFINITY is no damping */
  double ratio;           /* merged: weight of a level over that of the level below, at least 1 */
  double cap;             /* merged: most that a target moves, times the scale of its level */
  double step;            /* merged: share of a miss by which it moves, above 0, at most 1 */
  double regularisation;  /* merged: weight of unknowns that no merged equality names alone */
  int64_t max_iterations; /* hcod, tpm, merged: most of `iterations`, at least 1 */
  int64_t optimal;        /* sns: 1 for form = "optimal", 0 for "basic" */
  int64_t miss;           /* sns: 1 for scales = "miss", 0 for "target" */
  int64_t method;         /* recursive: one of th_method */
  int64_t strict_levels;  /* merged: levels that stay strict; -1: the first run of levels with
                             inequalities, and all levels above it */
  const double *scales;   /* merged: (levels), the miss of each that counts as 1; NULL for 1 */
} th_settings;

typedef char th_has_pointers_of_64_bits[sizeof(void *) == 8 ? 1 : -1];

typedef enum th_method {
  TH_LEVEL = 0, TH_NAKAMURA = 1, TH_CHIAVERINI = 2, TH_SELECTIVE = 3
} th_method;

/* The defaults of Python; NULL in place of settings means the same. */
static inline th_settings th_defaults(void) {
  th_settings settings = {@DEFAULTS@};
  return settings;
}

/* Doubles that a work space needs, for any resolver; -1 if a size is out of range. */
int64_t th_work_size(int64_t n, int64_t m, int64_t levels);

/* Doubles that a record needs, for any resolver; -1 if a size is out of range. */
int64_t th_record_size(int64_t n, int64_t m, int64_t levels);

/* Writes the Euclidean norm of each level's violation at x (n) to norms (levels), which is INFINITY
 * where it is not finite or lower > upper. Returns TH_SOLVED, TH_NUMERICAL_FAILURE if a norm is
 * INFINITY, or TH_INVALID. */
int th_violations(const th_problem *problem, const double *x, double *norms);

/* Whether x and the rows that act prove each other on the data: TH_SOLVED, else TH_INACCURATE, or
 * why it cannot be asked. The check behind TH_SOLVED, repeated from nothing but the problem, x and
 * the record of the solve (of th_solve_hcod or th_solve_tpm; otherwise no inequality acts); it costs
 * about as much as a warm solve, and writes to the work space only. TH_INACCURATE with damping, and
 * for some 3 in 1000 solved problems with dependent rows that act: other multipliers prove x. */
int th_verify(const th_problem *problem, const th_settings *settings, const th_record *record,
              const double *x, double *work, int64_t work_size);

/* Version and digest of the library; th_matches says whether it belongs to this header. */
const char *th_version(void);
const char *th_digest(void);
static inline int th_matches(void) { return strcmp(th_digest(), TH_DIGEST) == 0; }

/* The resolvers. x (n) receives the answer. work: any contents, work_size numbers. Each returns one
 * of th_status. */
@if hcod
/* Exact, with inequalities at every level. values (3 m + 3): state of each row (2 an equality, 1
 * and -1 active at the upper and lower side, 0 inactive); the level that each row holds back (-1 for
 * none, `levels` for the reference); its multiplier there; active sets tried; steps; the level that
 * is unfinished, rounded down, -1 for none; at most -2: x keeps no level, the search may go on. */
int th_solve_hcod(const th_problem *problem, const th_settings *settings, th_record *record,
                  double *x, double *work, int64_t work_size);
@end
@if tpm
/* The Task Priority Matrix in its staircase form, and the method of hcod where a bound is active. A
 * first level may hold bounds on single unknowns; otherwise equalities. values, where used is not 0
 * (n + levels + 3 m + 3): state of each unknown (1 and -1 at its upper and lower bound, 2 at both, 0
 * free); the share of its target that each level reaches; the record of hcod. */
int th_solve_tpm(const th_problem *problem, const th_settings *settings, th_record *record,
                 double *x, double *work, int64_t work_size);
@end
@if recursive
/* Level by level in the null space of the levels above; equalities. It writes no values. */
int th_solve_recursive(const th_problem *problem, const th_settings *settings, th_record *record,
                       double *x, double *work, int64_t work_size);
@end
@if sns
/* Saturation in the null space; a first level may hold bounds on single unknowns. values (n + levels
 * + 1): state of each unknown and share of each level as for tpm; sets of saturated unknowns tried. */
int th_solve_sns(const th_problem *problem, const th_settings *settings, th_record *record,
                 double *x, double *work, int64_t work_size);
@end
@if merged
/* Strict limits, one weighted level with a memory below them, which lives in the record: solve each
 * tick from the one before. TH_INVALID with damping; TH_REFUSED where no level is left to merge.
 * values (4 m + 3 n + 4): by how much the sides of each row move in the next solve; steps; states of
 * rows as for hcod. */
int th_solve_merged(const th_problem *problem, const th_settings *settings, th_record *record,
                    double *x, double *work, int64_t work_size);
@end

#ifdef __cplusplus
}
#endif

#endif
