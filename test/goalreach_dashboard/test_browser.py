"""The page of a real run, in a real browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import http.client
import math
import os
import re
import signal
import subprocess
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
import pytest
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from browser import require_browser
from goalreach_dashboard.views.svg import degrees, metres
from goalreach_lab.rigs.chromium import Page, open_page
from goalreach_lab.rigs.processes import find_descendant
from goalreach_msgs_py.pose_messages import estimate_from_raw
from goalreach_msgs_py.ros.messaging import stamp_from_msg
import graphs

pytestmark = pytest.mark.graph

_DEEP = QoSProfile(depth=500)
_CERTAIN_M = 0.1
_WATCH = """
window.seen = [];
const text = (name) => document.querySelector(`[data-testid="${name}"]`).textContent;
const row = document.querySelector('[data-testid="estimate-row"]');
new MutationObserver(() => window.seen.push([row.dataset.stamp, text('estimate-x'),
  text('estimate-y'), text('estimate-heading-text')])).observe(row, {attributes: true});
"""


@dataclass
class Run:
    """A run with its page.

    Attributes:
        process: The launcher.
        url: The link that it printed.
        node: An onlooker in the graph.
        serve_until: Serves the onlooker.
    """

    process: subprocess.Popen[str]
    url: str
    node: Node
    serve_until: Callable[[Callable[[], bool], float], bool]

    @property
    def port(self) -> int:
        return int(re.findall(r':(\d+)/', self.url)[0])


@pytest.fixture(scope='module')
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Run]:
    require_browser()
    home = tmp_path_factory.mktemp('run')
    domain = graphs.fresh_domain()
    arguments = ['run', '--dashboard', '--clock', 'realtime', '--start', '0.6,4.5,-90']
    with (
        graphs.onlooker(domain) as (node, serve_until),
        graphs.goalreach(arguments, domain=domain, home=home) as process,
    ):
        yield Run(process=process, url=_link(process), node=node, serve_until=serve_until)


def _link(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    said = []
    for line in process.stdout:
        said.append(line)
        found = re.search(r'live page: (http://\S+)', line)
        if found:
            return found[1]
    raise AssertionError(''.join(said))


@pytest.fixture(scope='module')
def page(run: Run) -> Iterator[Page]:
    with open_page(run.url) as page:
        assert page.until(lambda: page.text('status') == 'driving'), page.text('status')
        yield page


def test_the_token_leaves_the_address(page: Page) -> None:
    assert 'token' not in page.driver.current_url


def test_the_robot_moves(page: Page) -> None:
    before = page.find('robot').get_attribute('transform')
    assert page.until(lambda: page.find('robot').get_attribute('transform') != before)
    assert page.until(lambda: page.find('image').get_attribute('href') is not None)
    assert page.until(lambda: page.text('camera-note').endswith('of 3 LEDs'))
    assert page.until(lambda: page.text('votes') != '')


def test_the_estimate_is_the_topics(run: Run, page: Page) -> None:
    messages: list[Any] = []
    graphs.collect(run.node, PoseWithCovarianceStamped, '/pose', _DEEP, messages)
    assert run.serve_until(lambda: len(messages) > 3, 10.0)
    page.driver.execute_script(_WATCH)
    run.serve_until(lambda: len(messages) > 60, 20.0)
    seen = page.driver.execute_script('return window.seen')
    poses = {
        stamp_from_msg(m.header.stamp): estimate_from_raw(serialize_message(m)).pose
        for m in messages
    }
    compared = [row for row in seen if int(row[0]) in poses]
    assert len(compared) >= 5
    for stamp, *texts in compared:
        pose = poses[int(stamp)]
        assert texts == [metres(pose.x_m), metres(pose.y_m), degrees(pose.heading_rad)]


def test_pause_stops_it_and_resume_goes_on(page: Page) -> None:
    page.find('pause').click()
    assert page.until(lambda: page.text('status') == 'paused')
    assert page.until(lambda: page.text('pause').strip() == 'Resume')
    assert page.until(lambda: page.text('word-nomad200') == 'responds, publishes nothing')
    stands = page.find('robot').get_attribute('transform'), page.text('sim-time')
    assert not page.until(lambda: page.text('sim-time') != stands[1], 0.5)
    assert page.find('robot').get_attribute('transform') == stands[0]
    page.find('pause').click()
    assert page.until(lambda: page.text('status') == 'driving')
    assert page.until(lambda: page.text('sim-time') != stands[1])


def test_place_puts_it_where_one_pressed(page: Page) -> None:
    from selenium.webdriver import ActionChains

    page.choose('speed-choice', '0.25×')
    assert page.until(lambda: page.text('speed') == '0.25×')
    page.find('place-switch').click()
    body = page.driver.find_element('css selector', 'body')
    assert page.until(lambda: 'placing' in body.get_attribute('class').split())
    arena = page.find('arena')
    x, y = page.driver.execute_script(
        'const box = arguments[0].getBoundingClientRect();'
        'const at = new DOMPoint(260, 108).matrixTransform(arguments[0].getScreenCTM());'
        'return [at.x - box.x - box.width / 2, at.y - box.y - box.height / 2];',
        arena,
    )
    actions = ActionChains(page.driver).move_to_element_with_offset(arena, round(x), round(y))
    actions.click_and_hold().move_by_offset(-60, 0).release().perform()
    assert page.until(lambda: page.text('answer').startswith('at '))
    numbers = [float(n) for n in re.findall(r'-?\d+\.\d+', page.text('answer'))]
    assert numbers == pytest.approx([2.60, 4.00, math.pi], abs=0.03)
    assert page.until(lambda: abs(page.metres('truth-x') - numbers[0]) < 0.3)
    assert abs(page.metres('truth-y') - numbers[1]) < 0.3
    page.choose('speed-choice', '1×')
    assert page.until(lambda: page.text('speed') == '1×')


def test_what_makes_no_sense_is_refused(page: Page) -> None:
    from selenium.webdriver.common.keys import Keys

    page.find('place-switch').click()
    field = page.find('place-x')
    assert page.until(field.is_displayed)
    field.send_keys(Keys.CONTROL, 'a')
    field.send_keys('99')
    page.find('place-button').click()
    assert page.until(lambda: page.text('answer').startswith('refused: '))
    assert 'on the free floor' in page.text('answer')
    assert page.metres('truth-x') < 4.0
    page.find('place-switch').click()


def test_modes_are_chosen_and_shown(page: Page) -> None:
    page.choose('mode-choice', 'crisp')
    assert page.until(lambda: page.text('mode') == 'crisp')
    assert page.until(lambda: page.text('decision-note').startswith('crisp'))
    page.choose('mode-choice', 'fuzzy')
    assert page.until(lambda: page.text('mode') == 'fuzzy')


@pytest.mark.parametrize('preset', ['harsh', 'nominal'])
def test_noise_is_chosen_while_it_runs(run: Run, page: Page, preset: str) -> None:
    page.choose('noise-choice', preset)
    assert page.until(lambda: page.text('answer') == f'noise: {preset}')
    messages: list[Any] = []
    graphs.collect(run.node, PoseWithCovarianceStamped, '/pose', _DEEP, messages)
    assert run.serve_until(
        lambda: bool(messages) and messages[-1].pose.covariance[0] < _CERTAIN_M**2, 20.0
    )


def test_q_values_are_shown_on_request(page: Page) -> None:
    charts = page.find('q-charts')
    assert charts.value_of_css_property('display') == 'none'
    page.find('q-values').click()
    assert page.until(lambda: charts.value_of_css_property('display') != 'none')
    page.find('q-values').click()


def test_every_control_is_reached_by_the_keyboard(page: Page) -> None:
    from selenium.webdriver.common.keys import Keys

    page.driver.execute_script('document.activeElement.blur(); window.scrollTo(0, 0);')
    reached = set()
    for _ in range(30):
        page.driver.switch_to.active_element.send_keys(Keys.TAB)
        reached.add(
            page.driver.execute_script(
                'return document.activeElement.closest("[data-testid]")?.dataset.testid'
            )
        )
    wanted = {'pause', 'place-switch', 'mode-choice', 'speed-choice', 'q-values', 'theme'}
    assert wanted <= reached


def test_without_the_token_the_page_is_read_only(run: Run) -> None:
    with open_page(f'http://127.0.0.1:{run.port}/') as other:
        assert other.until(lambda: other.text('status') == 'driving')
        assert other.has('read-only')
        assert not other.has('pause')
        assert other.errors() == []


@pytest.mark.parametrize(
    ('headers', 'status'),
    [
        ({'Origin': 'http://elsewhere.example'}, 403),
        ({'Host': 'elsewhere.example'}, 421),
        ({}, 403),
    ],
)
def test_websockets_of_other_origins_are_refused(
    run: Run, headers: dict[str, str], status: int
) -> None:
    connection = http.client.HTTPConnection('127.0.0.1', run.port, timeout=10.0)
    upgrade = {
        'Connection': 'Upgrade',
        'Upgrade': 'websocket',
        'Sec-WebSocket-Version': '13',
        'Sec-WebSocket-Key': 'AAAAAAAAAAAAAAAAAAAAAA==',
    }
    path = '/_nicegui_ws/socket.io/?EIO=4&transport=websocket'
    connection.request('GET', path, headers={**upgrade, **headers})
    answer = connection.getresponse()
    connection.close()
    assert answer.status == status


def test_nothing_left_the_machine_and_nothing_went_wrong(page: Page) -> None:
    assert page.errors() == []
    assert page.hosts() == {'127.0.0.1'}


def new_estimator(run: Run, page: Page, killed: list[int]) -> int:
    """Return the process of the state estimator once it is none of those that were killed."""
    found: list[int] = []

    def is_found() -> bool:
        pid = find_descendant(run.process.pid, 'state_estimator')
        found.extend([pid] if pid is not None and pid not in killed else [])
        return bool(found)

    assert page.until(is_found)
    return found[0]


def test_a_killed_node_turns_red(run: Run, page: Page) -> None:
    killed: list[int] = []
    # A first restart can be over before the page calls a node silent; a third one is delayed.
    for _ in range(3):
        killed.append(new_estimator(run, page, killed))
        os.kill(killed[-1], signal.SIGKILL)
    red = page.until(
        lambda: 'down' in page.find('node-state_estimator').get_attribute('class').split()
    )
    assert red
    assert 'silent' in page.text('status')
    assert page.until(lambda: page.text('status') == 'driving', 30.0)
