"""Which arena, and which policy fits it: what `--arena` and `--policy` mean to every command."""

from __future__ import annotations

import argparse
from dataclasses import fields
from importlib import resources
from pathlib import Path

import numpy as np
import yaml

from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import ConfigurationError, FileFormatError, one_line_repr
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.noise import NOISE_PRESETS, NoiseModel, noise_preset
from goalreach_msgs_py.parameters import build_config
from goalreach_msgs_py.regions import region_name


def choose_noise(name: str) -> NoiseModel:
    """Return the preset of that name, or else the noise model of that file.

    Raises:
        FileFormatError: It is neither.
    """
    return noise_preset(name) if name in NOISE_PRESETS else read_noise(name)


def read_noise(path: str | Path) -> NoiseModel:
    """Return the noise model of a file.

    Raises:
        FileFormatError: The file cannot be read, names an unknown field or holds a bad value.
    """
    try:
        content = load_yaml(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        presets = ', '.join(NOISE_PRESETS)
        reason = f'is no preset ({presets}) and cannot be read: {error.strerror}'
        raise FileFormatError(path, reason) from None
    except (yaml.YAMLError, UnicodeDecodeError):
        raise FileFormatError(path, 'is not YAML') from None
    if not isinstance(content, dict):
        raise FileFormatError(path, 'must be a mapping of noise fields to numbers')
    known = {field.name for field in fields(NoiseModel)}
    for name, value in content.items():
        if name not in known:
            raise FileFormatError(
                path, f'{name} = {one_line_repr(value)}: no such field of a noise model'
            )
    try:
        return build_config(NoiseModel, content)
    except ConfigurationError as error:
        raise FileFormatError(path, str(error)) from None


_SUFFIX = '.yaml'


def add_arena_option(parser: argparse.ArgumentParser) -> None:
    """Add `--arena` to a command."""
    text = f'where to drive: {", ".join(arena_names())}, or a YAML file'
    parser.add_argument('--arena', default='paper', metavar='NAME|FILE', help=text)


def arena_names() -> list[str]:
    """Return the names of the arenas that come with the project."""
    return sorted(path.stem for path in _folder().glob(f'*{_SUFFIX}'))


def arena_path(name: str) -> Path:
    """Return the file of an arena that comes with the project.

    Args:
        name: One of `arena_names`.
    """
    return _folder() / f'{name}{_SUFFIX}'


def _folder() -> Path:
    return Path(str(resources.files('goalreach_msgs_py'))) / 'config' / 'arenas'


_SAME_M = 1e-6
"""Knots nearer than this are the same: those of a file are rounded."""


def choose_arena(name: str) -> Arena:
    """Return the arena of that name, or else of that file.

    Raises:
        FileFormatError: It is neither, or the file is not an arena; the line names the field.
    """
    if name in arena_names():
        return read_arena(arena_path(name))
    if not Path(name).exists():
        raise FileFormatError(name, f'is no file and none of {", ".join(arena_names())}')
    return read_arena(name)


def choose_policy(path: Path | None, arena: Arena, seed: int) -> Policy:
    """Return the policy of a file, or learn one for an arena.

    Args:
        path: The file, or None.
        arena: Where it is to drive.
        seed: Seed of the learning phase.

    Raises:
        FileFormatError: The file is no policy, or was learned on other regions.
    """
    if path is None:
        return train(arena, rng=np.random.default_rng(seed)).policy
    return read_policy_for(path, arena)


def read_policy_for(path: Path, arena: Arena) -> Policy:
    """Return the policy of a file that was learned on an arena's regions.

    Raises:
        FileFormatError: The file is no policy, or was learned on other regions.
    """
    policy = read_policy(path)
    _require_same_regions(path, policy, arena)
    return policy


def _require_same_regions(path: Path, policy: Policy, arena: Arena) -> None:
    ours, theirs = arena.regions, policy.regions
    for name in ('x_knots_m', 'y_knots_m'):
        mine, other = np.array(getattr(ours, name)), np.array(getattr(theirs, name))
        if not np.allclose(mine, other, rtol=0.0, atol=_SAME_M):
            knots = ', '.join(f'{knot_m:g}' for knot_m in mine)
            given = ', '.join(f'{knot_m:g}' for knot_m in other)
            reason = f'regions.{name} = [{given}]: the arena {arena.name} has [{knots}]'
            raise FileFormatError(path, reason)
    if theirs.goal != ours.goal:
        here, there = region_name(ours.goal), region_name(theirs.goal)
        raise FileFormatError(path, f'regions.goal = {there}: the arena {arena.name} has {here}')
