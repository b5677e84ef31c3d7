"""Readers of parameters and options, fed with bad ones."""

import contextlib
import io
from typing import Any, Final

import numpy as np

from goalreach_bringup.command import Command
from goalreach_bringup.commands import run
from goalreach_bringup.launch.options import parse_start
from goalreach_bringup.launch.plan import choose_starts, plan_parameters
from goalreach_lab.fuzz.mutation import NASTY, mutate_value, nasty
from goalreach_lab.fuzz.reader import Reader, require_finite
from goalreach_learning.controller_config import ControllerConfig, MissionConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.parameters import build_config, flatten_config
from goalreach_msgs_py.regions import RegionConfig
from goalreach_msgs_py.topics import NODES
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.state_estimator import StateEstimatorConfig
from goalreach_sim.simulator_config import FaultParameters, SimulatorConfig, TimeConfig

_CLASSES: Final[tuple[type[object], ...]] = (
    SimulatorConfig, TimeConfig, RegionConfig, FaultParameters, LocalizerConfig,
    StateEstimatorConfig, ControllerConfig, MissionConfig,
)  # fmt: skip
_WORDS: Final = (
    '--policy', '--mode', '--paths', '--arena', '--starts', '--start', '--clock', '--speed',
    '--noise', '--learn', '--record', '--storage', '--composed', '--params-file', '--summary',
    '--quiet', '--remap', '--seed', '--help-me', '--', '-x',
)  # fmt: skip
_VALUES: Final = (
    'fuzzy', 'crisp', 'random', 'paper', 'lockstep', 'realtime', 'nominal', 'mcap', '1', '-1', '0',
    '1e999', 'nan', 'inf', '99999999999999999999', '1.5', '', ' ', '1,2,3', '1,2', 'nan,1,2',
    '1e400,1,1', '0.6,4.5,-90', 'a:=b', '\u202e', '\0', '/', '..', 'x' * 5000,
)  # fmt: skip


class _RefusedError(GoalreachError):
    """The parser of the command line refused its arguments."""


def configuration_readers() -> list[Reader]:
    """Return the readers of node parameters, of the parameters of a run, and of options."""
    return [
        Reader(name='node parameters', attempt=_node_parameters),
        Reader(name='parameters of a run', attempt=_run_parameters),
        Reader(name='options of run', attempt=_options),
        Reader(name='--start', attempt=_start),
    ]


def _node_parameters(rng: np.random.Generator) -> object:
    cls = _CLASSES[rng.integers(len(_CLASSES))]
    values = flatten_config(cls())
    for _ in range(int(rng.integers(1, 3))):
        name = list(values)[rng.integers(len(values))]
        values[name] = mutate_value(values[name], rng)
    config = build_config(cls, values)
    require_finite(config, cls.__name__)
    return config


def _run_parameters(rng: np.random.Generator) -> object:
    """Plan a run with a parameter file that holds arbitrary values."""
    arena, options = Arena(), run.Options(seed=int(rng.integers(2**31)))
    starts = choose_starts(options, arena)
    valid = plan_parameters(options, arena=arena, starts=starts, policy_path='p', user={})
    node = NODES[rng.integers(len(NODES))]
    names = [*valid[node], 'no_such_parameter']
    user = {node: {names[rng.integers(len(names))]: nasty(rng) for _ in range(2)}}
    parameters = plan_parameters(options, arena=arena, starts=starts, policy_path='p', user=user)
    require_finite(parameters, 'parameters')
    return parameters


def _parse(words: list[str]) -> Any:
    output = io.StringIO()
    try:
        with contextlib.redirect_stderr(output), contextlib.redirect_stdout(output):
            _, options = Command.of_module(run).parse('goalreach run', words)
            return options
    except SystemExit:
        usage, _, reason = output.getvalue().rpartition(': error: ')
        if not usage.startswith('usage: '):
            raise AssertionError(f'no usage: {usage[:200]!r}') from None
        raise _RefusedError(reason.removesuffix('\n')) from None


def _options(rng: np.random.Generator) -> object:
    words: list[str] = []
    for _ in range(int(rng.integers(1, 6))):
        words.append(_WORDS[rng.integers(len(_WORDS))])
        if rng.random() < 0.8:  # noqa: PLR2004
            words.append(_VALUES[rng.integers(len(_VALUES))])
    options = _parse(words)
    require_finite(options.start_poses, 'start')
    return options


def _start(rng: np.random.Generator) -> object:
    numbers = [str(NASTY[rng.integers(len(NASTY))]) for _ in range(int(rng.integers(1, 5)))]
    pose = parse_start(','.join(numbers))
    require_finite(pose, 'start')
    return pose
