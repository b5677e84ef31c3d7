"""The floors and the probe, over real DDS."""

import pytest

from goalreach_lab.rigs.graph_test_rig import GraphTestRig
from graphs import fresh_domain

pytestmark = pytest.mark.graph


@pytest.fixture(autouse=True)
def _domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_DOMAIN_ID', str(fresh_domain()))


@pytest.mark.parametrize('composed', [False, True])
def test_the_relay_ticks_in_lockstep(*, composed: bool) -> None:
    with GraphTestRig.open() as rig, rig.relay('lockstep', composed=composed):
        seen = rig.measure('ticks', 0.2)
    first_ns, last_ns = seen['stamps_ns']
    assert last_ns - first_ns > 0
    assert (last_ns - first_ns) % 40_000_000 == 0


def test_the_relay_answers_images_in_real_time() -> None:
    with GraphTestRig.open() as rig, rig.relay('realtime'):
        seen = rig.measure('latency', 0.5)
    assert seen['took_ms']
    assert min(seen['took_ms']) > 0.0


def test_bare_nodes_are_found_after_they_were_started() -> None:
    with GraphTestRig.open() as rig, rig.probe('nodes', 4) as probe:
        assert probe.read() == {'listens': True}
        with rig.bare_nodes() as pids:
            assert len(pids) == 4
            assert probe.read()['at_s'] > rig.began_s
