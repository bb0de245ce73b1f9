/* Two joints: reach x0 + x1 = 1 first, then x0 = 2, within -0.5 <= x <= 0.9.
 * cc once.c -I LIB/include LIB/lib/libtask_hierarchy.a -lm -o once */
#include <stdio.h>
#include "task_hierarchy.h"

int main(void) {
  const double A[] = {1, 0,  0, 1,  1, 1,  1, 0};
  const double lower[] = {-0.5, -0.5, 1, 2}, upper[] = {0.9, 0.9, 1, 2};
  const int64_t sizes[] = {2, 1, 1};
  const th_problem problem = {2, 4, 3, A, lower, upper, sizes, NULL};
  double x[2], work[582], values[26]; /* th_work_size(2, 4, 3), th_record_size(2, 4, 3) */
  th_record record = {values, 26, 0, 0, 0, 0};
  int status = th_solve_hcod(&problem, NULL, &record, x, work, sizeof work / sizeof *work);
  printf("status %d, x = %g %g\n", status, x[0], x[1]);
  return status;
}
