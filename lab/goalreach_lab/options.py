"""Options that every benchmark suite takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from goalreach_msgs_py.options import SeededOptions, option


@dataclass(frozen=True, kw_only=True)
class BenchOptions(SeededOptions):
    """Base class of the options of a suite."""

    json: Path | None = option(None, 'write the rows as JSON', metavar='FILE')
