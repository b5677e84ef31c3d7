"""The `bag` command: inspects a bag without a graph."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from goalreach_bringup.command import Command
from goalreach_msgs_py.options import REQUIRED, CommandOptions, option

SUMMARY = 'Inspect a bag: info, plot, compare'


@dataclass(frozen=True, kw_only=True)
class BagOptions(CommandOptions):
    """The bag that a sub-command reads."""

    bag: Path = option(REQUIRED, 'the bag', positional=True, metavar='DIR')


@dataclass(frozen=True, kw_only=True)
class InfoOptions(BagOptions):
    """Options of `bag info`."""

    check: bool | None = option(
        None, 'read all of the bag, check sums included (default: up to 256 MB)'
    )


@dataclass(frozen=True, kw_only=True)
class PlotOptions(BagOptions):
    """Options of `bag plot`."""

    out: Path | None = option(None, 'folder for the files (default: DIR-figures)', metavar='DIR')


@dataclass(frozen=True, kw_only=True)
class CompareOptions(CommandOptions):
    """Options of `bag compare`."""

    bag: Path = option(REQUIRED, 'first bag', positional=True, metavar='A')
    other: Path = option(REQUIRED, 'second bag', positional=True, metavar='B')
    topics: tuple[str, ...] = option((), 'compare only these', metavar='NAME')
    exclude: tuple[str, ...] = option(
        (), 'topics to leave out; repeatable (default: /rosout and /parameter_events)',
        metavar='PATTERN', repeatable=True,
    )  # fmt: skip
    ignore_times: bool = option(False, 'compare the messages, not their times')


def _info(options: InfoOptions) -> int:
    from goalreach_bags.reader import BagReader
    from goalreach_bags.report import show_bag

    with BagReader(options.bag) as bag:
        show_bag(bag, check=options.check)
    return 0


def _plot(options: PlotOptions) -> int:
    from goalreach_bags.reader import BagReader
    from goalreach_bags.run_figures import read_run_series, run_figures
    from goalreach_evaluation.figures.figure_file import write_figure

    with BagReader(options.bag) as bag:
        series = read_run_series(bag)
    bag_path = options.bag.resolve()
    folder = options.out or bag_path.with_name(f'{bag_path.name}-figures')
    for name, figure in run_figures(series).items():
        for path in write_figure(figure, folder, name):
            print(path)
    return 0


def _compare(options: CompareOptions) -> int:
    """Print a table; return 1 where the bags differ."""
    from goalreach_bags.compare import WALL_CLOCK_TOPICS, compare_bags
    from goalreach_bags.options import TopicSelection
    from goalreach_bags.reader import BagReader
    from goalreach_bags.report import show_comparison
    from goalreach_bags.storage import BagError

    exclude = options.exclude or tuple(f'^{name}$' for name in WALL_CLOCK_TOPICS)
    selection = TopicSelection(names=options.topics, exclude=exclude)
    times = not options.ignore_times
    with BagReader(options.bag) as first, BagReader(options.other) as second:
        if missing := selection.full_names - first.topics.keys() - second.topics.keys():
            raise BagError(options.bag, f'has no topic {min(missing)}, nor has {options.other}')
        comparisons = compare_bags(first, second, selection.includes, times=times)
    show_comparison(comparisons)
    return 0 if all(comparison.same for comparison in comparisons) else 1


SUBCOMMANDS: Final[Mapping[str, Command]] = {
    'info': Command(summary='topics, counts, losses, faults', options=InfoOptions, execute=_info),
    'plot': Command(
        summary='figures of a run: path, error, memberships, headings, Q',
        options=PlotOptions,
        execute=_plot,
    ),
    'compare': Command(
        summary='whether two bags hold the same messages, and where they first differ',
        options=CompareOptions,
        execute=_compare,
    ),
}
