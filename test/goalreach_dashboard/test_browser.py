"""The page of a real run, in a real browser."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
from dataclasses import dataclass
import functools
import http.client
import json
import math
import os
from pathlib import Path
import re
import signal
import subprocess
from typing import Any
from urllib.parse import urlsplit

from geometry_msgs.msg import PoseWithCovarianceStamped
import psutil
import pytest
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

import axe
from browser import require_browser
from goalreach_lab.rigs.chromium import Page, open_page
from goalreach_lab.rigs.processes import find_descendant
from goalreach_msgs_py.pose_messages import estimate_from_raw
from goalreach_msgs_py.ros.messaging import stamp_from_msg
import graphs

webdriver = pytest.importorskip('selenium.webdriver')
connect: Any = pytest.importorskip('websockets.sync.client').connect
ConnectionClosed: Any = pytest.importorskip('websockets.exceptions').ConnectionClosed
ActionChains, Keys = webdriver.ActionChains, webdriver.Keys
pytestmark = pytest.mark.graph

_DEEP = QoSProfile(depth=500)
_CERTAIN_M = 0.1
_FOCUSED = """
const each = document.activeElement, style = getComputedStyle(
  each.type === 'radio' ? each.nextElementSibling : each);
return [each.closest('[data-testid]')?.dataset.testid,
  each === document.body
    || (style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2)];
"""
_CONTRASTS = """
const light = (colour) => {
  const [r, g, b] = colour.match(/[\\d.]+/g).map(Number).map((c) => c / 255)
    .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
const style = getComputedStyle;
const floor = document.querySelector('.floor');
const behind = (each) => light(each.closest('.arena') ? style(floor).fill
  : style(each.closest('.panel')).backgroundColor);
const texts = [...document.querySelectorAll('.panel svg:not(.camera) text')]
  .map((each) => ['text', each.textContent, ratio(light(style(each).fill), behind(each))]);
const arrows = [...document.querySelectorAll('.arrow, .commanded')]
  .map((each) => ['arrow', each.classList[0], ratio(light(style(each).stroke), behind(each))]);
return [...texts, ...arrows];
"""
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
        printed: What it had printed by then.
        node: An onlooker in the graph.
        serve_until: Serves the onlooker.
    """

    process: subprocess.Popen[str]
    url: str
    printed: list[str]
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
        url, printed = _link(process)
        yield Run(process=process, url=url, printed=printed, node=node, serve_until=serve_until)


def _link(process: subprocess.Popen[str]) -> tuple[str, list[str]]:
    assert process.stdout is not None
    printed: list[str] = []
    for line in process.stdout:
        found = re.search(r'live page: (http://\S+)', line)
        if found:
            return found[1], printed
        printed.append(line)
    raise AssertionError(''.join(printed))


@pytest.fixture(scope='module')
def page(run: Run) -> Iterator[Page]:
    with open_page(run.url, width=1366) as page:
        assert page.until(lambda: page.text('status') == 'driving'), page.text('status')
        yield page


def test_the_token_leaves_the_address_and_is_in_no_cookie(page: Page) -> None:
    assert 'token' not in page.driver.current_url
    assert page.driver.get_cookies() == []


def test_the_link_comes_before_the_nodes(run: Run) -> None:
    assert not any('is up' in line or line.startswith('path ') for line in run.printed)


def test_the_robot_moves(page: Page) -> None:
    before = page.find('robot').get_attribute('transform')
    assert page.until(lambda: page.find('robot').get_attribute('transform') != before)
    assert page.until(lambda: page.find('image').get_attribute('href') is not None)
    assert page.until(lambda: page.text('camera-note').endswith('of 3 LEDs'))
    assert page.until(lambda: page.text('votes') != '')


def test_the_estimate_is_the_topics(run: Run, page: Page) -> None:
    messages: list[Any] = []
    graphs.collect(run.node, PoseWithCovarianceStamped, '/pose', _DEEP, messages)
    assert run.serve_until(lambda: len(messages) > 3, 90.0)
    page.driver.execute_script(_WATCH)
    run.serve_until(lambda: len(messages) > 60, 90.0)
    seen = page.driver.execute_script('return window.seen')
    poses = {
        stamp_from_msg(m.header.stamp): estimate_from_raw(serialize_message(m)).pose
        for m in messages
    }
    compared = [row for row in seen if int(row[0]) in poses]
    assert len(compared) >= 5
    for stamp, *texts in compared:
        pose = poses[int(stamp)]
        shown = [float(text.rstrip(' m°')) for text in texts]
        assert shown[:2] == pytest.approx([pose.x_m, pose.y_m], abs=0.00051)
        assert shown[2] == pytest.approx(math.degrees(pose.heading_rad), abs=0.056)


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


def press(page: Page, x_cm: float, y_cm: float) -> Any:  # noqa: ANN401 - Selenium has no types
    """Begin an action with a press on a point of the arena's picture."""
    arena = page.find('arena')
    x, y = page.driver.execute_script(
        'const [arena, x, y] = arguments, box = arena.getBoundingClientRect();'
        'const at = new DOMPoint(x, y).matrixTransform(arena.getScreenCTM());'
        'return [at.x - box.x - box.width / 2, at.y - box.y - box.height / 2];',
        arena,
        x_cm,
        y_cm,
    )
    chains = ActionChains(page.driver)
    return chains.move_to_element_with_offset(arena, round(x), round(y)).click_and_hold()


def pose_fields(page: Page) -> list[float]:
    names = ('place-x', 'place-y', 'place-heading')
    return [float(page.find(name).get_property('value')) for name in names]


def test_one_step_is_one_image(page: Page) -> None:
    assert not page.find('step').is_enabled()
    page.find('pause').click()
    assert page.until(lambda: page.text('status') == 'paused')
    before = page.text('sim-time')
    for _ in range(3):
        page.find('step').click()
        assert page.until(lambda: page.text('answer') == 'advanced by one image')
        page.driver.execute_script('document.querySelector("[data-testid=answer]").textContent=""')
    seconds = [float(text.removesuffix(' s')) for text in (before, page.text('sim-time'))]
    assert page.until(lambda: float(page.text('sim-time').removesuffix(' s')) > seconds[0])
    assert float(page.text('sim-time').removesuffix(' s')) - seconds[0] < 0.3
    assert page.text('status') == 'paused'


def test_placing_while_paused_is_shown_at_once(page: Page) -> None:
    """And while one drags, a preview shows the pose that the form holds."""
    if page.text('status') != 'paused':
        page.find('pause').click()
    assert page.until(lambda: page.text('status') == 'paused')
    page.find('place-switch').click()
    assert page.until(page.find('pose-form').is_displayed)
    assert pose_fields(page) == [1.78, 2.54, -90.0]
    press(page, 260, 108).move_by_offset(-60, 0).perform()
    assert page.find('preview').get_attribute('visibility') == 'visible'
    assert pose_fields(page) == pytest.approx([2.60, 4.00, 180.0], abs=0.03)
    ActionChains(page.driver).release().perform()
    assert page.until(lambda: page.text('answer').startswith('at '))
    assert re.fullmatch(r'at 2\.\d\d m, \d\.\d\d m, 180°', page.text('answer'))
    assert page.until(lambda: abs(page.metres('truth-x') - 2.60) < 0.03)
    assert page.text('truth-heading') == '180.0°'
    assert page.text('status') == 'paused'
    assert not page.find('pose-form').is_displayed()
    assert page.find('preview').get_attribute('visibility') == 'hidden'
    page.find('pause').click()
    assert page.until(lambda: page.text('status') == 'driving')


def test_escape_leaves_placing_and_places_nothing(page: Page) -> None:
    page.find('place-switch').click()
    press(page, 100, 108).perform()
    answer = page.text('answer')
    ActionChains(page.driver).send_keys(Keys.ESCAPE).release().perform()
    assert not page.find('pose-form').is_displayed()
    assert page.find('preview').get_attribute('visibility') == 'hidden'
    assert page.text('answer') == answer


def test_what_makes_no_sense_is_refused(page: Page) -> None:
    """The browser checks the range of a field; the page checks the rest."""
    page.find('place-switch').click()
    field = page.find('place-x')
    assert page.until(field.is_displayed)
    field.send_keys(Keys.CONTROL, 'a')
    field.send_keys('0.05', Keys.ENTER)
    assert page.until(lambda: page.text('answer').startswith('refused: '))
    assert 'on the free floor' in page.text('answer')
    ActionChains(page.driver).send_keys(Keys.ESCAPE).perform()


def test_modes_are_chosen_and_shown(page: Page) -> None:
    page.choose('mode-choice', 'crisp')
    assert page.until(lambda: page.text('mode') == 'crisp')
    assert page.until(lambda: page.text('decision-note').startswith('crisp'))
    page.choose('mode-choice', 'fuzzy')
    assert page.until(lambda: page.text('mode') == 'fuzzy')
    for speed in ('0.5×', '2×'):  # faster, a slow machine falls behind
        page.choose('speed-choice', speed)
        assert page.shows('speed', speed), page.text('answer')


def test_noise_is_chosen_while_it_runs(run: Run, page: Page) -> None:
    # In this order: to choose what the page shows as chosen says nothing.
    _choose_noise(run, page, 'harsh')
    _choose_noise(run, page, 'nominal')


def _choose_noise(run: Run, page: Page, preset: str) -> None:
    page.choose('noise-choice', preset)
    assert page.shows('answer', f'noise: {preset}'), page.text('answer')
    assert page.until(lambda: page.chosen('noise-choice') == preset)
    messages: list[Any] = []
    graphs.collect(run.node, PoseWithCovarianceStamped, '/pose', _DEEP, messages)
    assert run.serve_until(
        lambda: bool(messages) and messages[-1].pose.covariance[0] < _CERTAIN_M**2, 90.0
    )


def test_angles_have_one_sign_convention_and_zero_no_sign(page: Page) -> None:
    shown = ''

    def angles() -> list[str]:
        nonlocal shown
        shown = page.driver.execute_script('return document.querySelector("main").textContent')
        return re.findall(r'(-?\d+(?:\.\d+)?)°', shown)

    assert page.until(lambda: len(angles()) > 25)  # 20 while there is no pose
    assert all(-180.0 < float(angle) <= 180.0 for angle in angles())
    assert re.findall(r'-0(?:\.0+)?(?![.\d])', shown) == []


def test_every_figure_is_explained(page: Page) -> None:
    """On hover and on focus, with a link that the keyboard reaches, in words of help.html."""
    buttons = page.driver.find_elements('css selector', 'button.term')
    terms = [button for button in buttons if button.is_displayed()]
    assert len(terms) >= 25
    tip = page.find('tip')
    for term in terms:
        page.driver.execute_script('arguments[0].focus()', term)
        key = term.get_attribute('data-term')
        assert page.until(functools.partial(explains, page, key)), key
        assert len(tip.text) > 30, key
    ActionChains(page.driver).send_keys(Keys.TAB).perform()
    link = page.driver.switch_to.active_element
    assert link.get_attribute('href').startswith(f'http://127.0.0.1:{page_port(page)}/help.html#')
    ActionChains(page.driver).send_keys(Keys.ESCAPE).perform()
    assert not tip.is_displayed()
    ActionChains(page.driver).move_to_element(
        page.driver.find_elements('css selector', 'dt .term')[0]
    ).perform()
    assert page.until(tip.is_displayed)
    ActionChains(page.driver).move_to_element(page.find('curve')).perform()
    assert page.until(lambda: not tip.is_displayed())


def explains(page: Page, key: str) -> bool:
    return page.find('tip').is_displayed() and f'#{key}"' in page.find('tip').get_property(
        'innerHTML'
    )


def page_port(page: Page) -> str:
    return str(page.driver.execute_script('return location.port'))


def test_pictures_are_described_and_announced_only_when_asked(page: Page) -> None:
    pictures = page.driver.find_elements('css selector', 'main > * svg[role=img]')
    assert pictures
    for picture in pictures:
        described = picture.get_attribute('aria-describedby')
        words = page.driver.execute_script(
            'return document.getElementById(arguments[0])', described
        )
        assert words.get_property('textContent'), described
        live = page.driver.execute_script(
            'return arguments[0].closest("[role=status], [aria-live]")', words
        )
        assert live is None
    assert 'The robot is at' in page.text('say-arena')
    assert page.text('description') == ''
    page.find('describe').click()
    assert 'The robot is at' in page.text('description')


def test_the_error_is_drawn_with_its_band(page: Page) -> None:
    assert page.until(
        lambda: (page.find('error-line').get_attribute('points') or '').count(',') > 5
    )
    assert (page.find('error-band').get_attribute('d') or '').count('L') > 5


def test_q_values_are_a_heat_map(page: Page) -> None:
    rows = page.find('q-table').find_elements('css selector', 'tbody tr')
    assert len(rows) == 8  # the goal has none
    values = [
        [float(cell.text) for cell in row.find_elements('css selector', 'td')] for row in rows
    ]
    assert {len(row) for row in values} == {8}
    best = [row.find_elements('css selector', 'td.best') for row in rows]
    assert [float(first.text) for first, *_ in best] == [max(row) for row in values]
    assert page.find('q-table').find_elements('css selector', '.plus-9')


def test_settings_are_kept_over_a_reload(page: Page) -> None:
    page.choose('theme', 'dark')
    page.find('q-values').click()
    page.driver.refresh()
    assert page.until(lambda: page.text('status') == 'driving')
    assert page.find('q-values').is_selected()
    assert page.find('q-charts').value_of_css_property('display') != 'none'
    assert page.driver.execute_script('return document.documentElement.dataset.theme') == 'dark'
    assert page.find('pause').is_displayed()  # it still steers
    page.find('q-values').click()
    page.choose('theme', 'auto')


def test_the_whole_page_is_used_by_the_keyboard_alone(page: Page) -> None:
    """Every control is reached by Tab and shows it; the commonest have keys."""
    assert page.until(lambda: page.find('paths-rows').text)  # what a path leaves has controls, too
    page.driver.execute_script('document.activeElement.blur(); window.scrollTo(0, 0);')
    reached, unseen = set(), set()
    for _ in range(100):
        page.driver.switch_to.active_element.send_keys(Keys.TAB)
        name, outlined = page.driver.execute_script(_FOCUSED)
        reached.add(name)
        unseen |= set() if outlined else {name}
    wanted = {'pause', 'place-switch', 'record', 'mode-choice', 'speed-choice', 'noise-choice'}
    wanted |= {'theme', 'q-values', 'describe', 'keys', 'run-summary', 'replay', 'save-json'}
    assert wanted <= reached
    assert unseen == set()
    body = page.driver.find_element('css selector', 'body')
    page.driver.execute_script('document.activeElement.blur()')
    body.send_keys(' ')
    assert page.until(lambda: page.text('status') == 'paused')
    time_before = page.text('sim-time')
    for _ in range(4):
        body.send_keys('s')
    assert page.until(lambda: page.text('sim-time') != time_before)
    body.send_keys('?')
    assert page.until(page.find('keys-dialog').is_displayed)
    ActionChains(page.driver).send_keys(Keys.ESCAPE).perform()
    assert not page.find('keys-dialog').is_displayed()
    page.find('place-switch').send_keys(Keys.ENTER)
    page.find('place-x').send_keys(Keys.CONTROL, 'a')
    page.find('place-x').send_keys('1.2', Keys.ENTER)
    assert page.until(lambda: page.text('answer').startswith('at 1.20 m'))
    radio = page.find('mode-choice').find_element('css selector', 'input:checked')
    radio.send_keys(Keys.ARROW_LEFT)
    assert page.until(lambda: page.text('mode') == 'crisp')
    radio = page.find('mode-choice').find_element('css selector', 'input:checked')
    radio.send_keys(Keys.ARROW_RIGHT)
    assert page.until(lambda: page.text('mode') == 'fuzzy')
    page.driver.execute_script('document.activeElement.blur()')
    body.send_keys(' ')
    assert page.until(lambda: page.text('status') == 'driving')


@pytest.mark.parametrize('width', [1366, 820, 390])
def test_axe_finds_nothing(page: Page, width: int) -> None:
    """Where it asks for a review, it could not compute a contrast: see the next test."""
    page.driver.execute_script(
        'for (const each of document.querySelectorAll("details")) each.open = true'
    )
    try:
        for scheme in ('light', 'dark', 'forced'):
            axe.emulate(page, width=width, scheme=scheme)
            found = axe.check(page)
            assert found['violations'] == [], (width, scheme)
            doubts = {text.partition(':')[0] for text in found['incomplete']}
            assert doubts <= {'color-contrast'}, (width, scheme)
            wide = page.driver.execute_script(
                'return document.documentElement.scrollWidth - innerWidth'
            )
            assert wide <= 0, (width, scheme)
    finally:
        axe.emulate(page, width=1366, scheme='light')


@pytest.mark.parametrize('scheme', ['light', 'dark', 'forced'])
def test_a_node_that_is_down_can_be_read(page: Page, scheme: str) -> None:
    axe.emulate(page, width=1366, scheme=scheme)
    try:
        # A copy of each: the page changes its own as soon as the node speaks.
        page.driver.execute_script(
            'for (const each of document.querySelectorAll(".node, .chip")) {'
            ' const copy = each.cloneNode(true);'
            ' copy.classList.add("down", "copy"); copy.classList.remove("up", "quiet", "ended");'
            ' each.after(copy); }'
        )
        found = axe.check(page)
        assert [text for text in found['violations'] if text.startswith('color')] == []
    finally:
        page.driver.execute_script(
            'for (const each of document.querySelectorAll(".copy")) each.remove()'
        )
        axe.emulate(page, width=1366, scheme='light')


@pytest.mark.parametrize('scheme', ['light', 'dark'])
def test_texts_and_arrows_of_the_pictures_stand_out(page: Page, scheme: str) -> None:
    """What axe-core leaves to a review: texts on drawings, 4.5 to 1, and arrows, 3 to 1."""
    axe.emulate(page, width=1366, scheme=scheme)
    try:
        contrasts = page.driver.execute_script(_CONTRASTS)
        assert contrasts
        for kind, text, ratio in contrasts:
            assert ratio >= (4.5 if kind == 'text' else 3.0), (kind, text)
    finally:
        axe.emulate(page, width=1366, scheme='light')


def test_pause_is_in_reach_on_a_phone(page: Page) -> None:
    axe.emulate(page, width=390, scheme='light')
    try:
        for place in ('0', 'document.body.scrollHeight'):
            page.driver.execute_script(f'window.scrollTo(0, {place})')
            box = page.driver.execute_script(
                'return arguments[0].getBoundingClientRect().toJSON()', page.find('pause')
            )
            assert 0 <= box['top'] < box['bottom'] <= 800
            assert box['height'] >= 24
    finally:
        axe.emulate(page, width=1366, scheme='light')


def test_reduced_motion_is_meant(page: Page) -> None:
    """Two frames a second instead of twenty."""
    calm = {'features': [{'name': 'prefers-reduced-motion', 'value': 'reduce'}]}
    page.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', calm)
    page.count_frames()
    assert page.until(lambda: page.frames() >= 4)
    assert page.frames_per_s() < 5.0
    page.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': []})


def test_the_first_load_is_small(page: Page) -> None:
    page.driver.refresh()
    assert page.until(lambda: page.text('status') == 'driving')
    loaded = page.driver.execute_script(
        'return performance.getEntries().filter((e) => e.encodedBodySize)'
        '.map((e) => e.encodedBodySize).reduce((a, b) => a + b)'
    )
    assert 30_000 < loaded < 350_000


def test_without_the_token_the_page_is_read_only(run: Run) -> None:
    with open_page(f'http://127.0.0.1:{run.port}/') as other:
        assert other.until(lambda: other.text('status') == 'driving')
        assert other.find('read-only').is_displayed()
        assert not other.find('pause').is_displayed()
        # Whoever shows the controls by force is refused by the server.
        other.driver.execute_script(
            'const all = document.querySelector("[data-testid=steering]");'
            'all.hidden = all.disabled = false'
        )
        other.find('pause').click()
        assert not other.until(lambda: other.text('status') == 'paused', 1.0)
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
    connection.request('GET', '/live', headers={**upgrade, **headers})
    answer = connection.getresponse()
    connection.close()
    assert answer.status == status


def test_nothing_left_the_machine_and_nothing_went_wrong(page: Page) -> None:
    assert page.errors() == []
    assert page.hosts() == {'127.0.0.1'}


def test_clients_that_do_not_read_cost_nothing(run: Run, page: Page) -> None:
    """They ask for frame after frame, and read none: each gets one until its buffers are full."""
    pid = find_descendant(run.process.pid, 'dashboard')
    memory = psutil.Process(pid).memory_info
    origin = f'http://127.0.0.1:{run.port}'
    address = f'ws://127.0.0.1:{run.port}/live'
    with contextlib.ExitStack() as stack:
        clients = [
            stack.enter_context(connect(address, origin=origin, max_queue=1, close_timeout=0))
            for _ in range(20)
        ]
        for client in clients:
            client.send('{"token": null}')
        before = memory().rss
        for _ in range(100):
            for client in clients:
                client.send('{"next": true}')
            page.driver.execute_async_script('setTimeout(arguments[0], 50)')
        assert memory().rss - before < 20e6
        page.count_frames()
        assert page.until(lambda: page.frames() >= 20)


@pytest.mark.parametrize('sent', ['', '[]', '{"token": 1', '{"token": null}{', 'x' * 20_000])
def test_who_sends_what_no_page_sends_is_disconnected(run: Run, sent: str) -> None:
    origin = f'http://127.0.0.1:{run.port}'
    with connect(f'ws://127.0.0.1:{run.port}/live', origin=origin) as client:
        client.send(sent)
        with pytest.raises(ConnectionClosed):
            client.recv(timeout=20.0)


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


def test_a_page_for_other_machines_is_seen_with_its_token_only(tmp_path: Path) -> None:
    """127.0.0.2 is none of the names of this machine, so the page counts as one for others."""
    arguments = ['dashboard', '--host', '127.0.0.2', '--port', '0']
    with graphs.goalreach(arguments, domain=graphs.fresh_domain(), home=tmp_path) as process:
        link = urlsplit(_link(process)[0])
        for token in (None, 'wrong', link.fragment.removeprefix('token=')):
            with connect(f'ws://{link.netloc}/live', origin=f'http://{link.netloc}') as client:
                client.send(json.dumps({'token': token}))
                if token is None or token == 'wrong':  # noqa: S105 - it is none
                    with pytest.raises(ConnectionClosed):
                        client.recv(timeout=20.0)
                else:
                    assert json.loads(client.recv(timeout=20.0))['hello']['steers'] is False


def test_a_lost_connection_is_shown_and_made_again(tmp_path: Path) -> None:
    """The page of a graph that does not run, killed and served again on its port."""
    domain = graphs.fresh_domain()
    arguments = ['dashboard', '--port', '0']
    with contextlib.ExitStack() as stack:
        process = stack.enter_context(graphs.goalreach(arguments, domain=domain, home=tmp_path))
        url, _ = _link(process)
        page = stack.enter_context(open_page(url))
        assert page.until(lambda: page.text('status') == 'waiting for a graph')
        assert page.find('read-only').is_displayed()
        process.kill()
        assert page.until(lambda: page.text('status') == 'connection lost')
        assert 'grayscale' in page.find('nodes').value_of_css_property('filter')
        arguments[-1] = str(urlsplit(url).port)
        stack.enter_context(graphs.goalreach(arguments, domain=domain, home=tmp_path))
        assert page.until(lambda: page.text('status') == 'waiting for a graph')
        assert page.find('nodes').value_of_css_property('filter') == 'none'


def test_a_killed_launcher_ends_the_run_on_the_page(run: Run, page: Page) -> None:
    run.process.kill()
    assert page.until(lambda: page.text('status') == 'run ended')
    assert_ended(page)
    assert 'its launcher ended' in page.text('paths-note')


def assert_ended(page: Page) -> None:
    """What an ended run looks like: grey, still, without controls, with its summary."""
    nodes = page.find('nodes').find_elements('css selector', 'li')
    assert {node.get_attribute('class') for node in nodes} == {'node ended'}
    assert 'grayscale' in page.find('nodes').value_of_css_property('filter')
    for name in ('pause', 'step', 'place-switch'):
        assert not page.find(name).is_enabled(), name
    assert page.find('save-csv').is_enabled() == bool(page.text('paths-rows'))
