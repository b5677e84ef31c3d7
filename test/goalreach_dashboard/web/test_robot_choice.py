"""One page for the robots of a domain, in a real browser."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from pathlib import Path
import time

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
import pytest
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from browser import require_browser
from goalreach_lab.rigs.chromium import open_page
from goalreach_msgs_py.diagnostic_messages import state_to_raw
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.topics import HEAD_JOINTS
from goalreach_msgs_py.values import Confidence, Pose2, RegionState
import graphs

LIMIT_S = 90.0
ONES = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
REGIONS = {'robot1': (0, 0), 'robot2': (2, 1)}


def raw_state(name: str) -> bytes:
    i, j = REGIONS[name]
    state = RegionState(
        region=(i, j),
        mu_x=ONES[i],
        mu_y=ONES[j],
        pose=Pose2(x_m=1.0, y_m=1.0, heading_rad=0.0),
        goal_probability=0.0,
        confidence=Confidence.OK,
    )
    return state_to_raw(state, time.monotonic_ns())


@pytest.mark.graph
def test_the_page_shows_the_robot_that_is_chosen(tmp_path: Path) -> None:
    require_browser()
    domain = graphs.fresh_domain()
    with ExitStack() as stack:
        node, serve_until = stack.enter_context(graphs.onlooker(domain))
        states = {
            name: node.create_publisher(DiagnosticArray, f'/{name}/state', 1) for name in REGIONS
        }
        truth = node.create_publisher(Odometry, '/robot1/ground_truth/odom', 1)
        joints = node.create_publisher(JointState, '/robot1/joint_states', 1)
        node.create_publisher(String, '/other/state', 1)  # of another type: no robot
        events = tmp_path / 'events.jsonl'
        events.write_text('{"event": "begin", "arenas": [], "policies": []}\n')
        words = ['dashboard', '--port', '0', '--robot', 'robot1', '--events', str(events)]
        process = stack.enter_context(graphs.goalreach(words, domain=domain, home=tmp_path))
        assert process.stdout is not None
        url = process.stdout.readline().removeprefix('live page: ').strip()
        page = stack.enter_context(open_page(url, width=1366))

        def shows(name: str, status: str) -> bool:
            for each, publisher in states.items():
                publisher.publish(raw_state(each))
            truth.publish(Odometry())
            joints.publish(JointState(name=[*HEAD_JOINTS], position=[0.0, 0.0, 0.0]))
            region = f'in {region_name(REGIONS[name], (3, 3))}'
            turret = page.find('turret').value_of_css_property('visibility')
            found = (page.text('region'), page.text('status'), turret)
            return found == (region, status, 'visible' if name == 'robot1' else 'hidden')

        assert serve_until(lambda: shows('robot1', 'coming up: 2 of 4 nodes'), LIMIT_S)
        assert serve_until(page.find('robot-choice').is_displayed, LIMIT_S)
        options = page.find('robot-choice').find_elements('tag name', 'option')
        assert [option.text for option in options] == ['robot1', 'robot2']
        with events.open('a') as file:
            file.write('{"event": "end", "reason": "stopped"}\n')
        assert page.until(lambda: page.text('status') == 'run ended')
        for name, status in (('robot2', 'coming up: 1 of 4 nodes'), ('robot1', 'run ended')):
            page.find('robot-choice').find_element('css selector', f'[value={name}]').click()
            assert serve_until(partial(shows, name, status), LIMIT_S)
        assert page.errors() == []
