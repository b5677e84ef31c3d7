from pathlib import Path

import numpy as np
from PIL import Image, ImageSequence
import pytest

from goalreach_evaluation.figures.figure_file import write_animation
from goalreach_evaluation.figures.paper_figures import course_tracks
from goalreach_evaluation.figures.path_animation import animate, at_constant_speed
from goalreach_learning.training import train
from goalreach_msgs_py.arena import Arena


def test_the_robot_has_constant_speed_and_stops_at_the_end() -> None:
    """Three metres right and one up, in nine frames of half a metre for a longest path of 4."""
    points = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]])
    track = at_constant_speed(points, 4.0, 9)
    assert track[1] == pytest.approx([0.5, 0.0])
    assert track[-1] == pytest.approx([3.0, 1.0])
    late = at_constant_speed(points, 8.0, 9)
    assert late[4] == pytest.approx([3.0, 1.0])
    assert late[8] == pytest.approx([3.0, 1.0])


def test_an_animation_is_a_short_gif(tmp_path: Path) -> None:
    arena = Arena()
    tracks = course_tracks(arena, train(arena, rng=np.random.default_rng(7)).policy)
    courses = {name: track.points_m for name, track in tracks.items()}
    path = write_animation(animate(arena, courses, 'Two paths'), tmp_path / 'new', 'path')
    assert path.name == 'path.gif'
    assert path.stat().st_size < 600_000
    with Image.open(path) as image:
        assert image.info['duration'] == pytest.approx(80, abs=10)
        assert sum(1 for _ in ImageSequence.Iterator(image)) > 40
