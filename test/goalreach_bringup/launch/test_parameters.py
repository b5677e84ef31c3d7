"""Parameters of the running nodes: descriptors, atomic changes, a dump that starts the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import subprocess
import sys
from typing import Any

import pytest
from rcl_interfaces.srv import DescribeParameters, ListParameters, SetParametersAtomically
from rclpy.parameter import Parameter
import yaml

from goalreach_bringup.launch.child_process import NODE_CLASSES
from goalreach_bringup.launch.plan import NODE_CONFIGS
from goalreach_msgs_py.parameters import flatten_config, parameter_infos
import graphs
from ros2_words import ros2

pytestmark = pytest.mark.graph
Call = Callable[[type[Any], str, Any], Any]
LIVE = {
    'nomad200': {'start_pose', 'speed', 'goal_region'},
    'state_estimator': {'goal'},
    'goal_reaching_controller': {'mode', 'goal'},
}


@contextmanager
def running(name: str, domain: int, home: Path, *words: str) -> Iterator[None]:
    """Run one node as its own process."""
    process = subprocess.Popen(
        [sys.executable, '-m', NODE_CLASSES[name].partition(':')[0], '--ros-args', *words],
        env=graphs.graph_environment(domain, home),
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait(10.0)


def said(domain: int, home: Path, *words: str) -> str:
    """Return what a `ros2` command printed."""
    status, printed, problem = ros2(graphs.graph_environment(domain, home), *words)
    assert status == 0, problem
    return printed


@contextmanager
def caller(domain: int) -> Iterator[Call]:
    """Give a function that calls a service and returns its response."""
    with graphs.onlooker(domain) as (node, serve_until):

        def call(kind: type[Any], name: str, request: object) -> Any:  # noqa: ANN401 - any type
            client = node.create_client(kind, name)
            assert serve_until(client.service_is_ready, 90.0), name
            future = client.call_async(request)
            assert serve_until(future.done, 90.0), name
            return future.result()

        yield call


@pytest.mark.parametrize('name', NODE_CONFIGS)
def test_every_parameter_is_described_and_a_dump_starts_the_same_node(
    tmp_path: Path, name: str
) -> None:
    domain = graphs.fresh_domain()
    changed = '-p', 'use_sim_time:=true', '-p', 'qos_overrides./diagnostics.publisher.depth:=7'
    with running(name, domain, tmp_path, *changed), caller(domain) as call:
        names = call(ListParameters, f'/{name}/list_parameters', ListParameters.Request())
        request = DescribeParameters.Request(names=names.result.names)
        answer = call(DescribeParameters, f'/{name}/describe_parameters', request)
        described = {each.name: each for each in answer.descriptors}
        first = said(domain, tmp_path, 'param', 'dump', f'/{name}')
    for cls in NODE_CONFIGS[name]:
        defaults = flatten_config(cls())
        for parameter, info in parameter_infos(cls).items():
            if parameter not in described:
                continue  # of the regions, which only a new policy needs
            found = described[parameter]
            assert found.description == info.description
            live = parameter in LIVE.get(name, ()) or parameter.startswith(('noise.', 'faults.'))
            assert found.read_only != live, parameter
            if type(defaults[parameter]) is float and info.minimum is not None:
                assert found.floating_point_range[0].from_value == info.minimum
    saved = tmp_path / 'dump.yaml'
    saved.write_text(first)
    with running(name, domain, tmp_path, '--params-file', str(saved)), caller(domain) as call:
        call(ListParameters, f'/{name}/list_parameters', ListParameters.Request())
        second = said(domain, tmp_path, 'param', 'dump', f'/{name}')
    assert second == first
    values = yaml.safe_load(first)[f'/{name}']['ros__parameters']
    assert values['use_sim_time'] is True
    assert values['qos_overrides']['/diagnostics']['publisher']['depth'] == 7


def test_an_atomic_change_is_whole_or_none(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()

    def change(call: Call, **values: object) -> Any:  # noqa: ANN401 - a response
        wanted = [Parameter(key, value=value).to_parameter_msg() for key, value in values.items()]
        request = SetParametersAtomically.Request(parameters=wanted)
        return call(SetParametersAtomically, '/nomad200/set_parameters_atomically', request).result

    with running('nomad200', domain, tmp_path), caller(domain) as call:
        refused = change(call, speed=2.0, start_pose=[0.0, 0.0, 0.0])
        assert not refused.successful
        assert 'start_pose' in refused.reason
        speed = said(domain, tmp_path, 'param', 'get', '/nomad200', 'speed')
        assert '1.0' in speed
        assert change(call, speed=2.0, start_pose=[1.0, 3.0, 0.0]).successful
        speed = said(domain, tmp_path, 'param', 'get', '/nomad200', 'speed')
        assert '2.0' in speed
