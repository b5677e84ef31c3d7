import pytest

from goalreach_lab.localization.speed_study import InterleavedTimings, speed_study
from goalreach_msgs_py.values import Pose2


def test_rows_by_hand() -> None:
    def figures(value: float) -> dict[str, float]:
        return dict.fromkeys(('rms', 'median', 'p95', 'max'), value)

    peer_name = 'SimpleBlobDetector + solveP3P'
    names = ('ours, tracking', 'ours, head command', 'ours, one image', peer_name)
    found = {
        'frames': 5,
        'ms': dict(zip(names, map(figures, (0.2, 0.1, 1.3, 0.6)), strict=True)),
        'in': dict(zip(names, map(figures, (0.3, 0.0, 0.4, 0.6)), strict=True)),
    }
    rows = {row.name: row for row in speed_study(frames=5, seed=0).rows(found)}
    assert rows['acquisition, processor time, median'].ours == 1.3
    assert rows['head command, processor time, median'].ours == 0.1
    peer = rows['tracking frame, median, against SimpleBlobDetector + solveP3P']
    assert peer.ratio == pytest.approx(1.0 / 3.0)
    assert peer.met is True
    assert rows['position error of a single image, rms'].ratio == pytest.approx(2.0 / 3.0)


def test_only_images_that_every_method_solves_count() -> None:
    timings = InterleavedTimings()
    truth, near = (Pose2(x_m=x_m, y_m=1.0, heading_rad=0.0) for x_m in (1.0, 1.0254))
    assert timings.time('a', lambda: 7) == 7
    timings.discard()
    for method in 'aba':
        timings.time(method, lambda: None)
    timings.solve('a', near)
    timings.keep(truth)
    assert {method: len(values) for method, values in timings.ms.items()} == {'a': 1, 'b': 1}
    assert timings.errors_in == {'a': [pytest.approx(1.0)]}
