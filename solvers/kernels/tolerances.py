"""Every tolerance and limit of the kernels that is not a setting, with its reason.

All are relative. Those of the pass level by level are relative, for a row a with side b, to
|a| scale + |b|: `scale` is the length of x, but at least FLOOR times the largest number so far, so
that there is a floor where x and all sides are zero.
"""

# Rounding. Sums of some hundred terms are off by 1e-15 to 1e-13 of the largest.
EPSILON = 2e-15            # miss of a row, relative to its terms
CANCELLED = 1e-14          # sum relative to the norms of its terms; the least rank_tolerance
NEGLIGIBLE = 1e-13         # norm, entry or multiplier beside the largest: rounding in the other
FAINT = 1e-12              # of a row's norm: so far its entries are unsure, at most by themselves
FAR_LIGHTER = 1e-12        # norm of a row over the largest: the staircase hands such rows on
LEAST_SQUARE = 1e-200      # square of a norm: smaller ones lose digits, as do larger inverses

# What is met. A violation that the search pursues is larger than what the verification forgives.
MET = 1e-13          # violation of a level whose multipliers are zero, relative to its terms
VIOLATED = 1e-9      # violation at which a row enters, relative to its terms
SATURATES = 10.0     # excess of a row over |x|, times this: share that damping takes for held
LEVEL_MET = 1e-10    # violation of a level of which tpm says that it is met, relative to its terms
LARGER = 1e3         # x with rows that were neglected, over 1 + |x| without: more is rounding
BOUND_KEPT = 1e-12   # of sns, relative to |bound| + the largest |bound| up to 1
SHADOW = 1e-5        # of the largest number so far: part of the scale of x in the search
FLOOR = 1e-3         # the same in the pass level by level

# Verification: half of what `certify` accepts, because shifts and turns add up.
BAND = 5e-9          # shift of a side, relative to 1 + |x|
FREE_ROWS = 2.0      # share of the band of a row that acts over that of one that does not
REMAINDER = 2.5e-9   # what may remain of a gradient, as a turn [rad] of the rows of its level
KNOWN_MULTIPLIER = 1e-4  # what may remain of it over its terms and the smallest pivot
CUT_BALANCE = 2e-7   # what cut rows, or rounding, may add to a gradient, relative to its terms
ROUNDING_BALANCE = 5e-9  # rounding of it, from which on that may decide no sign
HEAVIER = 1e1        # norm of a row over that of another of its level, which it may round off
RANK_MARGIN = 1.004  # between a pivot or a cut and rank_tolerance, as a factor
CLEAR_MISS = 1e2     # violation of a level over what cuts of rows may add: its multipliers decide
PIVOT_PRODUCT = 1e-15  # of the two smallest pivots: less, and the second is rounding of the first
SIGN_MARGIN = 4.0    # multiplier over its error, that of the gradient over the smallest pivot
SIGN_ROUNDING = 4e-16  # of a gradient over its terms

# Pivots
CLEAR_SQUARE = 1e-2  # of a remainder over that of the row: smaller ones are summed, not updated
REPIVOT = 1e-4       # share of a row in its own basis vector: smaller ones pivot the level again
INDEPENDENT = 1e-2   # of rank_tolerance: a second pass counts rows as dependent only below that
DEARER = 0.25        # violation of a level after the second pass over that after the first, less 1
UNCLEAR_PIVOT = 1e-5  # of a row in the staircase, or less: the exact engine decides
LIGHT_ROW = 2e-4     # norm of a row over the largest in a level that is missed: the same
UNCLEAR_CUT = 0.3    # remainder of a dependent row over the smallest pivot: the same
ORTHOGONAL = 1e-15   # cosine of two rows: Jacobi rotations stop

# Limits. The pass ends after its number times rows + 1, the whole solve after its number times
# rows.
PASS_STEPS = 2
SOLVE_STEPS = 4
SPARED = 3           # rows over columns that are left to them: fewer are reflected one by one
PATIENCE = 2         # block pivots that may not reduce the number of wrong rows
RECURRENCES = 1      # of a working set in one search: after more it goes in circles
SLICE = 1.0 / 128.0  # of a search that ends in a level, for the next one there
SLICED = 0.5         # sum of these from which the first wrong row changes
RESTORED = 3         # times that a final working set is solved anew from uncut rows
SWEEPS = 40          # of Jacobi rotations, which need 6 to 10
