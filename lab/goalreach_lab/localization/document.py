"""docs/LOCALIZATION.md: how well the robot knows where it is, measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
import os
from pathlib import Path
import platform
from typing import Any, Final

from goalreach_lab.localization.figures import FIGURES
from goalreach_lab.localization.frame_log import FAR_NEES, WRONG_IN
from goalreach_lab.report import goals_met
from goalreach_lab.reproduction.tables import table
from goalreach_lab.row import BenchRow
from goalreach_msgs_py.files import write_text_atomically

_SECTIONS: Final = {
    'bound': (
        'One image beside the bound',
        """\
Exact pixels of three LEDs with normal noise and nothing else wrong, over a grid of the floor:
everywhere the head can hold all three in one image. The Cramer-Rao bound is the least error
that any unbiased estimator can have. The solver is the one that acquires: Gauss-Newton on
pixels from a closed-form seed.""",
    ),
    'noise': (
        'Over the size of all errors',
        """\
Robots wander between random places for a minute, by what they see. All errors of the noise
model are scaled together: pixels, encoders, biases, survey, focal length, height of the
camera, odometry, dropouts, spurious lights.""",
    ),
    'drives': (
        'Driving to the goal',
        f"""\
From the paper's 22 starts and from random ones, fuzzy policy, every step through rendered
images. Errors count while the pose is published as good. A belief is wrong where the pose is
more than {WRONG_IN:g} in off or its error is outside its own covariance (NEES above
{FAR_NEES:g}, which an honest one exceeds once in a million images). Robots that calibrate
themselves wander for ten minutes; then two minutes are measured.""",
    ),
    'consistency': (
        'Honest covariances',
        """\
Every run has another robot and another set-up, with its own drawn constant errors. The
normalized estimation error squared (NEES) of x, y and heading, averaged over the runs at each
time step, against the chi-square band for that many runs; the innovations (NIS) likewise, for
each degree of freedom. Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to
Tracking and Navigation", section 5.4. The localizer calibrates itself unless told otherwise; a
filter that does not is shown beside. The NIS of a filter that calibrates itself is low on
purpose: the error of a spot is taken larger than it is, since what is wrong about it repeats
from image to image and does not average out.""",
    ),
    'kidnap': (
        'Kidnapped',
        """\
The robot is put at a random pose between two images. No encoder counts and no joint moves, so
nothing tells it but what it sees. Found is a robot whose pose is right, and said to be good, for
a second on end. Where no LED was expected just before, nothing contradicts the old pose at
once: it is believed for two seconds at most.""",
    ),
    'long': (
        'A day of driving',
        """\
One robot wanders on and on by what it sees. Odometry begins at the true pose and is never
corrected. Its region is wrong where its position lies in another of the nine regions than the
true one.""",
    ),
    'inputs': (
        'Inputs that tell nothing',
        """\
Each takes the place of 40 images (1.6 s) of a robot that tracks. What cannot be a message of
the right kind is refused by the conversion in the node.""",
    ),
    'speed': (
        'Speed, beside other ways',
        """\
Processor time on one core, all ways in turn on the same images, each holding all three LEDs.
Ours is the whole of the localizer: detection, identity, filter, head. The others are told
which light is which LED, and P3P which of its solutions is the right one.""",
    ),
}


def write_document(
    path: Path,
    rows: Mapping[str, Sequence[BenchRow]],
    results: Mapping[str, Mapping[str, Any]],
    *,
    seed: int,
    figures: Path | None,
) -> None:
    """Write the document.

    Args:
        path: The file.
        rows: By part.
        results: By part.
        seed: Of all of it.
        figures: Where the pictures are, or None to leave them out.

    Raises:
        FileFormatError: It cannot be written.
    """
    parts = [_introduction(seed), goals_met(chain.from_iterable(rows.values()))]
    for part, (title, text) in _SECTIONS.items():
        if part in rows:
            command = f'`goalreach bench --seed {seed} localization --full --part {part}`'
            parts += [f'## {title}', f'{text}\n\n{command}', _table(rows[part])]
            parts += _extras(part, results[part])
            parts += _pictures(part, path, figures)
    write_text_atomically(path, '\n\n'.join(parts) + '\n')


def _introduction(seed: int) -> str:
    return f"""# Localisation, measured

Written by `goalreach bench --seed {seed} localization --full --results DIR --figures docs/figures
--out docs/LOCALIZATION.md`; every number and picture comes from that command. Parts can be
measured one after the other (`--part`), and what is in DIR is not measured again. Robot, camera
and room are simulated; the errors are those of the nominal noise model unless said otherwise,
drawn anew for every robot. Measured on {platform.machine()} with Python
{platform.python_version()}. 1 in = 0.0254 m."""


def _value(row: BenchRow) -> str:
    return f'{row.ours:.3g} {row.unit}'.strip()


def _table(rows: Sequence[BenchRow]) -> str:
    cells = []
    for row in rows:
        beside = '' if row.reference is None else f'{row.reference:.3g} ({row.reference_name})'
        met = {True: 'yes', False: 'no', None: ''}[row.met]
        aim = '' if row.goal is None else row.goal
        cells.append((row.name, _value(row), beside, aim, met, row.n, row.note))
    return table(('what', 'measured', 'beside', 'aim', 'met', 'n', 'more'), cells)


def _extras(part: str, result: Mapping[str, Any]) -> list[str]:
    """Return what a part tells beside its rows."""
    if part != 'inputs':
        return []
    cases = [(name, case['said']) for name, case in result['cases'].items()]
    cases += list(result['messages'].items())
    return [table(('input', 'what is said'), cases)]


def _pictures(part: str, path: Path, folder: Path | None) -> list[str]:
    if folder is None:
        return []
    names = [name for name, (drawn, _) in FIGURES.items() if drawn == part]
    place = os.path.relpath(folder, path.parent)
    return [f'![{name.replace("_", " ")}]({place}/{name}.png)' for name in names]
