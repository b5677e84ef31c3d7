"""The obstacles suite: driving among random obstacles, with all behaviours and without.

Beside it drives IR-SIM's robot with IR-SIM's own avoidance, where IR-SIM is installed; and all
behaviours drive in the MuJoCo world, which shares no code with ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
import math
from pathlib import Path
import time
from typing import Any, Final

import numpy as np

from goalreach_evaluation.drive import InProcessDrive, surroundings
from goalreach_evaluation.path_metrics import wilson_interval
from goalreach_lab.behaviors.irsim_driver import drive_irsim
from goalreach_lab.behaviors.mujoco_driver import drive_mujoco
from goalreach_lab.behaviors.random_arenas import random_arena, shortest_way_m
from goalreach_lab.options import StudyOptions
from goalreach_lab.rigs.random_drives import is_irsim_installed
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, per_case, run_study
from goalreach_learning.controller import GoalReachingController
from goalreach_learning.controller_config import ControllerConfig
from goalreach_learning.policy_file import read_policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import noise_preset
from goalreach_msgs_py.options import option

SUMMARY = 'Drive among random obstacles, with all behaviours and with goal-reaching alone'

ALL: Final = 'first(escape, blend(avoid, patience, goal))'
DRIVERS: Final = {'behaviours': ALL, 'goal alone': 'goal'}
IRSIM: Final = 'IR-SIM'
MUJOCO: Final = 'MuJoCo'
_LEAST_GOALS: Final = {'behaviours': 99.0, MUJOCO: 97.0}
"""Percentage of goals asked for, by driver; the others are not judged."""
_TIMEOUT_S: Final = 120.0
"""Twice that of an empty arena: detours are long. Chosen."""
_TRACE: Final = 10
_CROWDED: Final = 6
"""Paths among so many obstacles are drawn first."""
_TIMED: Final = 10
"""Arenas in which the cost of a frame is measured."""


@dataclass(frozen=True, kw_only=True)
class Options(StudyOptions):
    """Options of the suite."""

    arenas: int = option(1000, 'number of random arenas, one path in each', minimum=1)
    peer_arenas: int = option(100, 'of these, how many IR-SIM drives in, if installed', minimum=0)
    mujoco_arenas: int = option(
        100, 'of these, how many in the MuJoCo world, if installed', minimum=0
    )
    figures: Path | None = option(None, 'folder for the figure of ten paths', metavar='DIR')


def execute(options: Options) -> list[BenchRow]:
    """Drive what is not driven yet; return the rows, and draw ten paths if asked to.

    Raises:
        GoalreachError: A file cannot be read or written.
    """
    peers = options.peer_arenas if is_irsim_installed() else 0
    mujoco = options.mujoco_arenas if find_spec('mujoco') else 0
    most = dict.fromkeys(DRIVERS, options.arenas) | {IRSIM: peers, MUJOCO: mujoco}
    cases = [
        {'driver': driver, 'arena': options.seed * 100_000 + number}
        for number in range(options.arenas)
        for driver, arenas in most.items()
        if number < arenas
    ]
    study = Study(
        name='obstacles',
        key=('driver', 'arena'),
        cases=cases,
        measure=per_case(drive_arena, jobs=options.jobs),
        settings={'timeout_s': _TIMEOUT_S, 'behaviours': ALL, 'noise': 'nominal'},
    )
    results = run_study(study, options.results, measure=not options.as_it_is)
    if options.figures is not None:
        ours = [one for one in results if one['driver'] == 'behaviours']
        ours.sort(key=lambda one: one['obstacles'] < _CROWDED)  # keeps the order otherwise
        _draw(ours[:_TRACE], options.figures)
    rows = [row for driver in most for row in rows_of(driver, results)]
    return rows if options.as_it_is else [*rows, frame_cost(options.seed * 100_000)]


def drive_arena(case: Case) -> Result:
    """Drive one path with images and nominal noise in the loop; the truth judges it."""
    arena = random_arena(case['arena'])
    start = arena.starts[0]
    about = {
        'shortest_m': shortest_way_m(arena, start),
        'obstacles': len(arena.obstacles),
        'moving': sum(bool(one.track_m) for one in arena.obstacles),
    }
    if case['driver'] == IRSIM:
        return {**drive_irsim(arena, start, _TIMEOUT_S), **about}
    if case['driver'] == MUJOCO:
        return {**drive_mujoco(arena, ALL, _TIMEOUT_S, case['arena']), **about}
    drive = _in_process(arena, DRIVERS[case['driver']], case['arena'])
    pressed, bumps, result = False, 0, None
    for frame in drive.drive_frames(start):
        bumps += any(frame.sensors.bumpers) and not pressed
        pressed, result = any(frame.sensors.bumpers), frame.result
    assert result is not None  # noqa: S101 - the last frame has it
    return {
        'outcome': result.outcome,
        'bumps': int(bumps),
        'ends_pressed': pressed,
        'duration_s': result.duration_s,
        'length_m': result.length_m,
        'trace': [list(point) for point in result.trace],
        **about,
    }


def _in_process(arena: Arena, behaviors: str, seed: int) -> InProcessDrive:
    return InProcessDrive(
        arena=arena,
        noise=noise_preset('nominal'),
        policy=read_policy('paper'),
        controller=ControllerConfig(behaviors=behaviors, timeout_s=_TIMEOUT_S),
        seed=np.random.SeedSequence(seed),
    )


def _controller(behaviors: str, arena: Arena) -> GoalReachingController:
    """Return a controller at the beginning of the arena's path."""
    config = ControllerConfig(behaviors=behaviors, timeout_s=_TIMEOUT_S)
    controller = GoalReachingController(config, read_policy('paper'), np.random.default_rng(0))
    controller.begin_path(start=arena.starts[0], path=0, trial=0)
    return controller


def frame_cost(first_arena: int, arenas: int = _TIMED) -> BenchRow:
    """Measure the processor time of a frame with all behaviours over that of one without.

    Two more controllers, with all behaviours and with goal-reaching alone, answer every frame of a
    drive in turns. The difference of their times is what the behaviours add to the frame.
    """
    frame_s, answer_s, frames = 0.0, dict.fromkeys(DRIVERS, 0.0), 0
    for number in range(first_arena, first_arena + arenas):
        arena = random_arena(number)
        drive = _in_process(arena, ALL, number)
        answering = {name: _controller(text, arena) for name, text in DRIVERS.items()}
        before_s = time.thread_time()
        for frame in drive.drive_frames(arena.starts[0]):
            frame_s += time.thread_time() - before_s
            frames += 1
            for name in sorted(answering, reverse=frames % 2 == 0):
                before_s = time.thread_time()
                answering[name].step(
                    time_ns=frame.sensors.time_ns,
                    state=frame.state,
                    bumped=any(frame.sensors.bumpers),
                    around=surroundings(frame.sensors),
                )
                answer_s[name] += time.thread_time() - before_s
            before_s = time.thread_time()
    added_s = answer_s['behaviours'] - answer_s['goal alone']
    return BenchRow(
        name='a frame with all behaviours over one without',
        unit='',
        ours=frame_s / (frame_s - added_s),
        goal=Goal(of='ours', relation='<=', bound=1.2),
        n=frames,
        note=f'{1e6 * added_s / frames:.0f} us more',
    )


def rows_of(driver: str, results: Sequence[Result]) -> list[BenchRow]:
    """Return the rows of a driver; those of all behaviours are judged."""
    paths = [one for one in results if one['driver'] == driver]
    if not paths:
        return []
    n, least = len(paths), _LEAST_GOALS.get(driver)
    goals = sum(one['outcome'] == 'goal' for one in paths)
    bumped = sum(one['bumps'] > 0 for one in paths)
    caught = sum(one['bumps'] > 0 and one['ends_pressed'] for one in paths)
    wrong = sum(one['outcome'] == 'false-goal' for one in paths)
    ratios = [p['length_m'] / p['shortest_m'] for p in paths if p['outcome'] == 'goal']
    low, high = wilson_interval(goals, n)

    def row(name: str, ours: float, goal: Goal | None, note: str = '') -> BenchRow:
        goal = goal if least else None
        return BenchRow(name=f'{driver}: {name}', unit='%', ours=ours, goal=goal, n=n, note=note)

    most = Goal(of='ours', relation='<=', bound=1.0)
    return [
        row(
            'paths that reach the goal',
            100.0 * goals / n,
            Goal(of='ours', relation='>=', bound=least or 0.0),
            f'95 % interval {100 * low:.1f} to {100 * high:.1f}',
        ),
        row('paths with a bump', 100.0 * bumped / n, most),
        row('paths that end pressed', 100.0 * caught / n, Goal(of='ours', relation='<=', bound=0)),
        row('false goals', 100.0 * wrong / n, Goal(of='ours', relation='<=', bound=0)),
        BenchRow(
            name=f'{driver}: length over the shortest way',
            unit='',
            ours=float(np.median(ratios)) if ratios else math.nan,
            n=len(ratios),
            note=f'mean {np.mean(ratios):.2f}' if ratios else '',
        ),
    ]


def _draw(paths: Sequence[Result], folder: Path) -> None:
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Rectangle

    from goalreach_evaluation.figures.figure_file import write_figure

    figure = Figure(figsize=(12.0, 7.6), layout='constrained')
    for axes, path in zip(figure.subplots(2, 5).flat, paths, strict=False):
        arena = random_arena(path['arena'])
        x0_m, y0_m, x1_m, y1_m = arena.regions.bounds(arena.regions.goal)
        look: dict[str, Any] = {'color': '#cfe8df', 'label': 'goal region'}
        axes.add_patch(Rectangle((x0_m, y0_m), x1_m - x0_m, y1_m - y0_m, **look))
        for one in arena.obstacles:
            look = {'fc': '#8d7b68b0', 'ec': 'black', 'label': 'obstacle'}
            if one.track_m:
                look |= {'fc': '#d8c3a5b0', 'label': 'moving obstacle'}
                track = np.array([(one.x_m, one.y_m), *one.track_m])
                axes.plot(*track.T, ':', color='#b08050', label='track')
            corner = (one.x_m - one.length_m / 2, one.y_m - one.width_m / 2)
            look |= {} if one.radius_m else {'angle': math.degrees(one.heading_rad)}
            axes.add_patch(
                Circle((one.x_m, one.y_m), one.radius_m, **look)
                if one.radius_m
                else Rectangle(corner, one.length_m, one.width_m, rotation_point='center', **look)
            )
        axes.plot(*np.array(path['trace']).T, color='#0072b2', label='path')
        axes.plot(*path['trace'][0], 'o', color='#0072b2', label='start')
        axes.set(xlim=(0, arena.width_m), ylim=(0, arena.length_m), aspect='equal')
        bumps = f', {path["bumps"]} bump(s)' if path['bumps'] else ''
        title = f'seed {path["arena"]}: {path["outcome"]}{bumps}, {path["duration_s"]:.0f} s'
        axes.set_title(title, fontsize=10)
    figure.supxlabel('x (m)')
    figure.supylabel('y (m)')
    artists = [one for axes in figure.axes for one in axes.get_legend_handles_labels()[0]]
    named = {str(one.get_label()): one for one in artists}
    figure.legend(named.values(), named, loc='outside upper center', ncols=len(named))
    write_figure(figure, folder, 'obstacles')
