"""The paths of an evaluation file, for drawing."""

from __future__ import annotations

from dataclasses import dataclass
import json
from pathlib import Path
from typing import Any

import numpy as np

from goalreach_msgs_py.errors import FileFormatError, one_line_repr
from goalreach_msgs_py.values import FloatArray

_OUTCOMES = ('goal', 'false-goal', 'bump', 'timeout')


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedPath:
    """One driven path.

    Attributes:
        points_m: True positions (n, 2) in `map`, metres.
        outcome: 'goal', 'false-goal', 'bump' or 'timeout', judged by the truth.
    """

    points_m: FloatArray
    outcome: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """What an evaluation file tells about its paths.

    Attributes:
        mode: How the policy was driven.
        paths: The paths that were traced.
        origin: Seed and noise in words, for a caption; empty where the file does not tell.
    """

    mode: str
    paths: tuple[RecordedPath, ...]
    origin: str = ''


def read_evaluation(path: Path | str) -> Evaluation:
    """Return the traced paths of a file written by `evaluate --json` or `run --summary`.

    Args:
        path: The file.

    Raises:
        FileFormatError: The file cannot be read, is not such a file, or holds no traced path.
    """
    try:
        document = json.loads(Path(path).read_text(encoding='utf-8'))
    except OSError as error:
        raise FileFormatError(path, f'cannot be read: {error.strerror}') from None
    except (ValueError, RecursionError) as error:
        raise FileFormatError(path, f'is not JSON: {error}') from None
    if not isinstance(document, dict) or not isinstance(document.get('paths'), list):
        raise FileFormatError(path, 'paths is missing: must be a list of paths')
    paths = [_path(path, f'paths[{k}]', entry) for k, entry in enumerate(document['paths'])]
    traced = tuple(found for found in paths if found is not None)
    if not traced:
        raise FileFormatError(path, 'paths: none has a trace to draw')
    return Evaluation(mode=str(document.get('mode', '')), paths=traced, origin=_origin(document))


def _origin(document: dict[str, Any]) -> str:
    config = document.get('config')
    noise = config.get('noise') if isinstance(config, dict) else None
    words = [f'{noise} noise'] if isinstance(noise, str) else []
    seed = document.get('seed')
    return ', '.join([*words, f'seed {seed}'] if isinstance(seed, int) else words)


def _path(file: Path | str, place: str, entry: Any) -> RecordedPath | None:  # noqa: ANN401 - JSON
    if not isinstance(entry, dict):
        raise FileFormatError(file, f'{place} = {one_line_repr(entry)}: must be an object')
    outcome = entry.get('outcome')
    if outcome not in _OUTCOMES:
        allowed = ', '.join(_OUTCOMES)
        raise FileFormatError(
            file, f'{place}.outcome = {one_line_repr(outcome)}: must be one of {allowed}'
        )
    trace = entry.get('trace')
    if not trace:
        return None
    try:
        points = np.array(trace, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():  # noqa: PLR2004
        raise FileFormatError(file, f'{place}.trace: must be a list of [x_m, y_m]')
    return RecordedPath(points_m=points, outcome=outcome)
