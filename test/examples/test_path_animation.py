"""The example of an animation writes a short GIF of two paths."""

from pathlib import Path
import subprocess
import sys

from PIL import Image, ImageSequence
import pytest

EXAMPLE = Path(__file__).parents[2] / 'examples' / 'path_animation.py'


@pytest.mark.slow
def test_the_animation_is_a_short_gif(tmp_path: Path) -> None:
    path = tmp_path / 'path.gif'
    subprocess.run([sys.executable, str(EXAMPLE), str(path)], timeout=100, check=True)
    assert path.stat().st_size < 600_000
    with Image.open(path) as image:
        frames = [frame.info['duration'] for frame in ImageSequence.Iterator(image)]
    assert len(frames) > 20
    assert sum(frames) == pytest.approx(60 * 80, abs=600)
