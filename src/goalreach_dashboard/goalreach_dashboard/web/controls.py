"""Controls of one page: pause, place, mode, speed, noise, and the page's own appearance."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
import math
from typing import Any, Final

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from goalreach_dashboard.requests import (
    SPEEDS,
    ModeRequest,
    NoiseRequest,
    PauseRequest,
    PlaceRequest,
    Request,
    SpeedRequest,
)
from goalreach_learning.blending import MODES
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NOISE_PRESETS

_THEMES: Final = {'auto': None, 'light': False, 'dark': True}
_READ_ONLY: Final = 'Read-only. To steer, open the link that the run printed.'


class Controls:
    """One page's controls.

    Args:
        execute: Executes a request and returns its confirmation; None where the page is
            read-only and only its appearance may be changed.
        arena: Returns the arena of the picture.
        toggle_class: Adds or removes a CSS class of the page's body, by name.
        theme: NiceGUI's light or dark.
    """

    def __init__(
        self,
        execute: Callable[[Request], Awaitable[str]] | None,
        arena: Callable[[], Arena],
        *,
        toggle_class: Callable[[str, bool], object],
        theme: ui.dark_mode,
    ) -> None:
        self._execute = execute
        self._arena = arena
        self._toggle_class = toggle_class
        self._shown: Mapping[str, Any] = {}
        with ui.element('section').classes('panel controls').props('aria-label=Controls'):
            if execute is None:
                ui.label(_READ_ONLY).classes('note').props('data-testid=read-only')
            else:
                self._add_steering()
            self._add_appearance(theme)

    def _add_steering(self) -> None:
        with ui.element('div').classes('buttons'):
            self._pause = ui.button('Pause', on_click=self._on_pause)
            self._pause.props('data-testid=pause unelevated no-caps')
            self._placing = ui.switch('Place the robot', on_change=self._on_placing)
            self._placing.props('data-testid=place-switch')
        ui.label('Press on the arena to place the robot; drag to set its heading.').classes(
            'note placing-only'
        )
        with ui.element('div').classes('pose-form placing-only'):
            self._x = _number_field('x, m', 1.78, 'place-x')
            self._y = _number_field('y, m', 4.5, 'place-y')
            self._heading = _number_field('heading, °', -90.0, 'place-heading')
            button = ui.button('Place', on_click=self._on_form)
            button.props('data-testid=place-button outline no-caps dense')
        speeds = {speed: f'{speed:g}×' for speed in SPEEDS}
        self._mode = self._add_choice('mode', list(MODES), lambda value: ModeRequest(mode=value))
        self._speed = self._add_choice('speed', speeds, lambda value: SpeedRequest(speed=value))
        self._noise = self._add_choice(
            'noise', list(NOISE_PRESETS), lambda value: NoiseRequest(preset=value)
        )
        self._status = ui.label('').classes('note answer')
        self._status.props('data-testid=answer role=status')

    def _add_choice(
        self,
        name: str,
        options: list[str] | dict[float, str],
        request: Callable[[Any], Request],
    ) -> ui.toggle:
        """Add a choice that requests a change; a refused one is undone by the next update."""

        async def on_change(event: ValueChangeEventArguments) -> None:
            value = event.value
            if value is None or value == self._shown.get(name):
                return  # the control follows the graph
            if not await self._run(lambda: request(value)):
                self._shown = {**self._shown, name: object()}

        with ui.element('div').classes('choice'):
            ui.label(name.capitalize()).classes('choice-label')
            toggle = ui.toggle(options, on_change=on_change)
            toggle.props(f'data-testid={name}-choice dense no-caps unelevated aria-label="{name}"')
        return toggle

    def _add_appearance(self, theme: ui.dark_mode) -> None:
        with ui.element('div').classes('buttons'):
            values = ui.switch('Q-values')
            values.on_value_change(lambda e: self._toggle_class('show-q', bool(e.value)))
            values.props('data-testid=q-values')
            names = ui.toggle(list(_THEMES), value='auto')
            names.props('data-testid=theme dense no-caps unelevated aria-label="Colours"')
            names.on_value_change(lambda e: setattr(theme, 'value', _THEMES[e.value]))

    def update(self, values: Mapping[str, Any]) -> None:
        """Show the graph's settings, whoever changed them.

        Args:
            values: `paused`, `mode`, `speed`, `clock` and `noise`; replaced as a whole.
        """
        if self._execute is None or values == self._shown:
            return
        self._shown = values
        self._pause.set_text('Resume' if values.get('paused') else 'Pause')
        self._mode.set_value(values.get('mode'))
        self._speed.set_value(values.get('speed'))
        self._speed.set_enabled(values.get('clock') != 'lockstep')
        self._noise.set_value(values.get('noise'))

    async def _on_pause(self) -> None:
        await self._run(lambda: PauseRequest(paused=not self._shown.get('paused', False)))

    def _on_placing(self, event: ValueChangeEventArguments) -> None:
        self._toggle_class('placing', bool(event.value))

    async def place(self, drag: object) -> None:
        """Place the robot where the picture was pressed; a read-only page does nothing.

        Args:
            drag: What the browser sent; see `PlaceRequest.from_drag`.
        """
        if await self._run(lambda: PlaceRequest.from_drag(drag, self._arena())):
            self._placing.set_value(False)

    async def _on_form(self) -> None:
        def request() -> Request:
            heading = self._heading.value
            heading_rad = math.radians(heading) if isinstance(heading, int | float) else heading
            return PlaceRequest.at(self._x.value, self._y.value, heading_rad, self._arena())

        await self._run(request)

    async def _run(self, request: Callable[[], Request]) -> bool:
        """Execute a request and show the outcome; return whether it succeeded."""
        if self._execute is None:
            return False
        try:
            confirmation = await self._execute(request())
        except GoalreachError as error:
            self._status.set_text(f'refused: {error}')
            return False
        self._status.set_text(confirmation)
        return True


def _number_field(label: str, value: float, name: str) -> ui.number:
    field = ui.number(label, value=value, format='%.2f', step=0.1)
    field.props(f'data-testid={name} dense outlined')
    return field
