"""The summary of a run or an evaluation, as one JSON object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import contextlib
import json
from pathlib import Path
from typing import Any

from goalreach_evaluation.path_metrics import PathResult
from goalreach_msgs_py.errors import FileFormatError
from goalreach_msgs_py.files import write_text_atomically


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


def append_line(path: Path, values: Mapping[str, object]) -> None:
    """Append values to a file as one line of JSON.

    Raises:
        FileFormatError: It cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open('a', encoding='utf-8') as stream:
            stream.write(json.dumps(dict(values)) + '\n')
    except OSError as error:
        raise FileFormatError(path, f'cannot be written: {error.strerror}') from None


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the lines of such a file; none where it is not there, whole ones only."""
    lines = []
    if path.exists():
        for line in path.read_text(encoding='utf-8', errors='replace').splitlines():
            with contextlib.suppress(ValueError):
                lines.append(json.loads(line))
    return lines
