"""Arena, noise and policy by name, by file or as an object: the values that options take."""

from dataclasses import fields
from importlib import resources
import os
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_learning.learner import LEARNERS
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import policy_names, read_policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, one_line_repr
from goalreach_msgs_py.files import read_yaml
from goalreach_msgs_py.noise import NOISE_PRESETS, NoiseModel, noise_preset
from goalreach_msgs_py.options import option
from goalreach_msgs_py.parameters import build_config

ARENAS = Path(str(resources.files('goalreach_msgs_py'))) / 'config' / 'arenas'
"""Folder of the arenas that come with the project."""
_KNOT_TOLERANCE_M = 1e-6
"""Knots in files are rounded; a smaller difference is no difference. Chosen."""


def arena_option() -> Any:  # noqa: ANN401 - what dataclasses.field itself returns
    """Return the option `--arena` of a command, a text."""
    text = f'arena to drive in: {", ".join(arena_names())}, or a YAML file'
    return option('paper', text, metavar='NAME|FILE', names=tuple(arena_names()))


def policy_option() -> Any:  # noqa: ANN401 - what dataclasses.field itself returns
    """Return the option `--policy` of a command that reads a policy, a text or None."""
    text = f'policy to drive: {", ".join(policy_names())}, or a file; without it, learns one first'
    return option(None, text, metavar='NAME|FILE', names=tuple(policy_names()))


def learner_option(default: str | None = 'paper') -> Any:  # noqa: ANN401 - as above
    """Return the option `--learner` of a command."""
    return option(
        default, f'who learns: {", ".join(LEARNERS)}, or a class', metavar='NAME|MODULE:CLASS'
    )


def arena_names() -> list[str]:
    """Return the names of the arenas that come with the project."""
    return sorted(path.stem for path in ARENAS.glob('*.yaml'))


def choose_arena(arena: Arena | Path | str) -> Arena:
    """Return an arena given by name, by file or as an object.

    Raises:
        FileFormatError: It is no known name and no file, or the file does not describe an arena.
    """
    if isinstance(arena, Arena):
        return arena
    if arena in arena_names():
        return read_arena(ARENAS / f'{arena}.yaml')
    if not os.path.exists(arena):  # noqa: PTH110 - False for a name that no file can have
        raise FileFormatError(arena, f'is no file and none of {", ".join(arena_names())}')
    return read_arena(arena)


def choose_noise(noise: NoiseModel | Path | str) -> NoiseModel:
    """Return a noise model given by the name of a preset, by file or as an object.

    A file is YAML and maps fields of the model to numbers.

    Raises:
        FileFormatError: It is no preset, and the file cannot be read, names an unknown field or
            holds a bad value.
    """
    if isinstance(noise, NoiseModel):
        return noise
    if noise in NOISE_PRESETS:
        return noise_preset(str(noise))
    try:
        content = read_yaml(noise)
    except FileFormatError as error:
        presets = ', '.join(NOISE_PRESETS)
        raise FileFormatError(noise, f'is no preset ({presets}) and {error.reason}') from None
    if not isinstance(content, dict):
        raise FileFormatError(noise, 'must be a mapping of noise fields to numbers')
    known = {field.name for field in fields(NoiseModel)}
    for name, value in content.items():
        if name not in known:
            reason = f'{name} = {one_line_repr(value)}: no such field of a noise model'
            raise FileFormatError(noise, reason)
    try:
        return build_config(NoiseModel, content)
    except ConfigurationError as error:
        raise FileFormatError(noise, str(error)) from None


def choose_policy(policy: Policy | Path | str | None, arena: Arena, seed: int = 0) -> Policy:
    """Return a policy given by name, by file or as an object; None: learn one for the arena.

    Raises:
        FileFormatError: The file is not a policy, or it was learned on other regions.
    """
    if policy is None:
        return train(arena, rng=np.random.default_rng(seed)).policy
    if isinstance(policy, Policy):
        chosen, name = policy, 'policy'
    else:
        chosen, name = read_policy(policy), str(policy)
    if difference := _region_difference(chosen, arena):
        raise FileFormatError(name, difference)
    return chosen


def _region_difference(policy: Policy, arena: Arena) -> str:
    """Return how a policy's regions differ from the arena's; empty if they do not."""
    for name in ('x_knots_m', 'y_knots_m'):
        expected, found = (getattr(regions, name) for regions in (arena.regions, policy.regions))
        if len(expected) != len(found) or not np.allclose(
            expected, found, rtol=0.0, atol=_KNOT_TOLERANCE_M
        ):
            given, knots = (', '.join(f'{knot_m:g}' for knot_m in k) for k in (found, expected))
            return f'regions.{name} = [{given}]: the arena {arena.name} has [{knots}]'
    for name in ('goal', 'forbidden', 'actions'):
        expected, found = (getattr(r, name) for r in (arena.regions, policy.regions))
        if expected != found:
            if name == 'goal':
                expected, found = map(arena.regions.name, (expected, found))
            return f'regions.{name} = {found}: the arena {arena.name} has {expected}'
    return ''
