"""The `run` command: the whole graph, driving."""

from __future__ import annotations

import argparse
from pathlib import Path
import time

import numpy as np
import rclpy
from rclpy.signals import SignalHandlerOptions

from goalreach_bringup.commands.not_there_yet import refuse
from goalreach_bringup.parameter_file import merge_parameters, read_parameters, write_parameters
from goalreach_bringup.path_metrics import PathResult
from goalreach_bringup.run.environment import make_run_directory
from goalreach_bringup.run.launcher import Graph, StopRequest
from goalreach_bringup.run.options import MODES, RunOptions, parse_start
from goalreach_bringup.run.plan import CONTROLLER, NODES, RunSeeds, choose_starts, plan_parameters
from goalreach_bringup.run.report import RunReport
from goalreach_bringup.run.ros_monitor import RunMonitor
from goalreach_bringup.summary_file import summarise, write_summary
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NOISE_PRESETS

__all__ = ['SUMMARY', 'configure', 'execute']

SUMMARY = 'Bring the graph up, one process per node, and drive'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add(
        '--policy', type=Path, metavar='FILE', help='policy to drive; without it, learns one first'
    )
    add('--mode', choices=MODES, help='how the heading is chosen (default: fuzzy)')
    add('--paths', type=int, default=0, metavar='N', help='number of paths; 0: until Ctrl-C')
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
    add('--learn', action='store_true', help='Q-learning over the live graph (not there yet)')
    add('--record', type=Path, metavar='DIR', help='record a bag (not there yet)')
    add('--composed', action='store_true', help='all nodes in one process')
    add(
        '--dashboard',
        action=argparse.BooleanOptionalAction,
        default=False,
        help='show the live page (not there yet)',
    )
    add('--params-file', type=Path, metavar='YAML', help='ROS 2 parameter file')
    add('--summary', type=Path, metavar='JSON', help='write the summary of the run')
    add('--quiet', action='store_true', help='show errors only')


def execute(arguments: argparse.Namespace) -> int:
    """Run the graph; return 0 where every asked path reached the goal or the person stopped it."""
    for name in ('learn', 'record', 'dashboard'):
        if getattr(arguments, name):
            return refuse(f'run --{name}')
    return _Run(_options(arguments)).execute()


def _options(arguments: argparse.Namespace) -> RunOptions:
    return RunOptions(
        seed=arguments.seed,
        policy=arguments.policy,
        mode=arguments.mode,
        paths=arguments.paths,
        starts=arguments.starts,
        start_poses=tuple(map(parse_start, arguments.start)),
        clock=arguments.clock,
        speed=arguments.speed,
        noise=arguments.noise,
        learn=arguments.learn,
        composed=arguments.composed,
        params_file=arguments.params_file,
        summary=arguments.summary,
        quiet=arguments.quiet,
    )


class _Run:
    """One run, from its options to its summary."""

    def __init__(self, options: RunOptions) -> None:
        self._options = options
        self._arena = Arena()
        self._seeds = RunSeeds.spawn(options.seed)
        self._starts = choose_starts(options, self._arena, self._seeds)
        self._report = RunReport(quiet=options.quiet, total=options.paths)
        self._results: list[PathResult] = []

    def execute(self) -> int:
        """Prepare, drive, take down, and tell."""
        options = self._options
        user = read_parameters(options.params_file, NODES) if options.params_file else {}
        policy = self._policy()
        directory = make_run_directory()
        policy_path = options.policy or directory / 'policy.json'
        if options.policy is None:
            write_policy(policy_path, policy)
        parameters = plan_parameters(
            options,
            arena=self._arena,
            starts=self._starts,
            policy_path=str(policy_path.resolve()),
            seeds=self._seeds,
            user=user,
        )
        write_parameters(directory / 'parameters.yaml', parameters)
        self._report.say(f'logs, policy and parameters: {directory}')
        mode = str(parameters[CONTROLLER]['mode'])
        began_s = time.monotonic()
        sim_time_s = self._drive(directory, policy, mode)
        wall_time_s = time.monotonic() - began_s
        self._tell(mode, sim_time_s, wall_time_s)
        if options.summary:
            summary = summarise(
                self._results,
                seed=options.seed,
                mode=mode,
                policy=str(options.policy or 'learned'),
                sim_time_s=sim_time_s,
                wall_time_s=wall_time_s,
                config=merge_parameters(parameters),
            )
            write_summary(options.summary, summary)
        failed = sum(result.outcome != 'goal' for result in self._results)
        return 1 if options.paths and (failed or len(self._results) < options.paths) else 0

    def _policy(self) -> Policy:
        if self._options.policy is not None:
            return read_policy(self._options.policy)
        began_s = time.monotonic()
        rng = np.random.default_rng(self._seeds.training)
        result = train(self._arena, rng=rng)
        self._report.say(
            f'learned a policy: {len(result.success_by_trial)} trials of '
            f'{len(self._arena.starts)} paths in {time.monotonic() - began_s:.2f} s'
        )
        return result.policy

    def _drive(self, directory: Path, policy: Policy, mode: str) -> float:
        """Bring the graph up and follow it to its end; return the simulated seconds."""
        options = self._options
        graph = Graph(
            parameters_path=directory / 'parameters.yaml',
            directory=directory,
            composed=options.composed,
            tell=self._report.say,
            warn=self._report.warn,
        )
        stop = StopRequest()
        try:
            graph.start()
            rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
            monitor = RunMonitor(
                starts=self._starts,
                policy=policy,
                mode=mode,
                on_path=self._on_path,
                on_transition=lambda _transition: None,
            )
            graph.follow(monitor, lambda: stop.requested or self._complete())
            return monitor.referee.last_ns * 1e-9
        finally:
            rclpy.try_shutdown()
            graph.stop()

    def _complete(self) -> bool:
        return bool(self._options.paths) and len(self._results) >= self._options.paths

    def _on_path(self, result: PathResult) -> None:
        self._results.append(result)
        self._report.path(result)

    def _tell(self, mode: str, sim_time_s: float, wall_time_s: float) -> None:
        if self._results:
            self._report.table(
                self._results, mode=mode, sim_time_s=sim_time_s, wall_time_s=wall_time_s
            )
