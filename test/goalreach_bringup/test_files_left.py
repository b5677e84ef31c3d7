"""What commands leave behind is what `docs/how-to/install.md` tells how to remove."""

from pathlib import Path
import subprocess
import sys

import pytest

from goalreach_bringup.launch.environment import _RUN_DIRECTORY
import graphs

ROOT = Path(__file__).parents[2]
COMMANDS = (
    'run --paths 1 --clock lockstep --policy paper --record bag',
    'replay bag --rate 20',
    'bag info bag',
    'bag compare bag bag',
    'train --out policy.json',
    'evaluate --starts random:1',
    'figures --policy policy.json --format svg --out figures',
    'ros2 topic list --spin-time 1',
    'doctor',
)
RECORDING = 'record second --max-duration 1'
ASKED_FOR = {'bag', 'policy.json', 'figures'}


@pytest.mark.graph
def test_commands_leave_logs_of_runs_and_a_font_list(tmp_path: Path) -> None:
    home, temporary, work = tmp_path / 'home', tmp_path / 't', tmp_path / 'work'
    for folder in (home, temporary, work):
        folder.mkdir()
    environment = graphs.graph_environment(graphs.fresh_domain(), home)
    for name in ('ROS_LOG_DIR', 'ROS_HOME', 'XDG_CACHE_HOME', 'XDG_CONFIG_HOME', 'MPLCONFIGDIR'):
        environment.pop(name, None)
    environment |= {'HOME': str(home), 'TMPDIR': str(temporary)}
    for command in COMMANDS:
        subprocess.run(
            [sys.executable, '-m', 'goalreach_bringup.cli', *command.split()],
            cwd=work,
            env=environment,
            check=True,
            stdout=subprocess.DEVNULL,
        )

    assert {path.name for path in work.iterdir()} == ASKED_FOR
    assert list(temporary.iterdir()) == []
    left = {path.relative_to(home) for path in home.glob('*/*')}
    fonts = {Path('.cache/matplotlib'), Path('.config/matplotlib')}
    assert left <= {Path('.ros/log'), *fonts}
    logs = [path.name for path in (home / '.ros' / 'log').iterdir()]
    assert len(logs) == 1
    assert _RUN_DIRECTORY.fullmatch(logs[0])
    told = (ROOT / 'docs' / 'how-to' / 'install.md').read_text().partition('## Remove')[2]
    for path in ('~/.ros/log/goalreach-*', *(f'~/{path}' for path in fonts)):
        assert f'`{path}`' in told
