"""The blocks of the documents that are made from rows: claims, tables, findings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from textwrap import fill

from scenarios.reproduce.claims import Claim, Compares, Ends, Keeps, in_text, share
from scenarios.reproduce.pages import Block
from scenarios.reproduce.rows import Rows
from scenarios.reproduce.watched import DAMPED, LARGEST, LEFT, MEDIAN

_WIDTH = 100     # columns of a page
_EPS_1 = 0.05    # [m] eps_1 of `ellipse`
_HUMAN = 0.3     # [m] what both scenarios of the experiment are to keep
_SAME = 1e-6     # [rad/s^2] commands that differ by less count as the same
_ON_CONE = 0.01  # [deg] beyond the cone that counts as on it
_WITHIN = 1e-6   # [rad] beyond a joint limit that counts as within it

LETTER_CLAIMS: tuple[Claim, ...] = (
    Keeps("The tasks are executed while the whole body avoids collisions", "letter",
          "body_distance_min", "ellipse", least=0.0),
    Keeps("The body's distance stays above eps_1 during the whole simulation", "letter",
          "body_distance_min", "ellipse", least=_EPS_1),
    Compares("Acceleration level takes away the jumps of joint velocity", "letter",
             "velocity_step_max", "velocity", "ellipse", "lower"),
    Compares("A cone of 35 deg moves more calmly than one of 5 deg", "letter", "speed_max",
             "ellipse", "35deg", "lower"),
    Compares("An inequality moves more calmly than an equality (35 deg)", "letter", "speed_max",
             "35deg-equality", "35deg", "lower"),
    Compares("An equality of 35 deg moves more calmly than an inequality of 5 deg", "letter",
             "speed_max", "ellipse", "35deg-equality", "lower"),
    Keeps("The cone of 5 deg is kept", "letter", "cone_violation_max", "ellipse", most=_ON_CONE),
    Keeps("The cone of 35 deg is kept", "letter", "cone_violation_max", "35deg", most=_ON_CONE),
    Compares("One-dimensional avoidance moves more calmly than three-dimensional", "letter",
             "speed_max", "3d", "ellipse", "lower"),
    Keeps("The joint limits are kept (published Jacobians)", "letter", "joint_limit_excess",
          "published", most=_WITHIN),
    Keeps("The joint limits are kept (correct Jacobians)", "letter", "joint_limit_excess",
          "ellipse", most=_WITHIN))

JACOBIAN_CLAIMS: tuple[Claim, ...] = (
    Compares("The wrong Jacobians of the published code flatter its speeds", "letter", "speed_max",
             "ellipse", "published", "lower"),
    Compares("Exact derivatives move faster than backward differences", "letter", "speed_max",
             "differences", "ellipse", "higher"),
    Ends("The letter's scheme runs undamped", "letter", "undamped"))

RESOLVER_CLAIMS: tuple[Claim, ...] = (
    Compares("`weighted`, damped, is calmer than a strict resolver on `ellipse`", "resolvers",
             "speed_max", "ellipse", "ellipse-weighted", "lower"),
    Keeps("Joint limits in the stack are kept", "resolvers", "joint_limit_excess", "limits-tpm",
          most=_WITHIN),
    Compares("Joint limits cost tracking", "resolvers", "position_error_rms_settled", "ellipse",
             "limits-tpm", "higher"),
    Compares("Inequalities in the stack move more calmly than Algorithm 1 with limits", "resolvers",
             "speed_max", "limits-tpm", "hqp-hcod", "lower"),
    Compares("Inequalities in the stack leave the cone by less", "resolvers", "cone_violation_max",
             "limits-tpm", "hqp-hcod", "lower"),
    Keeps("Inequalities in the stack keep the 50 mm asked for", "resolvers", "body_distance_min",
          "hqp-hcod", least=_EPS_1),
    Keeps("Algorithm 1 with limits keeps them", "resolvers", "body_distance_min", "limits-tpm",
          least=_EPS_1))

STATE_CLAIMS: tuple[Claim, ...] = (
    Keeps("`weighted` commands what `tpm` does in half of the ticks, damped", "states", MEDIAN,
          "weighted", most=_SAME),
    Keeps("`weighted` commands what `tpm` does in half of the ticks, undamped", "states", MEDIAN,
          "weighted-undamped", most=_SAME),
    Keeps("`hcod` commands what `tpm` does in every tick, damped", "states", LARGEST, "hcod",
          most=_SAME),
    Keeps("`recursive` commands what `tpm` does in every tick, damped", "states", LARGEST,
          "recursive", most=_SAME))

BLEND_CLAIMS: tuple[Claim, ...] = (
    Compares("A blend of 0.02 s brings the body of `ellipse` nearer to the obstacles", "blend",
             "body_distance_min", "ellipse", "ellipse-blend-0.02", "lower"),
    Compares("A blend of 0.1 s brings the body of `ellipse` nearer to the obstacles", "blend",
             "body_distance_min", "ellipse", "ellipse-blend-0.1", "lower"),
    Compares("A blend of 0.02 s lowers the largest velocity step at velocity level", "blend",
             "velocity_step_max", "velocity", "velocity-blend-0.02", "lower"))

INERTIA_CLAIMS: tuple[Claim, ...] = (
    Ends("D = M(q), the letter's example of (15), can be run", "inertia", "inertia-1"),
    Compares("D = 5 M(q) moves faster than D = 5 I", "inertia", "speed_max", "identity",
             "inertia-5", "higher"))

RIVAL_CLAIMS: tuple[Claim, ...] = (
    Compares("Algorithm 1 follows the path more accurately than avoidance in the null space ([5])",
             "rivals", "position_error_median_settled", "nullspace", "algorithm-1", "lower"),
    Compares("Algorithm 1 follows the path more accurately than danger bounds ([10])", "rivals",
             "position_error_median_settled", "danger-bounds", "algorithm-1", "lower"),
    Compares("Algorithm 1 keeps the body farther away than avoidance in the null space ([5])",
             "rivals", "body_distance_min", "nullspace", "algorithm-1", "higher"),
    Compares("Algorithm 1 keeps the body farther away than danger bounds ([10])", "rivals",
             "body_distance_min", "danger-bounds", "algorithm-1", "higher"))

SINGULAR_CLAIMS: tuple[Claim, ...] = (
    Compares("Undamped below limits the joints are slower than with damped pivots", "singular",
             "speed_max", "pivots", "limits", "lower"),
    Compares("Undamped below limits the error after the return is smaller, velocity level",
             "singular", "error_returned_rms", "pivots", "limits", "lower"),
    Compares("Undamped below limits the error after the return is smaller, acceleration level",
             "singular", "error_returned_rms", "acceleration-pivots", "acceleration-limits",
             "lower"))

HUMAN_CLAIMS: tuple[Claim, ...] = (
    Keeps("`human` keeps the body 0.3 m away", "human", "body_distance_min", "human",
          least=_HUMAN),
    Keeps("`human-hqp` keeps the body 0.3 m away", "human", "body_distance_min", "human-hqp",
          least=_HUMAN),
    Compares("The body is below 0.3 m for less time with `human-hqp`", "human", "body_below_share",
             "human", "human-hqp", "lower"),
    Compares("The end effector is below 0.3 m for less time with `human-hqp`", "human",
             "ee_below_share", "human", "human-hqp", "lower"),
    Compares("`human-hqp` keeps the end effector farther away than `human`", "human",
             "ee_distance_min", "human", "human-hqp", "higher"),
    Compares("`human-hqp` keeps the body farther away than `human`", "human",
             "body_distance_min", "human", "human-hqp", "higher"),
    Compares("`human-hqp` leaves the cone by less", "human", "cone_violation_max", "human",
             "human-hqp", "lower"),
    Compares("`human-hqp` moves more slowly", "human", "speed_max", "human", "human-hqp", "lower"),
    Compares("The mean direction (25)-(26) changes the stack less often than the nearest obstacle",
             "human", "stack_changes", "human-nearest", "human", "lower"))

STANDING_CLAIMS: tuple[Claim, ...] = (
    Compares("Strict levels miss the centre of mass by less than weights do", "standing",
             "miss_centre_of_mass", "weighted", "strict", "lower"),
    Compares("For this strict levels miss the posture by more", "standing", "miss_posture",
             "weighted", "strict", "higher"),
    Compares("With give the posture is missed by less than without", "standing", "miss_posture",
             "strict", "give", "lower"),
    Compares("Torques jump more under strict levels than under weights", "standing",
             "torque_step_max", "weighted", "strict", "higher"))

REACHING_CLAIMS: tuple[Claim, ...] = (
    Ends("With the centre of mass first the robot stands", "reaching", "strict"),
    Ends("With weights it stands", "reaching", "weighted"),
    Ends("With the hand first it stands", "reaching", "hand-first"),
    Ends("Without friction and limits in the stack it stands", "reaching", "equalities"),
    Compares("Strict levels hold the centre of mass, weights give some of it up", "reaching",
             "task_centre_of_mass_end", "weighted", "strict", "lower"),
    Compares("Strict levels bring the hand nearer to its target as well", "reaching",
             "task_left_hand_end", "weighted", "strict", "lower"),
    Compares("For this their soles slip more", "reaching", "slip_max", "weighted", "strict",
             "higher"),
    Compares("For this their torques jump more", "reaching", "torque_step_max", "weighted",
             "strict", "higher"))

CLAIMS = (*LETTER_CLAIMS, *JACOBIAN_CLAIMS, *STATE_CLAIMS, *RESOLVER_CLAIMS, *BLEND_CLAIMS,
          *INERTIA_CLAIMS, *RIVAL_CLAIMS, *SINGULAR_CLAIMS, *HUMAN_CLAIMS,
          *STANDING_CLAIMS, *REACHING_CLAIMS)

_LIMITS = ("joint_limit_excess", "speed_max", "acceleration_max", "body_distance_min",
           "cone_violation_max", "position_error_rms_settled", "stack_changes",
           "active_set_changes")
_LADDER = ("speed_max", "joint_limit_excess", "body_distance_min", "ee_distance_min",
           "cone_violation_max", "cone_violation_share", "stack_changes",
           "active_set_changes", "position_error_median_settled")
_RIVALS = ("position_error_median_settled", "body_distance_min", "ee_distance_min",
           "cone_violation_max", "cone_violation_share", "speed_max", "velocity_step_max")
_SINGULAR = ("ticks_frozen", "speed_max", "speed_limit_excess", "acceleration_max", "jerk_max",
             "joint_limit_excess", "error_returned_rms", "error_returned_max")
_LETTER = ("joint_limit_excess", "speed_max", "acceleration_max", "body_distance_min",
           "body_below_share", "cone_violation_max", "cone_violation_share",
           "position_error_rms_settled", "stack_changes")
_HUMAN_RUNS = ("true_position_error_rms", "true_position_error_max", "body_distance_min",
               "body_below_share", "ee_distance_min", "ee_below_share",
               "cone_violation_max", "speed_max", "command_step_max",
               "velocity_step_max", "stack_changes", "active_set_changes")
_STANDING = ("miss_centre_of_mass", "miss_left_hand", "miss_posture", "torque_step_max",
             "slip_max", "speed_max")
_REACHING = ("task_centre_of_mass_end", "task_left_hand_end", "miss_centre_of_mass",
             "miss_left_hand", "slip_max", "friction_margin_min", "support_margin_min",
             "torque_step_max")
_MISSED = tuple(f"miss_{level}" for level in (
    "physics", "limits", "joint_limits", "centre_of_mass", "left_hand", "right_hand", "posture",
    "least_force"))
_STATES = (MEDIAN, LARGEST)
_THROTTLE = (DAMPED, LEFT)
_BLEND = ("velocity_step_max", "acceleration_step_max", "body_distance_min")


def claims(rows: Mapping[str, Rows], listed: Sequence[Claim]) -> str:
    """Return a table of statements: what was found, and the verdict."""
    lines = ["| statement | found: median [quartiles] | verdict |", "|---|---|---|"]
    for claim in listed:
        judged = claim.judge(rows[claim.study])
        lines.append(f"| {claim.text} | {judged.found} | **{judged.verdict}** |")
    return "\n".join([*lines, "", _source(rows, dict.fromkeys(one.study for one in listed))])


def table(rows: Mapping[str, Rows], study: str, metrics: Sequence[str],
          interval: bool = False) -> str:
    """Return a table of a study, its columns as rows: median and quartiles of metrics.

    With `interval` the share of runs that reached their end has its 95 % interval.
    """
    found = rows[study]
    known = [name for name in metrics if name in found.metrics]
    heads = [_head(found, name) for name in known]
    lines = [f"| | reached the end | {' | '.join(heads)} |",
             "|---" * (len(heads) + 2) + "|"]
    ended = share if interval else "{} of {}".format
    lines += [f"| `{column}` | {ended(found.ended[column], found.starts)} | "
              f"{' | '.join(_bare(found, column, name) for name in known)} |"
              for column in found.values]
    return "\n".join([*lines, "", _source(rows, [study])])


def by_metric(rows: Mapping[str, Rows], study: str, metrics: Sequence[str],
              columns: Sequence[str]) -> str:
    """Return a table with a row per metric: median and quartiles in some columns of a study.

    Each column but the first is compared with the first, start by start.
    """
    found, first = rows[study], columns[0]
    lines = [f"| | {' | '.join(f'`{column}`' for column in columns)} |",
             "|---" * (len(columns) + 1) + "|"]
    for metric in metrics:
        cells = [_bare(found, first, metric)]
        for column in columns[1:]:
            pair = found.paired(metric, first, column)
            cells.append(f"{_bare(found, column, metric)}; {pair}" if pair.count
                         else _bare(found, column, metric))
        lines.append(f"| {_head(found, metric)} | {' | '.join(cells)} |")
    return "\n".join([*lines, "", _source(rows, [study])])


def findings(rows: Mapping[str, Rows]) -> str:
    """Return what the README says was found."""
    letter, resolvers = rows["letter"], rows["resolvers"]
    return "\n".join(fill(f"- {line}", _WIDTH, subsequent_indent="  ") for line in (
        "The published code has two wrong Jacobians, and they flatter it: the largest joint speed "
        f"is {in_text(letter, 'published', 'speed_max')} with them and "
        f"{in_text(letter, 'ellipse', 'speed_max')} without "
        f"({letter.paired('speed_max', 'ellipse', 'published')}).",
        "At acceleration level joint velocity no longer jumps: the largest step in a tick is "
        f"{in_text(letter, 'ellipse', 'velocity_step_max')}, at velocity level "
        f"{in_text(letter, 'velocity', 'velocity_step_max')}.",
        "The letter's scheme needs its damping: undamped, "
        f"{share(letter.ended['undamped'], letter.starts)} of the runs reach their end.",
        "The relaxed cone frees the robot: with 35 deg in place of 5 deg its largest joint speed "
        "is "
        f"{in_text(letter, '35deg', 'speed_max')} "
        f"({letter.paired('speed_max', 'ellipse', '35deg')}).",
        "Inequalities in the stack keep what they promise: `ellipse-hqp` asks for 50 mm, keeps "
        f"{in_text(resolvers, 'hqp-hcod', 'body_distance_min')}, and moves with "
        f"{in_text(resolvers, 'hqp-hcod', 'speed_max')}; Algorithm 1 below the same joint limits "
        f"moves with {in_text(resolvers, 'limits-tpm', 'speed_max')} ([one change at a time]"
        "(docs/ladder.md))."))


def _head(rows: Rows, name: str) -> str:
    metric = rows.metric(name)
    unit = f" [{metric.shown_unit}]" if metric.shown_unit else ""
    return f"{metric.label}{unit}"


def _bare(rows: Rows, column: str, name: str) -> str:
    text, unit = in_text(rows, column, name), rows.metric(name).shown_unit
    return text.removesuffix(f" {unit}") if unit else text


def _source(rows: Mapping[str, Rows], studies: Sequence[str] | Mapping[str, None]) -> str:
    """Return which command made a table, and from how many starts."""
    said = [f"`{rows[name].command}` ({rows[name].starts} starts, seed {rows[name].seed})"
            for name in studies]
    return f"From {', '.join(said)}."


BLOCKS: dict[str, Block] = {
    "letter-claims": partial(claims, listed=LETTER_CLAIMS),
    "jacobian-claims": partial(claims, listed=JACOBIAN_CLAIMS),
    "resolver-claims": partial(claims, listed=RESOLVER_CLAIMS),
    "state-claims": partial(claims, listed=STATE_CLAIMS),
    "throttle": partial(table, study="throttle", metrics=_THROTTLE),
    "states": partial(table, study="states", metrics=_STATES),
    "blend-claims": partial(claims, listed=BLEND_CLAIMS),
    "inequalities": partial(table, study="resolvers", metrics=_LIMITS),
    "letter-runs": partial(table, study="letter", metrics=_LETTER),
    "blend": partial(table, study="blend", metrics=_BLEND),
    "ladder": partial(table, study="ladder", metrics=_LADDER),
    "inertia": partial(table, study="inertia", metrics=_LIMITS),
    "rivals": partial(table, study="rivals", metrics=_RIVALS),
    "inertia-claims": partial(claims, listed=INERTIA_CLAIMS),
    "rival-claims": partial(claims, listed=RIVAL_CLAIMS),
    "singular-claims": partial(claims, listed=SINGULAR_CLAIMS),
    "singular": partial(table, study="singular", metrics=_SINGULAR),
    "human-claims": partial(claims, listed=HUMAN_CLAIMS),
    "standing": partial(table, study="standing", metrics=_STANDING, interval=True),
    "standing-levels": partial(by_metric, study="standing", metrics=_MISSED,
                               columns=("strict", "give", "weighted", "bounds", "equalities")),
    "standing-claims": partial(claims, listed=STANDING_CLAIMS),
    "reaching": partial(table, study="reaching", metrics=_REACHING, interval=True),
    "reaching-claims": partial(claims, listed=REACHING_CLAIMS),
    "human": partial(table, study="human", metrics=_HUMAN_RUNS),
    "findings": findings}
