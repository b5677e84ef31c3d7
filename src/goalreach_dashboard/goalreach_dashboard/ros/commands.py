"""Commands from the page, executed through the standard services and parameters of the graph."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
import math
import time
from typing import Any, Final

from rcl_interfaces.srv import SetParametersAtomically
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from goalreach_dashboard.state import PageState
from goalreach_learning.controller_config import ControllerConfig
from goalreach_msgs_py import topics
from goalreach_msgs_py.angles import wrap_angle
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import CommandError, ConfigurationError
from goalreach_msgs_py.noise import noise_parameters
from goalreach_msgs_py.parameters import build_config, numbers_of
from goalreach_msgs_py.regions import region_name
from goalreach_msgs_py.topics import CONTROLLER, ESTIMATOR, LOCALIZER, ROBOT
from goalreach_msgs_py.values import Pose2

_TIMEOUT_S: Final = 10.0
_POLL_S: Final = 0.02


def checked_pose(value: object, arena: Arena) -> Pose2:
    """Return the pose of x and y, metres, and the heading, degrees, that a browser sent.

    Raises:
        ConfigurationError: Anything else was sent, or the pose is not on the free floor.
    """
    x_m, y_m, heading_deg = numbers_of(value, (3,), 'place')
    if not arena.is_free(x_m, y_m):
        raise ConfigurationError('place', (x_m, y_m), 'on the free floor')
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=wrap_angle(math.radians(heading_deg)))


class GraphCommands:
    """Commands from the page, as coroutines of the event loop that also spins the node's executor.

    Each returns its confirmation, and raises ConfigurationError for a value that is not allowed
    and CommandError where a node refuses or does not respond. The state notes when the simulation
    was paused or resumed.

    Calls: `/nomad200/pause`, `/nomad200/step`, `/nomad200/reset` and `set_parameters_atomically`
    of the nodes.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        self._state = state
        self._pause = node.create_client(SetBool, topics.PAUSE_SERVICE.removeprefix('/'))
        self._step = node.create_client(Trigger, topics.STEP_SERVICE.removeprefix('/'))
        self._reset = node.create_client(Trigger, topics.RESET_SERVICE.removeprefix('/'))
        self._parameters = {
            name: node.create_client(SetParametersAtomically, f'{name}/set_parameters_atomically')
            for name in (ROBOT, LOCALIZER, ESTIMATOR, CONTROLLER)
        }

    async def execute(self, name: object, value: object) -> str:
        """Execute a command by its name, as a browser sends it.

        Raises:
            CommandError: There is no such command.
        """
        commands = {
            'pause': self.set_paused,
            'step': self.step,
            'place': self.place,
            'speed': self.set_speed,
            'mode': self.set_mode,
            'noise': self.set_noise,
            'goal': self.move_goal,
        }
        if not isinstance(name, str) or name not in commands:
            raise CommandError('no such command')
        return await commands[name](value)

    async def set_paused(self, value: object) -> str:
        """Pause the simulation or resume it."""
        paused = value is True
        await self._call(self._pause, SetBool.Request(data=paused))
        self._state.paused_ns = self._state.clock_ns if paused else None
        return 'paused' if paused else 'resumed'

    async def step(self, _value: object) -> str:
        """Advance a paused simulation by one image."""
        await self._call(self._step, Trigger.Request())
        self._state.paused_ns = self._state.clock_ns
        return 'advanced by one image'

    async def place(self, value: object) -> str:
        """Place the robot at a pose on the free floor."""
        pose = checked_pose(value, self._state.arena)
        await self._set(ROBOT, {'start_pose': [pose.x_m, pose.y_m, pose.heading_rad]})
        await self._call(self._reset, Trigger.Request())
        self._state.place(pose)
        heading_deg = math.degrees(pose.heading_rad)
        return f'at {pose.x_m:.2f} m, {pose.y_m:.2f} m, {heading_deg:.0f}°'

    async def set_speed(self, speed: object) -> str:
        """Set the simulated seconds per second of the wall clock."""
        (checked,) = numbers_of(speed, (), 'speed')  # the robot checks its range
        await self._set(ROBOT, {'speed': checked})
        return f'speed: {checked:g}×'

    async def set_mode(self, mode: object) -> str:
        """Set the mode of the controller."""
        checked = build_config(ControllerConfig, {'mode': mode}).mode
        if self._state.learning:
            raise CommandError('a learning robot explores; it has no mode')
        await self._set(CONTROLLER, {'mode': checked})
        return f'mode: {mode}'

    async def set_noise(self, preset: object) -> str:
        """Set the noise of the robot's sensors to a preset, and make the localizer expect it."""
        values = noise_parameters(str(preset))
        await self._set_all({ROBOT: values, LOCALIZER: values})
        return f'noise: {preset}'

    async def move_goal(self, value: object) -> str:
        """Make the region that holds a point the goal: x and y, metres."""
        if self._state.learning:
            raise CommandError('a learning robot keeps its goal')
        x_m, y_m = numbers_of(value, (2,), 'goal')
        arena, regions = self._state.arena, self._state.arena.regions
        if not (0.0 <= x_m <= arena.width_m and 0.0 <= y_m <= arena.length_m):
            raise ConfigurationError('goal', (x_m, y_m), 'on the floor')
        name = region_name(regions.region_at(x_m, y_m), regions.shape)
        goal = {'goal': name}
        await self._set_all({CONTROLLER: goal, ESTIMATOR: goal, ROBOT: {'goal_region': name}})
        return f'goal: {name}'

    async def _set_all(self, values: Mapping[str, Mapping[str, object]]) -> None:
        """Set parameters of several nodes; of none where one of them is not available."""
        for node in values:
            _require_ready(self._parameters[node])
        for node, parameters in values.items():
            await self._set(node, parameters)

    async def _set(self, node: str, values: Mapping[str, object]) -> None:
        parameters = [
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]
        request = SetParametersAtomically.Request(parameters=parameters)
        response = await self._respond(self._parameters[node], request)
        if not response.result.successful:
            raise CommandError(response.result.reason)

    async def _call(self, client: Client[Any, Any], request: object) -> None:
        response = await self._respond(client, request)
        if not response.success:
            raise CommandError(response.message)

    async def _respond(self, client: Client[Any, Any], request: object) -> Any:
        _require_ready(client)
        future = client.call_async(request)
        deadline_s = time.monotonic() + _TIMEOUT_S
        while not future.done():
            if time.monotonic() > deadline_s:
                client.remove_pending_request(future)
                raise CommandError(f'no response from {client.srv_name}')
            await asyncio.sleep(_POLL_S)
        return future.result()


def _require_ready(client: Client[Any, Any]) -> None:
    if not client.service_is_ready():
        raise CommandError(f'{client.srv_name} is not available')
