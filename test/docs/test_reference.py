"""What the documents list is what the code has."""

import ast
from collections.abc import Iterator
import os
from pathlib import Path
import re
import signal
import subprocess
import sys

import pytest

from _venv import SIZES
from goalreach_bringup import variables
from goalreach_bringup.cli import COMMANDS
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena_file import read_arena
import graphs

ROOT = Path(__file__).parents[2]
README_WORDS = 900
_ROW = re.compile(r'^\| `(/[\w/]+)`<br>(\w+)/(\w+) \|', re.MULTILINE)
_OWN = re.compile(r'/(?:rosout|parameter_events|_acknowledged/.*)')


def contract() -> dict[str, str]:
    """Return the types of the topics of CONTRACT.md."""
    text = (ROOT / 'docs' / 'CONTRACT.md').read_text()
    return {name: f'{package}/msg/{kind}' for name, package, kind in _ROW.findall(text)}


def blocks(path: Path, language: str = 'python') -> Iterator[str]:
    """Give the examples in a language of a document."""
    pattern = rf'^```{language}\n(.*?)^```'
    yield from re.findall(pattern, path.read_text(), re.MULTILINE | re.DOTALL)


def test_the_readme_is_short() -> None:
    assert len((ROOT / 'README.md').read_text().split()) <= README_WORDS


def test_the_readme_names_topics_and_commands_that_exist() -> None:
    text = (ROOT / 'README.md').read_text()
    named = set(re.findall(r'(?:`|echo )(/[a-z_/]+)(?:`|$)', text, re.MULTILINE))
    listed = re.findall(r'^\* (`.*?): ', text.partition('## Commands')[2], re.MULTILINE)
    words = re.findall('`(.*?)`', ' '.join(listed))

    assert len(named) >= 8
    assert named <= contract().keys()
    assert {word for word in words if not word.endswith('.py')} == set(COMMANDS)
    assert all((ROOT / 'scripts' / word).is_file() for word in words if word.endswith('.py'))


def test_the_readme_tells_the_sizes_that_the_set_up_tells() -> None:
    """`test_install.py` measures them."""
    text = ' '.join((ROOT / 'README.md').read_text().split())

    assert f'about {SIZES["page"]} for driving with the live page, {SIZES["dev"]} with' in text


@pytest.mark.graph
def test_the_exit_statuses_are_those_described(tmp_path: Path) -> None:
    def status(*words: str, sent: int = 0, out: int = subprocess.PIPE, **more: str) -> int:
        with subprocess.Popen(
            [sys.executable, '-m', 'goalreach_bringup.cli', *words],
            cwd=tmp_path,
            env={**graphs.graph_environment(graphs.fresh_domain(), tmp_path), **more},
            stdout=out,
            stderr=subprocess.DEVNULL,
        ) as process:
            if sent:
                assert process.stdout is not None
                assert process.stdout.readline() == b'publisher: beginning loop\n'
                process.send_signal(sent)
            return process.wait(60.0)

    unread, pipe = os.pipe()
    os.close(unread)
    publish = ('ros2', 'topic', 'pub', '/greeting', 'std_msgs/msg/String')
    found = {
        '0': status('train', '--out', 'policy.json'),
        '1': status('doctor', ROS_DOMAIN_ID='abc'),
        '2': status('train', '--trials', 'none'),
        '130': status(*publish, sent=signal.SIGINT),
        '141': status('doctor', out=pipe),
        '128 + n': status(*publish, sent=signal.SIGTERM) - signal.SIGTERM,
    }
    os.close(pipe)

    text = (ROOT / 'docs' / 'reference' / 'exit_status.md').read_text()
    rows = re.findall(r'^\| (\d\S*(?: \+ n)?) \|', text, re.MULTILINE)
    assert found == {row: int(row.split()[0]) for row in rows}
    commands = re.findall(r'^\| `([\w-]+)', text, re.MULTILINE)
    assert set(commands) <= {*COMMANDS, 'scripts'}


def test_every_checked_variable_is_described() -> None:
    text = (ROOT / 'docs' / 'reference' / 'environment.md').read_text()

    assert [name for name in variables._CHECKS if f'`{name}`' not in text] == []


@pytest.mark.graph
def test_the_contract_lists_the_topics_of_a_run(tmp_path: Path) -> None:
    domain = graphs.fresh_domain()
    seen: dict[str, str] = {}
    command = ['run', '--policy', 'paper', '--no-dashboard']
    with (
        graphs.goalreach(command, domain=domain, home=tmp_path),
        graphs.onlooker(domain) as (node, serve_until),
    ):

        def complete() -> bool:
            seen.update((name, kinds[0]) for name, kinds in node.get_topic_names_and_types())
            return contract().keys() <= seen.keys()

        serve_until(complete, 90.0)

    assert {name: kind for name, kind in seen.items() if not _OWN.fullmatch(name)} == contract()
    services = (ROOT / 'docs' / 'CONTRACT.md').read_text()
    assert f'`{topics.RESET_SERVICE}`' in services
    assert f'`{topics.PAUSE_SERVICE}`' in services


def test_the_examples_of_tutorials_are_valid_python() -> None:
    pages = [*ROOT.glob('docs/tutorials/*.md'), *ROOT.glob('docs/how-to/*.md')]
    found = [block for page in pages for block in blocks(page)]

    assert len(found) >= 5
    for block in found:
        ast.parse(block)


def test_the_arenas_of_pages_are_whole(tmp_path: Path) -> None:
    pages = [ROOT / 'docs' / 'reference' / 'files.md', *ROOT.glob('docs/how-to/*.md')]
    arenas = [text for page in pages for text in blocks(page, 'yaml') if 'leds_m:' in text]

    assert len(arenas) >= 3
    for text in arenas:
        path = tmp_path / 'arena.yaml'
        path.write_text(text)
        read_arena(path)


def test_the_tutorial_shows_the_ten_lines() -> None:
    text = (ROOT / 'examples' / 'ten_lines.py').read_text()
    shown = next(blocks(ROOT / 'docs' / 'tutorials' / 'ten_lines.md'))

    assert text.endswith(f'"""\n\n{shown}')


def test_the_environment_of_the_gymnasium_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip('gymnasium')
    example, _ = blocks(ROOT / 'docs' / 'how-to' / 'gymnasium.md')
    exec(compile(example, 'gymnasium.md', 'exec'), {})  # noqa: S102 - the document's own example

    region, reward = capsys.readouterr().out.split()
    assert (region == 'FRONT/NEAR') == (float(reward) == 1.0)
