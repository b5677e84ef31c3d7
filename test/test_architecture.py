"""The house rules, executed; and for each rule a snippet that breaks it."""

import ast
from collections.abc import Callable, Iterator
from pathlib import Path
import re
import subprocess
from xml.etree import ElementTree as ET

import pytest

from architecture import (
    PACKAGES,
    Module,
    check_cycles,
    check_manifest,
    check_package_imports,
    check_purity,
    check_ros_imports,
    check_size,
    check_traces,
)
from drawing import all_modules, draw, drawn, package_imports

ROOT = Path(__file__).resolve().parent.parent
TEXT_SUFFIXES = {
    '.md',
    '.py',
    '.toml',
    '.xml',
    '.cfg',
    '.yaml',
    '.yml',
    '.meta',
    '.lock',
    '.json',
    '.ipynb',
}


MODULES = all_modules()


def _texts() -> Iterator[tuple[str, str]]:
    """Give the texts of the project: what git tracks, not what a run has left beside it."""
    listing = subprocess.run(
        ['git', 'ls-files', '-z'], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for name in filter(None, listing.stdout.split('\0')):
        path = ROOT / name
        if path.is_file() and (path.suffix in TEXT_SUFFIXES or path.parent.name == '.ci'):
            yield name, path.read_text()


def _manifest(package: str) -> ET.Element:
    return ET.parse(ROOT / 'src' / package / 'package.xml').getroot()  # noqa: S314 - ours


@pytest.mark.parametrize(
    'check', [check_ros_imports, check_package_imports, check_purity, check_size]
)
def test_every_module_keeps_the_rule(check: Callable[[Module], list[str]]) -> None:
    complaints = [complaint for module in MODULES for complaint in check(module)]

    assert not complaints, '\n'.join(complaints)


def test_imports_follow_one_order() -> None:
    complaints = check_cycles(MODULES)

    assert not complaints, '\n'.join(complaints)


def test_the_drawing_shows_the_imports() -> None:
    assert drawn() == draw(package_imports(MODULES)), 'run `python3 test/support/drawing.py`'


@pytest.mark.parametrize('package', PACKAGES)
def test_manifest_declares_the_imports(package: str) -> None:
    declared = [
        str(element.text)
        for tag in ('depend', 'exec_depend')
        for element in _manifest(package).iter(tag)
    ]
    mine = [module for module in MODULES if module.package == package]
    complaints = check_manifest(package, mine, set(declared))

    assert not complaints, '\n'.join(complaints)
    assert len(declared) == len(set(declared))


def test_scripts_and_tests_support_are_small() -> None:
    paths = [*ROOT.glob('scripts/*.py'), *ROOT.glob('test/support/*.py')]
    modules = [Module(name=path.stem, text=path.read_text()) for path in paths]

    complaints = [complaint for module in modules for complaint in check_size(module)]

    assert not complaints, '\n'.join(complaints)


def test_texts_speak_of_the_project_alone() -> None:
    complaints = [c for name, text in _texts() for c in check_traces(name, text)]

    assert not complaints, '\n'.join(complaints)


def test_documents_name_files_that_exist() -> None:
    missing = []
    for path in [*ROOT.glob('*.md'), *ROOT.glob('docs/**/*.md')]:
        text = path.read_text()
        links = re.findall(r'\]\((?!https?:|#)([^)#]+)', text)
        names = re.findall(r'`((?:src|lab|test|scripts|docs|examples)/[\w./-]+)`', text)
        missing += [f'{path.name}: {n}' for n in links if not (path.parent / n).exists()]
        missing += [f'{path.name}: {n}' for n in names if not (ROOT / n).exists()]

    assert not missing, '\n'.join(missing)


def test_every_package_has_the_same_version() -> None:
    folders = {path.parent.name for path in ROOT.glob('src/*/package.xml')}
    manifests = [_manifest(package) for package in PACKAGES]
    builds = [ROOT / 'src' / package / 'setup.cfg' for package in PACKAGES]
    texts = [path.read_text() for path in [ROOT / 'pyproject.toml', *builds]]
    found = [re.findall(r"^version = '?([\d.]+)'?$", text, re.MULTILINE) for text in texts]
    versions = {version for (version,) in found}

    assert folders == set(PACKAGES)
    assert [manifest.findtext('name') for manifest in manifests] == list(PACKAGES)
    assert {manifest.findtext('version') for manifest in manifests} == versions
    assert len(versions) == 1


@pytest.mark.parametrize('package', PACKAGES)
def test_entry_points_lead_to_functions(package: str) -> None:
    text = (ROOT / 'src' / package / 'setup.cfg').read_text()
    sources = {module.name: module.text for module in MODULES}
    for name, function in re.findall(r'^    \w+ = ([\w.]+):(\w+)$', text, re.MULTILINE):
        functions = [
            n.name for n in ast.parse(sources[name]).body if isinstance(n, ast.FunctionDef)
        ]
        assert function in functions, name
    nodes = {name for name in sources if name.endswith('_node')}
    mine = {name for name in nodes if name.startswith(f'{package}.')}
    assert {name for name in mine if f'= {name}:main' not in text} == set()


# What follows shows that the checks can fail.


def _sim(text: str, name: str = 'robot') -> Module:
    return Module(name=f'goalreach_sim.{name}', text=text)


@pytest.mark.parametrize(
    'text',
    [
        'import rclpy',
        'from rclpy.node import Node',
        'def f():\n    from sensor_msgs.msg import Image',
        'from goalreach_msgs_py.ros.messages import to_ros',
        'from goalreach_msgs_py import ros',
        'from . import nomad200_node',
    ],
)
def test_ros_in_a_pure_module_is_found(text: str) -> None:
    assert len(check_ros_imports(_sim(text))) == 1
    assert check_ros_imports(_sim(text, name='ros.messages')) == []
    assert check_ros_imports(_sim(text, name='nomad200_node')) == []


@pytest.mark.parametrize(
    ('name', 'text', 'count'),
    [
        ('goalreach_sim.a', 'import goalreach_perception.blobs', 1),
        ('goalreach_learning.a', 'from goalreach_sim import robot', 1),
        ('goalreach_msgs_py.a', 'from goalreach_bringup.cli import main', 1),
        ('goalreach_sim.a', 'from goalreach_msgs_py.angles import wrap', 0),
        ('goalreach_bringup.a', 'import goalreach_sim, goalreach_learning', 0),
        ('goalreach_bringup.a', 'import test', 1),
        ('goalreach_bags.a', 'import goalreach_bringup.cli', 1),
        ('goalreach_bringup.a', 'import goalreach_lab.cli', 1),
        ('goalreach_lab.cli', 'import goalreach_bringup.cli, goalreach', 0),
    ],
)
def test_import_against_the_layers_is_found(name: str, text: str, count: int) -> None:
    assert len(check_package_imports(Module(name=name, text=text))) == count


@pytest.mark.parametrize(
    'text',
    [
        'print(1)',
        'open("a")',
        'import logging',
        'from time import monotonic',
        'import os.path',
        'path.read_text()',
        'np.load("a")',
        'cv2.imwrite("a", b)',
    ],
)
def test_io_in_pure_code_is_found(text: str) -> None:
    assert len(check_purity(_sim(text))) == 1
    assert check_purity(_sim(text, name='policy_file')) == []
    assert check_purity(Module(name='goalreach_bringup.cli', text=text)) == []


@pytest.mark.parametrize(
    'text',
    [
        'import random',
        'np.random.normal()',
        'numpy.random.seed(1)',
        'np.random.default_rng()',
        'cv2.setRNGSeed(1)',
    ],
)
@pytest.mark.parametrize('name', ['goalreach_sim.robot', 'goalreach_bringup.cli'])
def test_global_randomness_is_found(text: str, name: str) -> None:
    assert len(check_purity(Module(name=name, text=text))) == 1


def test_seeded_randomness_is_fine() -> None:
    text = 'a = np.random.default_rng(7).normal()\nb: np.random.Generator\nc = rng.random()'

    assert check_purity(_sim(text)) == []


def test_manifest_that_differs_from_the_imports_is_found() -> None:
    module = _sim('import math, cv2, rosbags\nimport sensor_msgs.msg\nimport nonsense')

    assert check_manifest('goalreach_sim', [module], {'sensor_msgs', 'rclpy'}) == [
        'goalreach_sim imports nonsense: no rosdep key is known',
        'goalreach_sim lacks python3-opencv',
        'goalreach_sim does not import rclpy',
    ]


def test_cycle_is_found() -> None:
    cycle = [
        _sim('from goalreach_sim.b import f', name='a'),
        _sim('import goalreach_sim.c', name='b'),
        _sim('def f():\n    from goalreach_sim import a', name='c'),
    ]
    before = _sim('from goalreach_sim import a', name='d')

    found = check_cycles([*cycle, before])
    assert found == [f'goalreach_sim.{name} imports itself again' for name in 'abc']
    assert check_cycles([*cycle[:2], before]) == []


def test_long_modules_and_functions_are_found() -> None:
    function = 'def f():\n' + 40 * '    pass\n'

    assert check_size(_sim(function)) == ['goalreach_sim.robot.f has 41 lines']
    assert check_size(_sim(401 * '\n')) == ['goalreach_sim.robot has 401 lines']
    assert check_size(_sim(function[:-9] + 100 * '\n')) == []


@pytest.mark.parametrize(
    'text', ['see issue' + ' #12', '/' + 'home/me/x', 'https://py' + 'pi.org', '/' + 'tmp/x']
)
def test_traces_are_found(text: str) -> None:
    assert len(check_traces('a.md', text)) == 1
    assert check_traces('a.md', 'issues of ROS 2, in tmp, from a package index') == []
