"""What is installed into share: launch files, the robot's description, parameter files."""

from __future__ import annotations

import ast
from configparser import ConfigParser
import contextlib
from importlib.util import find_spec
import math
from pathlib import Path
import sys
from typing import Any
from unittest.mock import Mock
from xml.etree import ElementTree as ET

import pytest

from goalreach_bringup.cli import load_command
from goalreach_bringup.commands.dashboard import Options as PageOptions
from goalreach_bringup.launch.child_process import NODE_CLASSES
from goalreach_bringup.launch.options import RunOptions
from goalreach_bringup.launch.plan import standalone_parameters
from goalreach_msgs_py.arena import BODY_RADIUS_M
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameter_file import read_parameters
from goalreach_msgs_py.ros.transforms import PAN_FRAME, TILT_FRAME, TURRET_FRAME
from goalreach_msgs_py.topics import BASE_FRAME, CAMERA_FRAME, HEAD_JOINTS, NODES
from goalreach_sim.simulator_config import SimulatorConfig
from modules import load_module

ROOT = Path(__file__).parents[2]
BRINGUP = ROOT / 'src' / 'goalreach_bringup'
URDF = BRINGUP / 'urdf' / 'nomad200.urdf'
LAUNCH = find_spec('launch_ros') is not None
SHARE = {
    'goalreach_bringup/launch': {'goalreach.launch.py', 'page.launch.py'},
    'goalreach_bringup/params': {'lockstep.yaml'},
    'goalreach_bringup/rviz': {'goalreach.rviz'},
    'goalreach_bringup/urdf': {'nomad200.urdf'},
    'goalreach_msgs_py/arenas': {'paper.yaml', 'large.yaml', 'narrow.yaml', 'side_goal.yaml'},
    'goalreach_learning/policies': {'paper.json'},
}


@pytest.mark.parametrize('folder', SHARE)
def test_share_holds(folder: str) -> None:
    package = folder.partition('/')[0]
    config = ConfigParser()
    config.read(ROOT / 'src' / package / 'setup.cfg')
    patterns = config['options.data_files'][f'share/{folder}'].split()
    found = {path.name for each in patterns for path in (ROOT / 'src' / package).glob(each)}
    assert found == SHARE[folder]


def constants(name: str) -> dict[str, Any]:
    """Return the literals of a launch file, read without importing launch."""
    tree = ast.parse((BRINGUP / 'launch' / f'{name}.launch.py').read_text())
    found: dict[str, Any] = {}
    for node in tree.body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            with contextlib.suppress(ValueError):  # computed, not a literal
                found[node.targets[0].id] = ast.literal_eval(node.value)
    return found


def flags(command: str) -> set[str]:
    """Return the option names of a command, without the dashes."""
    parser = load_command(command).parser('x')
    return {flag[2:] for action in parser._actions for flag in action.option_strings}


def test_the_launch_file_starts_the_nodes_of_a_run_with_its_options() -> None:
    found = constants('goalreach')
    for name, place in NODE_CLASSES.items():
        config = ConfigParser()
        config.read(ROOT / 'src' / place.partition('.')[0] / 'setup.cfg')
        scripts = config['options.entry_points']['console_scripts']
        assert f'{name} = {place.partition(":")[0]}:main' in scripts
    assert set(found['OPTIONS']) <= flags('run')
    assert {'mode', 'arena', 'namespace', 'params-file'} <= set(found['OPTIONS'])


def test_the_page_has_the_options_of_its_command() -> None:
    options = constants('page')['OPTIONS']
    assert set(options) <= flags('dashboard')
    defaults = PageOptions()
    assert (options['host'], options['arena']) == (defaults.host, defaults.arena)


def test_nodes_started_by_launch_wait_for_no_launcher() -> None:
    parameters = standalone_parameters(RunOptions(clock='lockstep', mode='crisp', seed=3))
    assert set(parameters) == set(NODES)
    assert parameters['nomad200']['clock'] == 'lockstep'
    assert parameters['nomad200']['consumers'] == ''
    assert parameters['goal_reaching_controller']['consumer'] == ''
    assert parameters['goal_reaching_controller']['mode'] == 'crisp'
    assert Path(parameters['goal_reaching_controller']['policy']).is_file()


@pytest.mark.skipif(not LAUNCH, reason='launch and launch_ros are not installed')
def test_launch_describes_the_arguments() -> None:
    for name in ('goalreach', 'page'):
        module = load_module(BRINGUP / 'launch' / f'{name}.launch.py')
        described = module.generate_launch_description().get_launch_arguments()
        assert {each.name for each in described} >= set(module.OPTIONS)


class Argument:
    """Stands for `LaunchConfiguration`, which is a part of ROS 2 but not of its wheels."""

    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context: dict[str, str]) -> str:
        return context.get(self.name, '')


def started(monkeypatch: pytest.MonkeyPatch, **context: str) -> list[Any]:
    """Return the arguments of each node that the launch file starts."""
    names = ('launch', 'launch.actions', 'launch.substitutions', 'launch_ros.actions')
    modules = {name: Mock() for name in names}
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setitem(sys.modules, 'launch_ros', Mock())
    modules['launch.substitutions'].LaunchConfiguration = Argument
    load_module(BRINGUP / 'launch' / 'goalreach.launch.py').nodes(context)
    return [call.kwargs for call in modules['launch_ros.actions'].Node.call_args_list]


def test_the_launch_file_starts_what_others_do_not_replace_and_writes_among_the_logs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('ROS_LOG_DIR', str(tmp_path))
    nodes = started(monkeypatch, external='nomad200,state_estimator')
    assert {node['executable'] for node in nodes} == {NODES[1], NODES[3]}
    (path,) = {path for node in nodes for path in node['parameters']}
    assert Path(path).is_relative_to(tmp_path)
    assert set(read_parameters(path)) == set(NODES)
    with pytest.raises(ConfigurationError, match="--external = 'nomad2000'"):
        started(monkeypatch, external='nomad2000')


def test_parameter_files_are_accepted() -> None:
    for path in (BRINGUP / 'params').glob('*.yaml'):
        values = read_parameters(path, 'robot1')
        assert values['nomad200'] == {'clock': 'lockstep'}


def test_the_description_has_the_joints_and_limits_of_the_simulator() -> None:
    mujoco = pytest.importorskip('mujoco')
    model, config = mujoco.MjModel.from_xml_path(str(URDF)), SimulatorConfig()
    ranges = {model.joint(k).name: tuple(model.joint(k).range) for k in range(model.njnt)}
    turret, pan, tilt = HEAD_JOINTS
    head = config.head
    assert ranges == {
        turret: (0.0, 0.0),  # not limited
        pan: (head.pan_minimum_rad, head.pan_maximum_rad),
        tilt: (head.tilt_minimum_rad, head.tilt_maximum_rad),
    }
    robot = ET.parse(URDF).getroot()  # noqa: S314 - a file of this repository
    links = {link.get('name') for link in robot.iter('link')}
    assert links == {BASE_FRAME, TURRET_FRAME, PAN_FRAME, TILT_FRAME, CAMERA_FRAME}
    limits = {j.get('name'): j.find('limit') for j in robot.iter('joint')}
    speeds = {
        name: float(limit.get('velocity', 'nan'))
        for name, limit in limits.items()
        if limit is not None
    }
    assert speeds == {
        turret: config.drive.turret_speed_rad_per_s,
        pan: head.rate_rad_per_s,
        tilt: head.rate_rad_per_s,
    }
    pan_place = robot.find("joint[@name='pan_joint']/origin")
    assert pan_place is not None
    assert pan_place.get('xyz') == f'0 0 {config.camera_height_m:g}'
    body = robot.find("link[@name='base_link']/visual/geometry/cylinder")
    assert body is not None
    assert math.isclose(float(body.get('radius', '0')), BODY_RADIUS_M)
