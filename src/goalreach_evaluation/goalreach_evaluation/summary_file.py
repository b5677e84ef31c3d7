"""The summary of a run or an evaluation, as one JSON object."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_evaluation.path_metrics import OUTCOMES, PathResult
from goalreach_msgs_py.errors import FileFormatError, one_line_repr
from goalreach_msgs_py.files import read_json, write_text_atomically
from goalreach_msgs_py.values import FloatArray


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
    """Return the summary of paths, in the order driven, as JSON-ready values.

    The policy is named by its file, 'learned' or 'in memory'; the configuration is JSON-ready.
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


RecordedPath = tuple[FloatArray, str]
"""True positions (n, 2) in `map`, metres, of a driven path, and its outcome, one of `OUTCOMES`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedRun:
    """The part of a summary that figures are drawn from.

    Attributes:
        mode: How the heading was chosen.
        paths: The paths that have a trace.
        origin: Noise and seed, for a caption; empty if the summary lacks them.
    """

    mode: str
    paths: tuple[RecordedPath, ...]
    origin: str = ''


def read_recorded_run(path: Path | str) -> RecordedRun:
    """Read the traced paths of a file written by `evaluate --json` or `run --summary`.

    Raises:
        FileFormatError: The file cannot be read, is not such a file, or has no traced path.
    """
    return recorded_run(read_json(path), path)


def recorded_run(document: object, name: object = 'summary') -> RecordedRun:
    """Return the traced paths of a summary of JSON-ready values; messages name its file.

    Raises:
        FileFormatError: It is not a summary, or has no traced path.
    """
    if not isinstance(document, dict) or not isinstance(document.get('paths'), list):
        raise FileFormatError(name, 'paths is missing: must be a list of paths')
    paths = [_path(name, f'paths[{k}]', entry) for k, entry in enumerate(document['paths'])]
    traced = tuple(path for path in paths if path is not None)
    if not traced:
        raise FileFormatError(name, 'paths: none has a trace to draw')
    return RecordedRun(mode=str(document.get('mode', '')), paths=traced, origin=_origin(document))


def _origin(document: Mapping[str, Any]) -> str:
    config = document.get('config')
    noise = config.get('noise') if isinstance(config, dict) else None
    words = [f'{noise} noise'] if isinstance(noise, str) else []
    seed = document.get('seed')
    return ', '.join([*words, f'seed {seed}'] if isinstance(seed, int) else words)


def _path(name: object, place: str, entry: object) -> RecordedPath | None:
    if not isinstance(entry, dict):
        raise FileFormatError(name, f'{place} = {one_line_repr(entry)}: must be an object')
    outcome = entry.get('outcome')
    if outcome not in OUTCOMES:
        given = one_line_repr(outcome)
        reason = f'{place}.outcome = {given}: must be one of {", ".join(OUTCOMES)}'
        raise FileFormatError(name, reason)
    if not entry.get('trace'):
        return None
    try:
        points_m = np.array(entry['trace'], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points_m = np.empty(0)
    if points_m.ndim != 2 or points_m.shape[1] != 2 or not np.isfinite(points_m).all():  # noqa: PLR2004
        raise FileFormatError(name, f'{place}.trace: must be a list of [x_m, y_m]')
    return points_m, outcome
