"""Carries out what a person asks, through the standard services and parameters of the graph."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import fields
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMsg
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.client import Client
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool, Trigger

from goalreach_dashboard.requests import (
    ModeRequest,
    NoiseRequest,
    PauseRequest,
    PlaceRequest,
    Request,
    SpeedRequest,
)
from goalreach_dashboard.state import PageState
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.noise import NoiseModel, noise_preset
from goalreach_msgs_py.topics import CONTROLLER, LOCALIZER, PAUSE_SERVICE, RESET_SERVICE, ROBOT


class RefusedError(GoalreachError):
    """A node did not do what it was asked; the text is its reason."""


class Steering:
    """Pause, place, speed, mode and noise.

    Args:
        node: A node on an executor.
        state: Told when the simulation was paused, or goes on.
    """

    def __init__(self, node: Node, state: PageState) -> None:
        """Make the clients."""
        self._state = state
        self._pause = node.create_client(SetBool, PAUSE_SERVICE)
        self._reset = node.create_client(Trigger, RESET_SERVICE)
        self._set = {
            name: node.create_client(SetParametersAtomically, f'/{name}/set_parameters_atomically')
            for name in (ROBOT, LOCALIZER, CONTROLLER)
        }

    def carry_out(self, request: Request, answer: Future[str]) -> None:
        """Begin; the answer is filled when the node has answered, or refused with a reason."""
        match request:
            case PauseRequest(paused=paused):
                self._call(
                    self._pause, SetBool.Request(data=paused), answer, self._paused(paused, answer)
                )
            case PlaceRequest(pose=pose):
                numbers = [pose.x_m, pose.y_m, pose.heading_rad]
                self._assign(ROBOT, {'start_pose': numbers}, answer, self._place(answer))
            case SpeedRequest(speed=speed):
                self._assign(ROBOT, {'speed': speed}, answer, _done(answer, f'{speed:g} times'))
            case ModeRequest(mode=mode):
                self._assign(CONTROLLER, {'mode': mode}, answer, _done(answer, f'drives {mode}'))
            case NoiseRequest(preset=preset):
                model = noise_preset(preset)
                values = {f'noise.{f.name}': getattr(model, f.name) for f in fields(NoiseModel)}
                told = _done(answer, f'noise: {preset}')
                self._assign(
                    ROBOT,
                    values,
                    answer,
                    lambda _response: self._assign(LOCALIZER, values, answer, told),
                )

    def _paused(self, paused: bool, answer: Future[str]) -> Callable[[Any], None]:  # noqa: FBT001
        def done(response: SetBool.Response) -> None:
            if not response.success:
                _refuse(answer, response.message)
                return
            self._state.paused_ns = self._state.clock_ns if paused else None
            answer.set_result('paused' if paused else 'goes on')

        return done

    def _place(self, answer: Future[str]) -> Callable[[Any], None]:
        def reset(_response: object) -> None:
            self._call(self._reset, Trigger.Request(), answer, done)

        def done(response: Trigger.Response) -> None:
            if not response.success:
                _refuse(answer, response.message)
                return
            answer.set_result(response.message)

        return reset

    def _assign(
        self,
        node: str,
        values: Mapping[str, object],
        answer: Future[str],
        then: Callable[[Any], None],
    ) -> None:
        messages: list[ParameterMsg] = [
            Parameter(name, value=value).to_parameter_msg() for name, value in values.items()
        ]

        def done(response: SetParametersAtomically.Response) -> None:
            if response.result.successful:
                then(response)
            else:
                _refuse(answer, response.result.reason)

        request = SetParametersAtomically.Request(parameters=messages)
        self._call(self._set[node], request, answer, done)

    def _call(
        self,
        client: Client[Any, Any],
        request: object,
        answer: Future[str],
        then: Callable[[Any], None],
    ) -> None:
        if not client.service_is_ready():
            _refuse(answer, f'{client.srv_name} is not there')
            return
        client.call_async(request).add_done_callback(lambda future: then(future.result()))


def _done(answer: Future[str], text: str) -> Callable[[object], None]:
    return lambda _response: answer.set_result(text)


def _refuse(answer: Future[str], reason: str) -> None:
    answer.set_exception(RefusedError(reason))
