"""Configuration dataclasses as declared ROS parameters with description, range and refusal."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.parameters import (
    ParameterInfo,
    build_config,
    flatten_config,
    parameter_infos,
)

ConfigT = TypeVar('ConfigT')
_UNBOUNDED = 1e308


class NodeConfig(Generic[ConfigT]):
    """One configuration dataclass held by a node's parameters.

    Every field is declared with its description and range; a start value or a later change that
    the dataclass refuses is refused with the dataclass's own reason. Fields in `live`, by dotted
    name, may change after start, and `on_change` gets the new configuration; others are read-only.

    Raises:
        ConfigurationError: A value given at start is refused.
    """

    def __init__(
        self,
        node: Node,
        cls: type[ConfigT],
        *,
        live: Iterable[str] = (),
        on_change: Callable[[ConfigT], None] | None = None,
    ) -> None:
        self._cls = cls
        self._on_change = on_change
        self._values: dict[str, Any] = {}
        defaults = flatten_config(cls())
        live = frozenset(live)
        for name, info in parameter_infos(cls).items():
            self._values[name] = _declare(node, name, defaults[name], info, live=name in live)
        self.value: ConfigT = build_config(cls, self._values)
        if live:
            node.add_on_set_parameters_callback(self._check)
            node.add_post_set_parameters_callback(self._apply)

    def _changes(self, parameters: list[Parameter[Any]]) -> dict[str, Any]:
        return {p.name: p.value for p in parameters if p.name in self._values}

    def _check(self, parameters: list[Parameter[Any]]) -> SetParametersResult:
        try:
            build_config(self._cls, {**self._values, **self._changes(parameters)})
        except ConfigurationError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _apply(self, parameters: list[Parameter[Any]]) -> None:
        changes = self._changes(parameters)
        if not changes:
            return
        self._values.update(changes)
        self.value = build_config(self._cls, self._values)
        if self._on_change is not None:
            self._on_change(self.value)


def _declare(node: Node, name: str, default: object, info: ParameterInfo, *, live: bool) -> object:
    value = list(default) if isinstance(default, tuple) else default
    given = node._parameter_overrides.get(name)  # noqa: SLF001 - rclpy offers no public reading
    empty = isinstance(default, tuple) and given is not None and given.value is None  # a file's []
    kind = 'a whole number' if type(default) is int else 'a number'
    try:
        descriptor = _descriptor(default, info, live=live)
        value = [] if empty else value
        return node.declare_parameter(name, value, descriptor, ignore_override=empty).value
    except (InvalidParameterValueException, InvalidParameterTypeException):
        refused = value if given is None else given.value
        raise ConfigurationError(name, refused, info.allowed(kind)) from None


def _descriptor(default: object, info: ParameterInfo, *, live: bool) -> ParameterDescriptor:
    """Return the descriptor; ranges are enforced by ROS for scalars, by the dataclass for all.

    Typing is dynamic so that `1` is taken for a parameter that is a float by default.
    """
    descriptor = ParameterDescriptor(
        description=info.description, read_only=not live, dynamic_typing=True
    )
    if info.choices or info.length is not None:
        descriptor.additional_constraints = info.allowed('a number')
    if isinstance(default, bool) or (info.minimum is None and info.maximum is None):
        return descriptor
    low = -_UNBOUNDED if info.minimum is None else info.minimum
    high = _UNBOUNDED if info.maximum is None else info.maximum
    if isinstance(default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(low), to_value=float(high))
        ]
    elif isinstance(default, int) and info.minimum is not None and info.maximum is not None:
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=1)]
    return descriptor


def warn_of_unknown_parameters(node: Node) -> None:
    """Log one warning for each given parameter that the node has not declared (a typing error)."""
    for name in node._parameter_overrides:  # noqa: SLF001 - rclpy offers no public reading
        if not node.has_parameter(name):
            node.get_logger().warning(f'parameter {name}: not known to this node, ignored')
