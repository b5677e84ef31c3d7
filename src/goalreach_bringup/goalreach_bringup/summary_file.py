"""The summary of a run or an evaluation, as one JSON object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
from typing import Any

from goalreach_bringup.path_metrics import PathResult
from goalreach_msgs_py.atomic_file import write_text_atomically

__all__ = ['summarise', 'write_summary']


def summarise(
    results: Sequence[PathResult],
    *,
    seed: int,
    mode: str,
    policy: str,
    sim_time_s: float,
    wall_time_s: float,
    config: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the summary of paths as JSON-ready values.

    Args:
        results: The paths in the order driven.
        seed: Seed of the run.
        mode: How the policy was driven.
        policy: Where the policy came from: a file, or 'learned'.
        sim_time_s: Simulated seconds.
        wall_time_s: Seconds on the wall clock.
        config: The configuration used, JSON-ready.
    """
    goals = sum(result.outcome == 'goal' for result in results)
    return {
        'seed': seed,
        'mode': mode,
        'policy': policy,
        'paths': [result.to_json() for result in results],
        'success_rate': goals / len(results) if results else 0.0,
        'sim_time_s': sim_time_s,
        'wall_time_s': wall_time_s,
        'real_time_factor': sim_time_s / wall_time_s if wall_time_s > 0 else 0.0,
        'config': dict(config),
    }


def write_summary(path: str | Path, summary: Mapping[str, Any]) -> None:
    """Write a summary, whole or not at all.

    Raises:
        FileFormatError: The file cannot be written.
    """
    write_text_atomically(path, json.dumps(summary, indent=1) + '\n')
