"""The `ros2` words as processes."""

import subprocess
import sys

ROS2 = [sys.executable, '-m', 'goalreach_bringup.cli', 'ros2']


def ros2(environment: dict[str, str], *arguments: str) -> tuple[int, str, str]:
    """Run a command to its end; return its exit status, and what it wrote to stdout and stderr."""
    done = subprocess.run(
        [*ROS2, *arguments],
        env=environment,
        capture_output=True,
        check=False,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stdout, done.stderr
