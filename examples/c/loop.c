/* A planar arm of three joints follows a circle at 1 kHz, its speeds within bounds: each tick writes
 * rows, solves from the record of the tick before, and brakes where there is no answer.
 * cc loop.c -I LIB/include LIB/lib/libtask_hierarchy.a -lm -o loop */
#include <stdio.h>
#include <stdlib.h>
#include "task_hierarchy.h"

enum { JOINTS = 3, ROWS = JOINTS + 2 + JOINTS, LEVELS = 3 };
static const double LINK = 0.4, PERIOD = 0.001, FASTEST = 1.2; /* [m], [s], [rad/s] */

/* Hand (2) [m] and its Jacobian (2, JOINTS) at q (JOINTS) [rad]. */
static void kinematics(const double *q, double *hand, double *J) {
  double angle = 0.0;
  memset(hand, 0, 2 * sizeof *hand);
  memset(J, 0, 2 * JOINTS * sizeof *J);
  for (int i = 0; i < JOINTS; ++i) {
    angle += q[i];
    const double x = LINK * cos(angle), y = LINK * sin(angle);
    hand[0] += x, hand[1] += y;
    for (int j = 0; j <= i; ++j) J[j] -= y, J[JOINTS + j] += x;
  }
}

int main(void) {
  double A[ROWS * JOINTS] = {0}, lower[ROWS] = {0}, upper[ROWS] = {0};
  const int64_t sizes[LEVELS] = {JOINTS, 2, JOINTS};
  const th_problem problem = {JOINTS, ROWS, LEVELS, A, lower, upper, sizes, NULL};
  const int64_t size = th_work_size(JOINTS, ROWS, LEVELS);
  const int64_t numbers = th_record_size(JOINTS, ROWS, LEVELS);
  double *work = malloc((size_t)size * sizeof *work);
  th_record record = {malloc((size_t)numbers * sizeof(double)), numbers, 0, 0, 0, 0};
  th_settings settings = th_defaults();
  settings.max_iterations = 50; /* the budget of a tick */
  double q[JOINTS] = {0.3, 0.8, 0.6}, v[JOINTS], hand[2], worst = 0.0;
  long braked = 0, limited = 0;
  if (!work || !record.values || !th_matches()) return 1;

  for (int i = 0; i < JOINTS; ++i) { /* speeds first, a posture at rest last: they keep their rows */
    A[i * JOINTS + i] = A[(JOINTS + 2 + i) * JOINTS + i] = 1.0;
    lower[i] = -FASTEST, upper[i] = FASTEST;
  }
  for (long tick = 0; tick < 6000; ++tick) {
    const double t = PERIOD * (double)tick, gain = 20.0;
    const double goal[2] = {0.55 + 0.1 * cos(2.0 * t), 0.55 + 0.1 * sin(2.0 * t)};
    kinematics(q, hand, A + JOINTS * JOINTS);
    const double speed[2] = {-0.2 * sin(2.0 * t), 0.2 * cos(2.0 * t)};
    for (int i = 0; i < 2; ++i)
      lower[JOINTS + i] = upper[JOINTS + i] = speed[i] + gain * (goal[i] - hand[i]);
    const int status = th_solve_hcod(&problem, &settings, &record, v, work, size);
    if (status != TH_SOLVED && status != TH_INACCURATE) {
      memset(v, 0, sizeof v);
      ++braked;
    }
    for (int i = 0; i < JOINTS; ++i) { /* the guard of what is not verified: it may leave its bounds */
      v[i] = fmax(lower[i], fmin(upper[i], v[i]));
      limited += record.values[i] == 1.0 || record.values[i] == -1.0;
      q[i] += PERIOD * v[i];
    }
    if (t > 2.0) worst = fmax(worst, hypot(goal[0] - hand[0], goal[1] - hand[1]));
  }
  printf("6000 ticks, %ld braked, speeds at a bound %ld times, error at most %.2f mm after 2 s\n",
         braked, limited, 1e3 * worst);
  free(work);
  free(record.values);
  return 0;
}
