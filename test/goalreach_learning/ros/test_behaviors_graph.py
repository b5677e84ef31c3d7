"""A graph among obstacles over real DDS: `/sonar`, `/behaviors`, and a goal."""

import math
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
import pytest
from sensor_msgs.msg import LaserScan

from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, SENSOR_QOS
import graphs

pytestmark = pytest.mark.graph

ARENA = """
name: one
width_m: 3.556
length_m: 5.08
leds_m: [[0.889, 0.0, 1.4224], [1.778, 0.508, 1.8288], [2.667, 0.0, 1.6256]]
regions: {x_borders_m: [1.1811, 2.3749], y_borders_m: [1.6891, 3.3909],
  transition_width_m: 0.508, goal: FRONT/NEAR}
starts: [{x_m: 1.75, y_m: 4.2, heading_deg: -90}]
obstacles: [{x_m: 1.75, y_m: 2.9, radius_m: 0.2, height_m: 0.6}]
"""


def test_a_graph_drives_round_what_its_sonar_hears(tmp_path: Path) -> None:
    domain, arena = graphs.fresh_domain(), tmp_path / 'arena.yaml'
    arena.write_text(ARENA)
    scans: list[LaserScan] = []
    opinions: list[DiagnosticArray] = []
    words = ['run', '--arena', str(arena), '--policy', 'paper', '--paths', '1', '--seed', '3']
    words += ['--clock', 'lockstep', '--no-dashboard']
    words += ['--behaviors', 'first(escape, blend(avoid, patience, goal))']
    with graphs.onlooker(domain) as (node, serve_until):
        node.create_subscription(LaserScan, 'sonar', scans.append, SENSOR_QOS)
        node.create_subscription(DiagnosticArray, 'behaviors', opinions.append, RELIABLE_QOS)
        with graphs.goalreach(words, domain=domain, home=tmp_path) as run:
            assert serve_until(lambda: run.poll() is not None, 90.0)
            assert run.stdout is not None
            printed = run.stdout.read()
            assert run.returncode == 0, printed
    assert '1 of 1 paths reached the goal' in printed
    # The cylinder's surface is 0.2 m before its middle, 1.3 m ahead of the start.
    assert len(scans[0].ranges) == 16
    assert scans[0].header.frame_id == 'bumper_link'
    assert any(scan.ranges[0] == pytest.approx(1.1, rel=0.05) for scan in scans)
    heard = {
        (status.name, value.value)
        for message in opinions
        for status in message.status
        for value in status.values
        if value.key == 'heard'
    }
    assert {('goal', 'true'), ('avoid', 'true'), ('avoid', 'false'), ('escape', 'false')} <= heard
    names = [status.name for status in opinions[0].status]
    assert names == ['escape', 'avoid', 'patience', 'goal']
    headings = {
        float(value.value)
        for message in opinions
        for status in message.status
        for value in status.values
        if status.name == 'avoid' and value.key == 'heading_rad'
    }
    assert headings
    assert all(-math.pi < heading <= math.pi for heading in headings)
