"""The `run` command: the whole graph, driving."""

from __future__ import annotations

import argparse
from pathlib import Path

from goalreach_bags.topic import STORAGES
from goalreach_bringup.launch.options import MODES, RunOptions, parse_start
from goalreach_evaluation.choices import add_arena_option
from goalreach_msgs_py.noise import NOISE_PRESETS

SUMMARY = 'Bring the graph up, one process per node, and drive'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add(
        '--policy', type=Path, metavar='FILE', help='policy to drive; without it, learns one first'
    )
    add('--mode', choices=MODES, help='how the heading is chosen (default: fuzzy)')
    add('--paths', type=int, default=0, metavar='N', help='number of paths; 0: until Ctrl-C')
    add_arena_option(parser)
    add('--starts', choices=('paper', 'random'), default='paper', help='where paths begin')
    add(
        '--start',
        action='append',
        default=[],
        metavar='X,Y,HEADING_DEG',
        help='metres; repeatable',
    )
    add('--clock', choices=('realtime', 'lockstep'), help='how time passes (default: realtime)')
    add('--speed', type=float, metavar='F', help='times real time, with --clock realtime')
    add('--noise', choices=NOISE_PRESETS, default='nominal', help='how far sensors may be wrong')
    add(
        '--learn',
        action='store_true',
        help='Q-learning over the live graph, into --policy; goes on where it was left',
    )
    add('--record', type=Path, metavar='DIR', help='record every topic into a bag')
    add('--storage', choices=STORAGES, default='mcap', help='storage format of the bag')
    add('--composed', action='store_true', help='all nodes in one process')
    add(
        '--dashboard',
        action=argparse.BooleanOptionalAction,
        default=None,
        help='show the live page (default: on a terminal, in real time)',
    )
    add(
        '--remap',
        action='append',
        default=[],
        metavar='[NODE:]FROM:=TO',
        help='remapping rule of ROS 2 for the nodes; repeatable',
    )
    add('--params-file', type=Path, metavar='YAML', help='ROS 2 parameter file')
    add(
        '--network',
        action='store_true',
        help='let other machines take part: they can see, drive and change everything',
    )
    add('--summary', type=Path, metavar='JSON', help='write the summary of the run')
    add('--quiet', action='store_true', help='show errors only')


def execute(arguments: argparse.Namespace) -> int:
    """Run the graph; return 0 where every asked path reached the goal or the person stopped it.

    Raises:
        GoalreachError: An option, a file or a parameter is refused, or a node died.
    """
    from goalreach_bringup.launch.ros.session import RunSession

    return RunSession(_options(arguments)).execute()


def _options(arguments: argparse.Namespace) -> RunOptions:
    return RunOptions(
        seed=arguments.seed,
        policy=arguments.policy,
        mode=arguments.mode,
        arena=arguments.arena,
        paths=arguments.paths,
        starts=arguments.starts,
        start_poses=tuple(map(parse_start, arguments.start)),
        clock=arguments.clock,
        speed=arguments.speed,
        noise=arguments.noise,
        learn=arguments.learn,
        composed=arguments.composed,
        dashboard=arguments.dashboard,
        params_file=arguments.params_file,
        summary=arguments.summary,
        quiet=arguments.quiet,
        record=arguments.record,
        storage=arguments.storage,
        remaps=tuple(arguments.remap),
        network=arguments.network,
    )
