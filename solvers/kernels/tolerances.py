"""Every tolerance of the exact resolver that is not a setting.

All are relative. For a row a with side b they are relative to |a| scale + |b|. `scale` is the
length of x, but at least FLOOR times `size`: the largest of x, of the steps, and of the targets
over their pivots so far in the solve. So they have a floor from the data: even where x and all
sides are zero, rounding has the size of the numbers that cancelled.
"""

FLOOR = 1e-3        # of the largest number so far: lower bound of `scale`
OUTGROWN = 1e4      # largest number so far over 1 + |x|: larger ones leave the answer in doubt

EPSILON = 2e-15     # miss of a row: smaller ones are rounding
CANCELLED = 1e-14   # sum relative to the norms of its terms: smaller ones are rounding
SAME = 1e-12        # remainder of a row outside the others: smaller ones are rounding
WEAK = 1e-4         # share of a row in its own basis vector: smaller ones pivot the level again
DOUBTFUL = 1e-5     # remainder or miss of a row: smaller ones leave the answer in doubt
DUST = 1e-12        # norm of a row over the largest: smaller ones leave a doubt
LIGHT = 1e-5        # the same in a level that is missed, over the largest of the level
BORDER = 0.3        # of rank_tolerance: a dependent row with more left leaves the answer in doubt
BRINK = 0.8         # the same in a hierarchy with inequalities
DRIFT = 4e-9        # change of a settled row by the levels below: larger ones leave a doubt
SLIGHT = 0.25       # of rank_tolerance: a smaller miss counts as zero, without doubt
NO_STEP = 1e-12     # length of a step: smaller ones count as zero

# Of a proof by multipliers:
BAND = 5e-9         # distance of a row from the side that it is on, over 1 + |x|: as in `certify`
ENOUGH = 1e-9       # what may remain of the conditions, over the weakest possible pull of the level
CLEAR = 4e-9        # remainder of a unit row that counts as independent: at least
NOTHING = 1e-9      # remainder of a unit row that counts as dependent: at most
EXCHANGED = 4.0     # times ENOUGH: what may remain if such a row replaces one that it depends on
LARGEST = 1e5       # multiplier over the pull that it balances: at most
ALONE = 0.01        # share of what remains that is left where one row alone is missing: at most
UNIT = 2.0**-53     # rounding of a sum, over the sizes of its terms
FORGIVEN = 0.1      # share of what remains that counts in levels below, where it is that rounding

STALLED = 5         # consecutive steps of zero length before the sides are moved apart
RELAXATION = 1e-6   # amount by which they are moved, times 1 to 2
RELAXATIONS = 3     # most times per level; then the rule of least index applies
BLAND_AFTER = 30    # consecutive steps of zero length before the row of least index leaves
PATIENCE = 10       # releases per row of a level before small multipliers count as zero
LAST = 20           # releases per row of a level before it ends in doubt

NEGLIGIBLE = 1e-13
LEAST_SQUARE = 1e-200
LOOSE = 1e-9
MET = 1e-13
SHADOW = 1e-5
SLIGHT_ = 1e-8
UNIT_ROUNDING = 4e-15
CLEAR_ = 1.1
SPREAD = 2e-7
MOST_STEPS = 2
SURE = 4.0
STEEP = 1e-3
MOST_TRIES = 2
PRODUCT = 1e-15
