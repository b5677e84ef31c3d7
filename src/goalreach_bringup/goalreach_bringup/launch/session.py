"""One run of the graph, from its options to its result."""

from __future__ import annotations

import logging
import os
from pathlib import Path
import select
import sys
import termios
import time
from typing import TYPE_CHECKING, Any, Final

from goalreach_bags.storage import require_new_bag
from goalreach_bringup.launch.auxiliary_processes import (
    PageProcess,
    RecorderProcess,
    is_page_wanted,
)
from goalreach_bringup.launch.environment import domain_lock, graph_environment, make_run_directory
from goalreach_bringup.launch.graph import Graph
from goalreach_bringup.launch.learning_run import LearningRun
from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.path_evaluator import PathEvaluator
from goalreach_bringup.launch.plan import (
    ExternalNodes,
    choose_starts,
    plan_parameters,
    resume_parameters,
)
from goalreach_bringup.launch.report import RunReport, RunRequests
from goalreach_evaluation.choices import choose_arena, choose_policy
from goalreach_evaluation.path_metrics import PathResult, PathTally
from goalreach_evaluation.summary_file import summarise, write_summary
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import find_policy, write_policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.files import require_writable
from goalreach_msgs_py.parameter_file import NodeParameters, read_parameters, write_parameters
from goalreach_msgs_py.ros.dds_profile import open_to_network
from goalreach_msgs_py.ros.node import early_participant, ros_session
from goalreach_msgs_py.ros.process import StopRequest
from goalreach_msgs_py.topics import CLOCK, CONTROLLER, MONITOR, NODES, ROBOT

if TYPE_CHECKING:
    from goalreach_bringup.launch.ros.monitor import RunMonitor

_LOG: Final = logging.getLogger(__name__)


class RunSession:
    """Runs one session: setup, drive, teardown, report.

    Attributes:
        page: The page, for the next run or to be stopped; None where there is none.
        next_options: Options of the run that the page asks for, or None.
    """

    def __init__(self, options: RunOptions, page: PageProcess | None = None) -> None:
        self._options = options
        self.page = page
        self.next_options: RunOptions | None = None
        self._arena = choose_arena(options.arena)
        self._starts = choose_starts(options, self._arena)
        self._results: list[PathResult] = []
        self._tally = PathTally()
        self._learning: LearningRun | None = None
        self._recorder: RecorderProcess | None = None
        self._requests: RunRequests | None = None
        self._external = ExternalNodes()
        self._waits_for_person = False
        self._sim_time_s = 0.0

    def execute(self) -> int:
        """Run; return 0 where every requested path reached the goal, else 1."""
        options = self._options
        if options.summary:
            require_writable(options.summary)
        if options.record:
            require_new_bag(options.record)
        user = read_parameters(options.params_file, options.namespace)
        self._directory = make_run_directory()
        policy_path = find_policy(options.policy or self._directory / 'policy.json')
        total = options.paths
        if options.learn:
            given = user[CONTROLLER].get('learning.trials', LearningConfig().trials)
            trials = LearningConfig(trials=given).trials
            self._learning = LearningRun.begin(
                policy_path, self._arena, trials=trials, learner=options.learner
            )
            total = self._learning.remaining(options.paths, len(self._starts))
        self._report = RunReport(quiet=options.quiet, total=total)
        with self._report:
            policy = self._policy(policy_path)
            if options.learn and not total:
                return self._status(policy_path)
            parameters = plan_parameters(
                options,
                arena=self._arena,
                starts=self._starts,
                policy_path=str(policy_path.resolve()),
                user=user,
                learning=self._learning,
            )
            if options.no_drive and parameters[ROBOT]['clock'] == 'lockstep':
                raise ConfigurationError('--no-drive', 'clock: lockstep', 'in real time')
            self._drive_and_report(policy, parameters)
            status = self._status(policy_path)
            if self._requests is not None:
                self.next_options = self._requests.next_options()
            return status

    def _drive_and_report(self, policy: Policy, parameters: NodeParameters) -> None:
        options, clock = self._options, str(parameters[ROBOT]['clock'])
        if options.network:
            _LOG.warning(open_to_network())
        _LOG.info('logs, policy and parameters: %s', self._directory)
        began_s = time.monotonic()
        mode = 'learning' if self._learning else str(parameters[CONTROLLER]['mode'])
        shows_page = bool(self.page) or is_page_wanted(requested=options.dashboard, clock=clock)
        with domain_lock(options.namespace) as owns_clock:
            # In lockstep each robot has a time of its own, and /clock can be that of one only.
            topic = CLOCK if owns_clock else f'/{options.namespace}{CLOCK}'
            self._remaps, self._recorder_words = options.remaps, ['--with-run', clock]
            if name := options.namespace:
                self._remaps += (f'__ns:=/{name}', f'{CLOCK}:={topic}')
                self._recorder_words += ['--robot', name, '--clock-topic', topic]
                self._recorder_words += ['--regex', f'^(/{name}/|{topic}$)']
            try:
                self._drive(policy, parameters, shows_page=shows_page)
            finally:
                self._summarise(parameters, mode, time.monotonic() - began_s)

    def _policy(self, path: Path) -> Policy:
        if self._learning is not None:
            _LOG.info(self._learning.announcement(len(self._starts)))
            return self._learning.policy
        began_s = time.monotonic()
        policy = choose_policy(self._options.policy, self._arena, self._options.seeds.training)
        if self._options.policy is None:
            write_policy(path, policy)
            _LOG.info(
                'learned a policy: %d trials of %d paths in %.2f s',
                policy.learning['trials'], len(self._arena.starts), time.monotonic() - began_s,
            )  # fmt: skip
        return policy

    def _drive(self, policy: Policy, parameters: NodeParameters, *, shows_page: bool) -> None:
        """Bring the graph up and follow it to its end."""
        os.environ.update(graph_environment(os.environ, self._directory))
        write_parameters(self._directory / 'parameters.yaml', parameters, self._options.namespace)
        self._stop = StopRequest()
        graph: Graph | None = None
        try:
            if shows_page:
                self._open_page()
            if not self._find_external():
                return
            graph = self._graph(parameters)
            if ROBOT in self._external.names:
                self._record()
                self._await_recorder()
                graph.start()
            else:
                graph.start()
                self._record()
            self._follow(graph, policy, parameters)
        finally:
            if self._recorder is not None:
                _LOG.info(self._recorder.stop())
            if self._requests is not None:
                stopped = self._stop.requested or self._requests.ends
                reason = 'stopped' if stopped else 'an error'
                reason = 'all paths driven' if self._report.is_complete else reason
                self._requests.page.report('end', reason=reason)
            if graph is not None:
                graph.stop()

    def _record(self) -> None:
        """Start the recorder, where the run is recorded."""
        options, words = self._options, self._recorder_words
        if options.record is not None:
            bag, directory = options.record, self._directory
            self._recorder = RecorderProcess(bag, options.storage, directory, *words)

    def _await_recorder(self) -> None:
        """Wait until the recorder receives all inputs that an external robot publishes."""
        if (recorder := self._recorder) is None:
            return
        from goalreach_bringup.launch.ros.external import await_recorder

        def is_over() -> bool:
            recorder.poll(began=False)
            return self._is_stopped()

        await_recorder(self._remaps, is_over)

    def _graph(self, parameters: NodeParameters) -> Graph:
        options, external = self._options, self._external
        return Graph(
            parameters=external.parameters(parameters, options), directory=self._directory,
            composed=options.composed, namespace=options.namespace, nodes=external.started,
            remaps=(*self._remaps, *external.remaps(drive=not options.no_drive)),
        )  # fmt: skip

    def _find_external(self) -> bool:
        """Wait for the external nodes; return whether they were found."""
        options = self._options
        if not options.external:
            return True
        from goalreach_bringup.launch.ros.external import find_external

        names = tuple(name for name in NODES if name in options.external)
        found = find_external(names, self._remaps, self._is_stopped)
        if found is None:
            return False
        self._external = found
        for line in found.lines(options.placement_service):
            _LOG.info(line)
        if not found.is_placed(options.placement_service):
            self._starts = ()
        return True

    def _is_stopped(self) -> bool:
        if self._requests is not None:
            self._recorder = self._requests.serve(self._recorder)
        return self._stop.requested or (self._requests is not None and self._requests.ends)

    def _open_page(self) -> None:
        """Print the link of the page before the nodes start, and report the run to it."""
        options, directory, words = self._options, self._directory, self._recorder_words
        if self.page is None:
            self.page = PageProcess(options.arena, options.namespace, directory)
        self._requests = RunRequests(
            self.page, options, directory=directory, recorder_words=words, stop=self._stop
        )

    def _follow(self, graph: Graph, policy: Policy, parameters: NodeParameters) -> None:
        with ros_session():
            with early_participant(MONITOR):  # discovered while these are imported
                from goalreach_bringup.launch.ros.external import ExternalWatch, log_commands
                from goalreach_bringup.launch.ros.monitor import RunMonitor
                from goalreach_bringup.launch.ros.supervisor import follow

                evaluator = PathEvaluator(
                    self._starts,
                    policy.regions,
                    path=self._learning.first_path if self._learning else 0,
                    judged=self._external.has_truth,
                )
                mode = str(parameters[CONTROLLER]['mode'])
                monitor = RunMonitor(evaluator, policy, mode, self._on_path, self._remaps)
                watch, drives = None, not self._options.no_drive
                if self._external.names:
                    stamped = bool(parameters[CONTROLLER]['stamped_cmd_vel'])
                    watch = ExternalWatch(monitor, self._external, stamped=stamped, stops=drives)
                if not drives:
                    log_commands(monitor)
            lockstep = parameters[ROBOT]['clock'] == 'lockstep'
            follow(
                graph,
                monitor,
                finished=lambda: self._is_over(monitor) or self._is_stopped(),
                resume=lambda: resume_parameters(monitor.progress, lockstep=lockstep),
                watch=watch,
            )

    def _is_over(self, monitor: RunMonitor) -> bool:
        began_ns = (monitor.began_ns or 0) if ROBOT in self._external.names else 0
        self._sim_time_s = max(0, monitor.progress.last_ns - began_ns) * 1e-9
        if self._recorder is not None:
            ended = self._recorder.poll(began=monitor.progress.last_ns > 0)
            if ended and self.page:
                self.page.report('record', on=False, error=ended)
        typed = self._waits_for_person and sys.stdin.isatty() and select.select([0], [], [], 0)[0]
        if typed and sys.stdin.readline():
            monitor.start_path()
        return self._report.is_complete

    def _on_path(self, result: PathResult | None) -> None:
        """Print and count a result; keep it only for a summary: a run may last for days."""
        self._report.path(result)
        if result is not None:
            self._tally.add(result)
            if self._options.summary:
                self._results.append(result)
            if self._requests is not None:
                self._requests.add_path(result)
        placed = bool(self._starts or self._options.placement_service)
        self._waits_for_person = not (placed or self._report.is_complete)
        if self._waits_for_person:
            if sys.stdin.isatty():  # what was typed while the robot drove
                termios.tcflush(sys.stdin, termios.TCIFLUSH)
            _LOG.info(
                'place the robot for the next path, then press Enter, or call /%s/start', MONITOR
            )

    def _summarise(self, parameters: NodeParameters, mode: str, wall_time_s: float) -> None:
        options = self._options
        times: dict[str, Any] = {'sim_time_s': self._sim_time_s, 'wall_time_s': wall_time_s}
        self._report.table(self._tally, mode=mode, **times)
        if options.summary:
            facts: dict[str, Any] = {'mode': mode, 'config': parameters}
            facts |= {'seed': options.seed, 'policy': str(options.policy or 'learned')}
            write_summary(options.summary, summarise(self._results, **facts, **times))

    def _status(self, policy_path: Path) -> int:
        failed = self._recorder is not None and self._recorder.failed
        failed = failed or (self._requests is not None and self._requests.has_lost_bag)
        if self._learning is not None:
            _LOG.info(LearningRun.verdict(policy_path, self._arena))
            return int(failed)
        reached = self._tally.goals + self._tally.declared
        missed = self._options.paths and reached != self._options.paths
        return 1 if failed or missed else 0
