"""The controls: what a person may press, and what the graph answers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
import math
from typing import Any, Final

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from goalreach_dashboard.exchange import Board
from goalreach_dashboard.requests import (
    SPEEDS,
    PauseRequest,
    Request,
    mode_request,
    noise_request,
    place_request,
    place_request_from_picture,
    speed_request,
)
from goalreach_learning.blending import MODES
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NOISE_PRESETS

_PATIENCE_S: Final = 3.0
_THEMES: Final = {'auto': None, 'light': False, 'dark': True}


class Controls:
    """One page's controls.

    Args:
        board: Where requests go.
        arena: Returns the arena of the picture.
        mark: Sets or clears a class of the page's body, by name.
        theme: NiceGUI's light or dark.
        steers: Whether this page may steer; if not, it only has what changes the page itself.
    """

    def __init__(
        self,
        board: Board,
        arena: Callable[[], Arena],
        *,
        mark: Callable[[str, bool], object],
        theme: ui.dark_mode,
        steers: bool,
    ) -> None:
        self.steers = steers
        self._board = board
        self._arena = arena
        self._mark = mark
        self._followed: Mapping[str, Any] = {}
        with ui.element('section').classes('panel controls').props('aria-label=Controls'):
            if steers:
                self._steering()
            else:
                ui.label('Read-only. To steer, open the link that the run printed.').classes(
                    'note'
                ).props('data-testid=read-only')
            self._looks(theme)

    def _steering(self) -> None:
        with ui.element('div').classes('buttons'):
            self._pause = ui.button('Pause', on_click=self._on_pause)
            self._pause.props('data-testid=pause unelevated no-caps')
            self._placing = ui.switch('Place the robot', on_change=self._on_placing)
            self._placing.props('data-testid=place-switch')
        ui.label('Press where it is to stand; drag to turn it.').classes('note placing-only')
        with ui.element('div').classes('pose-form placing-only'):
            self._x = _number('x, m', 1.78, 'place-x')
            self._y = _number('y, m', 4.5, 'place-y')
            self._heading = _number('heading, °', -90.0, 'place-heading')
            button = ui.button('Place', on_click=self._on_form)
            button.props('data-testid=place-button outline no-caps dense')
        self._mode = _choice('Drive', list(MODES), self._on_mode, 'mode-choice')
        speeds = {speed: f'{speed:g}×' for speed in SPEEDS}
        self._speed = _choice('Speed', speeds, self._on_speed, 'speed-choice')
        self._noise = _choice('Noise', list(NOISE_PRESETS), self._on_noise, 'noise-choice')
        self._answer = ui.label('').classes('note answer')
        self._answer.props('data-testid=answer role=status')

    def _looks(self, theme: ui.dark_mode) -> None:
        with ui.element('div').classes('buttons looks'):
            values = ui.switch('Q-values', on_change=lambda e: self._mark('show-q', bool(e.value)))
            values.props('data-testid=q-values')
            names = ui.toggle(list(_THEMES), value='auto')
            names.props('data-testid=theme dense no-caps unelevated aria-label="Colours"')
            names.on_value_change(lambda e: setattr(theme, 'value', _THEMES[e.value]))

    def follow(self, values: Mapping[str, Any]) -> None:
        """Show what the graph is set to, however it was set."""
        if not self.steers or values is self._followed:
            return
        before, self._followed = self._followed, values
        if values == before:
            return
        self._pause.set_text('Go on' if values.get('paused') else 'Pause')
        self._mode.set_value(values.get('mode'))
        self._speed.set_value(values.get('speed'))
        self._speed.set_enabled(values.get('clock') != 'lockstep')
        self._noise.set_value(values.get('noise'))

    async def _on_pause(self) -> None:
        await self._ask(lambda: PauseRequest(paused=not self._followed.get('paused', False)))

    async def _on_mode(self, event: ValueChangeEventArguments) -> None:
        await self._change('mode', event.value, lambda: mode_request(event.value))

    async def _on_speed(self, event: ValueChangeEventArguments) -> None:
        await self._change('speed', event.value, lambda: speed_request(event.value))

    async def _on_noise(self, event: ValueChangeEventArguments) -> None:
        await self._change('noise', event.value, lambda: noise_request(event.value))

    async def _change(self, name: str, value: object, make: Callable[[], Request]) -> None:
        """Ask for a change, unless the control only follows the graph; undo what was refused."""
        if value is None or value == self._followed.get(name):
            return
        if not await self._ask(make):
            self._followed = {**self._followed, name: object()}

    def _on_placing(self, event: ValueChangeEventArguments) -> None:
        self._mark('placing', bool(event.value))

    async def place(self, sent: object) -> None:
        """Place the robot where the picture was pressed."""
        if await self._ask(lambda: place_request_from_picture(sent, self._arena())):
            self._placing.set_value(False)

    async def _on_form(self) -> None:
        def make() -> Request:
            heading = self._heading.value
            heading_rad = math.radians(heading) if isinstance(heading, int | float) else heading
            return place_request(self._x.value, self._y.value, heading_rad, self._arena())

        await self._ask(make)

    async def _ask(self, make: Callable[[], Request]) -> bool:
        """Send a request and show the answer; return whether it was done."""
        try:
            future = asyncio.wrap_future(self._board.ask(make()))
            answer = await asyncio.wait_for(future, _PATIENCE_S)
        except (asyncio.TimeoutError, TimeoutError):
            self._answer.set_text('no answer from the graph')
        except GoalreachError as error:
            self._answer.set_text(f'refused: {error}')
        else:
            self._answer.set_text(answer)
            return True
        return False


def _number(label: str, value: float, name: str) -> ui.number:
    field = ui.number(label, value=value, format='%.2f', step=0.1)
    field.props(f'data-testid={name} dense outlined')
    return field


def _choice(
    label: str,
    options: list[str] | dict[float, str],
    on_change: Callable[..., object],
    name: str,
) -> ui.toggle:
    with ui.element('div').classes('choice'):
        ui.label(label).classes('choice-label')
        toggle = ui.toggle(options, on_change=on_change)
        toggle.props(f'data-testid={name} dense no-caps unelevated aria-label="{label}"')
    return toggle
