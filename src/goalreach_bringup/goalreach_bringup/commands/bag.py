"""The `bag` command: what is in a bag, without a graph."""

from __future__ import annotations

import argparse
from pathlib import Path

SUMMARY = 'Look into a bag: info, plot, export, compare; make a reference'

_REFERENCE_START = '0.6,2.0,-90'
"""Chosen: a short path, about five seconds, that turns and crosses a border."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add one sub-command per verb."""
    verbs = parser.add_subparsers(dest='verb', metavar='VERB', required=True)
    info = verbs.add_parser('info', help='topics, counts, rates, losses')
    info.add_argument('bag', type=Path, metavar='DIR')
    plot = verbs.add_parser('plot', help='figures of a run: path, error, memberships, headings, Q')
    plot.add_argument('bag', type=Path, metavar='DIR')
    plot.add_argument('--out', type=Path, metavar='DIR', help='where to (default: DIR-figures)')
    export = verbs.add_parser('export', help='a topic as CSV or Parquet')
    export.add_argument('bag', type=Path, metavar='DIR')
    export.add_argument('topic', metavar='TOPIC')
    export.add_argument('--out', type=Path, metavar='FILE', help='.csv (default) or .parquet')
    export.add_argument(
        '--max-array', type=int, default=64, metavar='N', help='leave longer arrays out'
    )
    reference = verbs.add_parser(
        'reference', help='drive one short path in lockstep and record it, for replay --recompute'
    )
    reference.add_argument('bag', type=Path, metavar='DIR')
    reference.add_argument('--composed', action='store_true', help='all nodes in one process')
    _configure_compare(
        verbs.add_parser(
            'compare', help='whether two bags hold the same messages, and where they first differ'
        )
    )


def _configure_compare(compare: argparse.ArgumentParser) -> None:
    add = compare.add_argument
    add('bag', type=Path, metavar='A')
    add('other', type=Path, metavar='B')
    add('--topics', nargs='+', default=(), metavar='NAME', help='only these')
    add(
        '--exclude',
        action='append',
        metavar='PATTERN',
        help='topics to leave out (default: /rosout and /parameter_events)',
    )
    add('--ignore-times', action='store_true', help='compare the messages, not when they came')


def execute(options: argparse.Namespace) -> int:
    """Do what the verb says.

    Raises:
        GoalreachError: A bag cannot be read, or a file cannot be written.
    """
    verbs = {
        'info': _info,
        'plot': _plot,
        'export': _export,
        'reference': _reference,
        'compare': _compare,
    }
    return verbs[options.verb](options)


def _info(options: argparse.Namespace) -> int:
    from goalreach_bags.reader import BagReader
    from goalreach_bags.report import show_bag

    with BagReader(options.bag) as bag:
        show_bag(bag)
    return 0


def _plot(options: argparse.Namespace) -> int:
    from goalreach_bags.reader import BagReader
    from goalreach_bags.run_figures import run_figures
    from goalreach_bags.run_series import read_run_series
    from goalreach_evaluation.figures.figure_file import write_figure

    with BagReader(options.bag) as bag:
        series = read_run_series(bag)
    folder = options.out or options.bag.with_name(f'{options.bag.name}-figures')
    for name, figure in run_figures(series).items():
        for path in write_figure(figure, folder, name):
            print(path)
    return 0


def _export(options: argparse.Namespace) -> int:
    from goalreach_bags.decode import Decoder
    from goalreach_bags.export import MessageTable, write_table
    from goalreach_bags.reader import BagReader

    topic = options.topic if options.topic.startswith('/') else f'/{options.topic}'
    table = MessageTable(max_array=options.max_array)
    with BagReader(options.bag) as bag:
        bag.require([topic])
        decoder = Decoder([bag.topics[topic]])
        for message in bag.messages([topic]):
            table.add(message.time_ns, decoder.decode(topic, message.data))
    table.make_numbers()
    path = options.out or Path(f'{topic.strip("/").replace("/", "_")}.csv')
    write_table(path, table)
    left_out = f', without {", ".join(sorted(table.left_out))}' if table.left_out else ''
    print(f'{table.rows} messages, {len(table.columns)} columns{left_out}: {path}')
    return 0


def _reference(options: argparse.Namespace) -> int:
    from goalreach_bringup.commands import run

    parser = argparse.ArgumentParser()
    parser.add_argument('--seed', type=int)
    run.configure(parser)
    arguments = ['--seed', str(options.seed), '--clock', 'lockstep', '--quiet', '--paths', '1']
    arguments += ['--start', _REFERENCE_START, '--record', str(options.bag)]
    arguments += ['--composed'] * options.composed
    return run.execute(parser.parse_args(arguments))


def _compare(options: argparse.Namespace) -> int:
    """Print a table; return 1 where the bags differ."""
    from goalreach_bags.compare import WALL_CLOCK_TOPICS, compare_bags
    from goalreach_bags.reader import BagReader
    from goalreach_bags.report import show_comparison
    from goalreach_bags.topic import TopicSelection

    exclude = options.exclude or [f'^{name}$' for name in WALL_CLOCK_TOPICS]
    selection = TopicSelection(names=tuple(options.topics), exclude=tuple(exclude))
    with BagReader(options.bag) as first, BagReader(options.other) as second:
        comparisons = compare_bags(
            first, second, selection.includes, times=not options.ignore_times
        )
    show_comparison(comparisons)
    return 0 if all(comparison.same for comparison in comparisons) else 1
