"""Which arena, and which policy fits it: what `--arena` and `--policy` mean to every command."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from goalreach_bringup.arena_option import arena_names, arena_path
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.regions import region_name

__all__ = ['choose_arena', 'choose_policy', 'read_policy_for']

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
