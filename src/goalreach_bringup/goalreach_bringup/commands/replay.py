"""The `replay` command: a bag into the graph, or through live perception."""

from __future__ import annotations

import argparse
from pathlib import Path

from goalreach_bags.topic import TopicSelection

SUMMARY = 'Replay a rosbag2 directory into the graph, or through live perception'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add('bag', type=Path, metavar='DIR', help='the bag')
    add('--topics', nargs='+', default=(), metavar='NAME', help='topics by name (default: all)')
    add('--regex', action='append', default=[], metavar='PATTERN', help='topics by pattern')
    add('--exclude', action='append', default=[], metavar='PATTERN', help='topics to leave out')
    add('--rate', type=float, default=1.0, metavar='F', help='times the recorded speed')
    add('--loop', action='store_true', help='begin again at the end, until Ctrl-C')
    add('--start', type=float, default=0.0, metavar='S', help='begin so late in the bag')
    add('--duration', type=float, metavar='S', help='play only so much of the bag')
    add('--delay', type=float, default=0.5, metavar='S', help='time for subscribers to connect')
    add('--clock', action='store_true', help='publish /clock')
    add('--paused', action='store_true', help='begin with a pause; space goes on, s steps')
    add('--quiet', action='store_true', help='show no progress')
    add(
        '--recompute',
        action='store_true',
        help='feed the recorded sensors to live perception and state estimation, and compare '
        'what they publish with what was recorded',
    )
    add(
        '--tolerance',
        type=float,
        default=1e-9,
        metavar='X',
        help='with --recompute: largest difference of a field that counts as none',
    )
    add(
        '--params-file',
        type=Path,
        metavar='YAML',
        help='with --recompute: parameters that replace the recorded ones',
    )


def execute(options: argparse.Namespace) -> int:
    """Replay; with --recompute return 1 where something differs.

    Raises:
        GoalreachError: The bag cannot be read or replayed.
    """
    if options.recompute:
        from goalreach_bags.report import show_recomputation
        from goalreach_bags.ros.recompute import recompute

        results = recompute(
            options.bag, tolerance=options.tolerance, params_file=options.params_file
        )
        show_recomputation(results, tolerance=options.tolerance)
        return 0 if all(result.same for result in results) else 1
    from goalreach_bags.ros.player import ReplayOptions, replay

    selection = TopicSelection(
        names=tuple(options.topics),
        patterns=tuple(options.regex),
        exclude=tuple(options.exclude),
    )
    print(
        replay(
            ReplayOptions(
                path=options.bag,
                selection=selection,
                rate=options.rate,
                loop=options.loop,
                start_s=options.start,
                duration_s=options.duration,
                clock=options.clock,
                paused=options.paused,
                delay_s=options.delay,
                quiet=options.quiet,
            )
        )
    )
    return 0
