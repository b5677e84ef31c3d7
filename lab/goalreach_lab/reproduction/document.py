"""REPRODUCTION.md: the paper's claims, what was measured, and the free parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import platform
from typing import Any

from goalreach_lab.reproduction import tables
from goalreach_lab.reproduction.study import DrivenPath, goals
from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.files import write_text_atomically
from goalreach_msgs_py.parameters import flatten_config, parameter_infos
from goalreach_msgs_py.regions import DEFAULT_X_KNOTS_M, DEFAULT_Y_KNOTS_M

_TIMES = ('ms', 's')


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Everything measured.

    Attributes:
        learning: Rows of the learning suite.
        blends: Findings of `study_blends`.
        driven: Paths by noise, mode and kind of starts.
        arenas: Paths by example arena.
        without: Paths of policies learned without noise.
        images: Paths of policies learned with images, from the same starts.
        policies: How many of either.
        image_trials: Trials of each.
        seed: Seed of it all.
    """

    learning: Sequence[Mapping[str, Any]]
    blends: Mapping[str, Any]
    driven: Mapping[tuple[str, str, str], Sequence[DrivenPath]]
    arenas: Mapping[str, Sequence[DrivenPath]]
    without: Sequence[DrivenPath]
    images: Sequence[DrivenPath]
    policies: int
    image_trials: int
    seed: int


def write_document(path: Path, evidence: Evidence) -> None:
    """Write the document.

    Raises:
        FileFormatError: It cannot be written.
    """
    parts = [
        _introduction(evidence),
        '## The claims of the paper',
        _claims(evidence),
        '## Learning',
        _learning(evidence),
        '## Driving with images in the loop',
        _driving(evidence),
        '## Equation (3)',
        _equation_3(evidence),
        '## Learned without noise, learned with images',
        _policies(evidence),
        '## Other arenas',
        _arenas(evidence),
        '## Free parameters',
        _parameters(),
    ]
    write_text_atomically(path, '\n\n'.join(parts) + '\n')


def _introduction(evidence: Evidence) -> str:
    return f"""# The paper, measured

Written by `goalreach bench reproduction --out REPRODUCTION.md` (seed {evidence.seed}); every
number comes from that command. It goes on where it ended, `--as-it-is` writes what is there, and
the tables tell how many paths that was; `--help` lists the budgets. Measured on
{platform.machine()} with Python {platform.python_version()}. Intervals are 95 %: Wilson's for
shares, Newcombe's for differences of shares, normal for means. "Goal" means that the robot
declared the goal from what it saw and its true centre was in the goal region at that moment.
The robot, its camera and its room are simulated throughout; the paper's figure 7 shows a real
robot, ours the full chain of rendered images, localizer, state estimator and controller."""


def _claims(evidence: Evidence) -> str:
    rows = {row['name']: row for row in evidence.learning}
    success = rows['greedy policy reaches the goal from all 22 starts']
    trial = rows['trial after which it always does, median']
    value = rows['value of a region, mean over seeds, against value iteration']
    fuzzy, harsh = (
        [path for kind in ('random', 'border') for path in evidence.driven[noise, 'fuzzy', kind]]
        for noise in ('nominal', 'harsh')
    )
    reached, shaken = (tables.share(len(goals(paths)), len(paths)) for paths in (fuzzy, harsh))
    stable = (
        f'the best actions settle after trial {trial["ours"]:.0f} (median of {trial["n"]} seeds; '
        f'{trial["note"]}); values are then within {value["ours"]:.3f} of value iteration on the '
        'same decision process'
    )
    optimal = (
        f'{success["ours"]:.2f} % of {success["n"]} seeds lead from all 22 starts to the goal '
        f'({success["note"]})'
    )
    driven = (
        f'fuzzy, nominal noise: {reached} of {len(fuzzy)} paths; harsh: {shaken} of {len(harsh)}'
    )
    smooth = 'see the table of modes: turning, time, length and heading steps beside crisp'
    return tables.table(
        ('the paper', 'measured here'),
        [
            ('"after 20 trials ... the Q-values reached their stable values"', stable),
            ('the optimal policy is learned in simulation', optimal),
            ('"goal reaching behavior even if the current position is not clearly known"', driven),
            ('"the robot performs smooth paths" with fuzzy regions', smooth),
            (
                'equation (3) gives the action',
                'only with unit vectors: as printed it averages angles as numbers; see below',
            ),
        ],
    )


def _learning(evidence: Evidence) -> str:
    return (
        'One learning phase is 20 trials of 22 paths without noise; rows that begin with "with" '
        'change one free parameter. `goalreach bench learning` measures its speed.\n\n'
        + tables.rows_table([row for row in evidence.learning if row['unit'] not in _TIMES])
    )


def _driving(evidence: Evidence) -> str:
    return f"""\
One policy (learned without noise), random starts over the free floor and starts at the borders
(0.1 m between body and wall, any heading). Every 22 paths are another robot with its own drawn
errors of odometry, camera and head.

{tables.outcome_table(evidence.driven)}

The same starts for every mode, nominal noise, paths that reached the goal. A heading step is the
change of the commanded heading between two control steps (40 ms), from the moment the robot
leaves its start; before, it stands and turns to its first heading. "Shortest" is the straight line
into the goal region, which no robot that must turn there can beat.

{tables.mode_table(evidence.driven)}"""


def _equation_3(evidence: Evidence) -> str:
    astray = evidence.blends['astray']
    x_m, y_m = astray['at_m']
    worst = f'x = {x_m:.2f} m, y = {y_m:.2f} m ({x_m / INCH_M:.0f}, {y_m / INCH_M:.0f} in)'
    return f"""\
As printed, equation (3) averages headings as numbers: of 315 and 45 deg it makes 180 deg, the
opposite of both. With the policy above it points more than 45 deg away from the same weights with
unit vectors on {astray['percent']:.1f} % of the free floor outside the goal; the worst place is
{worst}, where it says {astray['printed_deg']:.0f} deg and unit vectors say
{astray['unit_deg']:.0f} deg. That is why `fuzzy-as-printed` loses paths. `fuzzy-eq3` takes unit
vectors and keeps the weights, and still jumps where the dominant region changes: its neighbours
vote by column and by row of the dominant cell, so other cells vote on the other side. `fuzzy`
weighs the four cells by the products of their memberships, which are continuous. Driven as a
point without noise, from {evidence.blends['starts']} random starts:

{tables.blend_table(evidence.blends)}"""


def _policies(evidence: Evidence) -> str:
    if not evidence.images:
        return 'Not measured yet.'
    return f"""\
Learned with images: {evidence.policies} phase(s) of {evidence.image_trials} trials, every step
through rendered images, localizer and state estimator with nominal noise; and as many without
noise. All driven fuzzy, with images, from the same starts. The policies are few: the interval
covers the paths, not the luck of learning.

{tables.learned_table(evidence.without, evidence.images)}"""


def _arenas(evidence: Evidence) -> str:
    return (
        'The same commands with `--arena NAME`: learned there without noise, driven fuzzy with '
        'nominal noise from random starts.\n\n' + tables.arena_table(evidence.arenas)
    )


def _parameters() -> str:
    values = flatten_config(ControllerConfig())
    rows = [
        (f'`{name}`', _value(values[name]), info.description)
        for name, info in parameter_infos(ControllerConfig).items()
    ]
    knots = (
        f'Region borders and fuzzy knots are chosen too: x knots {_metres(DEFAULT_X_KNOTS_M)}, '
        f'y knots {_metres(DEFAULT_Y_KNOTS_M)}.'
    )
    return (
        'The paper names them and gives no values but 140 x 200 in, 22 starts and 20 trials. How '
        'much success depends on each parameter of learning is in the section on learning.\n\n'
        + tables.table(('parameter', 'default', 'what it is'), rows)
        + f'\n\n{knots}'
    )


def _value(value: object) -> str:
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def _metres(knots_m: Sequence[float]) -> str:
    return ', '.join(f'{knot_m:.3f}' for knot_m in knots_m) + ' m'
