"""The `bench` command of an installed goalreach: says where the benchmarks are."""

from goalreach_bringup.command import VerbatimOptions as Options
from goalreach_msgs_py.errors import GoalreachError

SUMMARY = 'Benchmarks and studies of goalreach itself; only in a clone of the source'


def execute(options: Options) -> int:  # noqa: ARG001 - every command has them
    """Refuse.

    Raises:
        GoalreachError: Always.
    """
    raise GoalreachError(
        'the benchmarks come with the source: clone the repository, then run '
        '`python3 scripts/bench.py` there'
    )
