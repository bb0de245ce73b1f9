"""Every tolerance of the exact engine that is not a setting.

All are relative. Of a row a with side b they are taken of |a| scale + |b|. `scale` is the length of
x, but at least FLOOR of `size`: the largest of x, of the steps, and of the targets over their
pivots met so far in the solve. So they have a floor from the data: where x is zero and all sides
are zero, rounding still has the size of the numbers that cancelled.
"""

FLOOR = 1e-3        # of the largest number met, which tolerances are taken of where x is less
OUTGROWN = 1e4      # numbers met, as a multiple of 1 + |x|, beyond which an answer is worth a doubt

EPSILON = 2e-15     # what a row is missed by, below which that is rounding
CANCELLED = 1e-14   # of the norms that a sum is made of, below which the sum is rounding
SAME = 1e-12        # of a row, below which what others leave of it is rounding
WEAK = 1e-4         # of a row in its own basis vector, below which its level is pivoted again
DOUBTFUL = 1e-6     # of a row behind the others, or missed, below which an answer is worth a doubt
DUST = 1e-12        # norm of a row, as a share of the largest of its level; below, worth a doubt
SLIGHT = 0.25       # of rank_tolerance: a level missed by less is met, no doubt
NO_STEP = 1e-12     # of a step, below which it has no length

STALLED = 5         # steps of no length in a row, after which the sides are moved apart
RELAXATION = 1e-6   # by which they are moved, times 1 to 2
RELAXATIONS = 3     # times a level may do so; after that, the rule of least index
BLAND_AFTER = 30    # steps of no length in a row, after which the row of least index goes
PATIENCE = 10       # steps for each row of a level, after which small multipliers count as none
