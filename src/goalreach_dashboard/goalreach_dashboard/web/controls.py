"""Controls of one page: pause, place, mode, speed, noise, and the page's own appearance."""

from collections.abc import Awaitable, Callable, Mapping
import math
from typing import Any, Final

from nicegui import ui
from nicegui.events import ValueChangeEventArguments

from goalreach_dashboard.placement import checked_pose, dragged_pose
from goalreach_dashboard.ros.commands import GraphCommands
from goalreach_learning.blending import MODES
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NOISE_PRESETS
from goalreach_msgs_py.values import Pose2

_SPEEDS: Final = {speed: f'{speed:g}×' for speed in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)}
_THEMES: Final = {'auto': None, 'light': False, 'dark': True}

ToggleClass = Callable[[str, bool], object]
"""Adds or removes a CSS class of the page's body, by name."""


class SteeringControls:
    """Controls that steer the graph, for a page that may.

    Args:
        commands: Commands to the graph.
        arena: Returns the arena of the picture.
        toggle_class: Adds or removes a CSS class of the page's body.
    """

    def __init__(
        self, commands: GraphCommands, arena: Callable[[], Arena], toggle_class: ToggleClass
    ) -> None:
        self._commands = commands
        self._arena = arena
        self._shown: Mapping[str, Any] = {}
        with ui.element('div').classes('buttons'):
            self._pause = ui.button('Pause', on_click=self._on_pause)
            self._pause.props('data-testid=pause unelevated no-caps')
            self._placing = ui.switch('Place the robot')
            self._placing.on_value_change(lambda e: toggle_class('placing', bool(e.value)))
            self._placing.props('data-testid=place-switch')
        self._add_pose_form()
        self._mode = self._add_choice('mode', list(MODES), commands.set_mode)
        self._speed = self._add_choice('speed', _SPEEDS, commands.set_speed)
        self._noise = self._add_choice('noise', list(NOISE_PRESETS), commands.set_noise)
        self._status = ui.label('').classes('note answer')
        self._status.props('data-testid=answer role=status')

    def _add_pose_form(self) -> None:
        note = 'Press on the arena to place the robot; drag to set its heading.'
        ui.label(note).classes('note placing-only')
        with ui.element('div').classes('pose-form placing-only'):
            self._x = _number_field('x, m', 1.78, 'place-x')
            self._y = _number_field('y, m', 4.5, 'place-y')
            self._heading = _number_field('heading, °', -90.0, 'place-heading')
            button = ui.button('Place', on_click=self._on_form)
            button.props('data-testid=place-button outline no-caps dense')

    def _add_choice(
        self,
        name: str,
        options: list[str] | dict[float, str],
        command: Callable[[object], Awaitable[str]],
    ) -> ui.toggle:
        """Add a choice that commands a change; a refused one is undone by the next update."""

        async def on_change(event: ValueChangeEventArguments) -> None:
            value = event.value
            if value is None or value == self._shown.get(name):
                return  # the control follows the graph
            if not await self._run(command(value)):
                self._shown = {**self._shown, name: object()}

        with ui.element('div').classes('choice'):
            ui.label(name.capitalize()).classes('choice-label')
            toggle = ui.toggle(options, on_change=on_change)
            toggle.props(f'data-testid={name}-choice dense no-caps unelevated aria-label="{name}"')
        return toggle

    def update(self, settings: Mapping[str, Any]) -> None:
        """Show the graph's settings, whoever changed them.

        Args:
            settings: `paused`, `mode`, `speed`, `clock` and `noise`.
        """
        if settings == self._shown:
            return
        self._shown = settings
        self._pause.set_text('Resume' if settings.get('paused') else 'Pause')
        self._mode.set_value(settings.get('mode'))
        self._speed.set_value(settings.get('speed'))
        self._speed.set_enabled(settings.get('clock') != 'lockstep')
        self._noise.set_value(settings.get('noise'))

    async def _on_pause(self) -> None:
        await self._run(self._commands.set_paused(not self._shown.get('paused', False)))

    async def place(self, drag: object) -> None:
        """Place the robot where the picture was pressed.

        Args:
            drag: What the browser sent; see `dragged_pose`.
        """
        if await self._run(self._place(lambda: dragged_pose(drag, self._arena()))):
            self._placing.set_value(False)

    async def _on_form(self) -> None:
        def pose() -> Pose2:
            heading = self._heading.value
            heading_rad = math.radians(heading) if isinstance(heading, int | float) else heading
            return checked_pose(self._x.value, self._y.value, heading_rad, self._arena())

        await self._run(self._place(pose))

    async def _place(self, pose: Callable[[], Pose2]) -> str:
        return await self._commands.place(pose())

    async def _run(self, command: Awaitable[str]) -> bool:
        """Await a command and show the outcome; return whether it succeeded."""
        try:
            confirmation = await command
        except GoalreachError as error:
            self._status.set_text(f'refused: {error}')
            return False
        self._status.set_text(confirmation)
        return True


def _number_field(label: str, value: float, name: str) -> ui.number:
    field = ui.number(label, value=value, format='%.2f', step=0.1)
    field.props(f'data-testid={name} dense outlined')
    return field


def add_read_only_note() -> None:
    """Explain why a page has no controls."""
    note = ui.label('Read-only. To steer, open the link that the run printed.')
    note.classes('note').props('data-testid=read-only')


def add_appearance(theme: ui.dark_mode, toggle_class: ToggleClass) -> None:
    """Add the controls that change the page alone: Q-values and colours.

    Args:
        theme: NiceGUI's light or dark.
        toggle_class: Adds or removes a CSS class of the page's body.
    """
    with ui.element('div').classes('buttons'):
        values = ui.switch('Q-values')
        values.on_value_change(lambda e: toggle_class('show-q', bool(e.value)))
        values.props('data-testid=q-values')
        names = ui.toggle(list(_THEMES), value='auto')
        names.props('data-testid=theme dense no-caps unelevated aria-label="Colours"')
        names.on_value_change(lambda e: setattr(theme, 'value', _THEMES[e.value]))
