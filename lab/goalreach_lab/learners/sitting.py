"""A session: the planner learns over the graph in real time, from nothing."""

from collections.abc import Mapping, Sequence
import functools
from itertools import accumulate
import json
from pathlib import Path
from tempfile import TemporaryDirectory
import time
from typing import Any, Final

import numpy as np

from goalreach_lab.rigs.stack import Stack, free_domains
from goalreach_lab.row import BenchRow
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_lab.template import table
from goalreach_learning.kinematic_drive import greedy_successes
from goalreach_learning.policy_file import read_policy
from goalreach_msgs_py.angles import deg
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError

PATHS: Final = 12
"""Paths of a session: more than 95 % of all need. Chosen."""
_LIMIT_S: Final = 600.0
_POLL_S: Final = 0.2


def sitting_study(*, sittings: int, seed: int) -> Study:
    """Return the study of sessions: images, DDS and real time, starts in random order.

    Args:
        sittings: Number of sessions.
        seed: Seed of everything random.
    """
    return Study(
        name='sitting',
        key=('number',),
        settings={'seed': seed, 'paths': PATHS},
        cases=[{'number': number} for number in range(sittings)],
        measure=per_case(functools.partial(_measure, seed=seed)),
        rows=_rows,
    )


def _measure(case: Case, *, seed: int) -> Result:
    """Let a graph learn, and judge the policy that it writes after every path."""
    number = seed + case['number']
    arena, rng = Arena(), np.random.default_rng(number)
    starts = [arena.starts[index] for index in rng.permutation(len(arena.starts))[:PATHS]]
    places = (f'{s.x_m},{s.y_m},{s.heading_rad / deg(1.0):.6g}' for s in starts)
    with TemporaryDirectory(prefix='goalreach-sitting-') as name:
        policy, summary = Path(name) / 'learned.json', Path(name) / 'summary.json'
        learn = ['--learn', '--learner', 'planner', '--policy', str(policy)]
        run = ['--paths', str(PATHS), '--seed', str(number), '--summary', str(summary)]
        live = ['--clock', 'realtime', '--no-dashboard']
        options = [*learn, *run, *live, *(word for place in places for word in ('--start', place))]
        stack = Stack(options, domain=free_domains(1)[0], log_directory=Path(name))
        try:
            leads = _follow(stack, policy, arena)
        finally:
            stack.stop()
        if not summary.exists():
            raise GoalreachError(f'the session ended: {"; ".join(list(stack.lines)[-1:])}')
        paths = json.loads(summary.read_text())['paths']
    kept = ('outcome', 'duration_s', 'length_m')
    return {
        'paths': [{key: path[key] for key in kept} for path in paths],
        'leads': [leads.get(1 + index, -1) for index in range(len(paths))],
    }


def _follow(stack: Stack, path: Path, arena: Arena) -> dict[int, int]:
    """Return, by number of paths driven, from how many starts the policy led to the goal."""
    leads: dict[int, int] = {}
    deadline_s = time.monotonic() + _LIMIT_S
    while stack.alive and time.monotonic() < deadline_s:
        if path.exists():
            policy = read_policy(path)
            driven = int(policy.learning.get('paths_driven', 0))
            leads[driven] = sum(greedy_successes(arena, policy))
        time.sleep(_POLL_S)
    return leads


def course(result: Result) -> list[tuple[float, int, int]]:
    """Return minutes, bumps and number of starts that lead to the goal after each path."""
    seconds = accumulate(path['duration_s'] for path in result['paths'])
    bumps = accumulate(path['outcome'] == 'bump' for path in result['paths'])
    return [
        (passed_s / 60.0, count, leads)
        for passed_s, count, leads in zip(seconds, bumps, result['leads'], strict=True)
    ]


def learned_after(result: Result) -> int | None:
    """Return the number of paths after which all starts led to the goal, or None."""
    everything = len(Arena().starts)
    return next((n for n, (*_, m) in enumerate(course(result), 1) if m == everything), None)


def _rows(results: Sequence[Result]) -> list[BenchRow]:
    missed = sum(learned_after(one) is None for one in results)
    return [BenchRow.none_allowed('sessions that learned not all starts', missed, n=len(results))]


def sitting_table(results: Sequence[Mapping[str, Any]]) -> str:
    """Return what each session needed."""
    rows = []
    for one in results:
        paths = learned_after(one)
        passed_min, bumps, _ = course(one)[-1 if paths is None else paths - 1]
        needed = ('never', '-', '-') if paths is None else (paths, bumps, f'{passed_min:.1f}')
        rows.append((one['number'] + 1, *needed))
    return table(('session', 'paths until 22 of 22', 'bumps', 'minutes'), rows)
