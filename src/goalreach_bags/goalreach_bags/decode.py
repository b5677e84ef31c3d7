"""From serialized messages to values, by the definitions of Jazzy."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import dataclasses
from dataclasses import dataclass
import itertools
import math
from typing import Any, Final

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import GoalreachError

_HASH: Final = 'RIHS01_'
_KEY_VALUE: Final = 'diagnostic_msgs/msg/KeyValue'


class Decoder:
    """Deserialises the messages of a bag.

    Types that Jazzy's own packages do not hold are learned from the bag's definitions.

    Args:
        topics: The topics of the bag.

    Raises:
        GoalreachError: A type has another definition here than in the bag, or none at all.
    """

    def __init__(self, topics: Iterable[BagTopic]) -> None:
        self._store: Typestore = get_typestore(Stores.ROS2_JAZZY)
        self._types: dict[str, str] = {}
        for topic in topics:
            self._require_same(topic)
            self._types[topic.name] = topic.type_name

    def decode(self, topic: str, data: bytes) -> Any:  # noqa: ANN401 - any message
        """Return a message as a value with the fields of its type.

        Raises:
            GoalreachError: The bytes are no such message.
        """
        type_name = self._types[topic]
        try:
            return self._store.deserialize_cdr(data, type_name)
        except Exception as error:  # noqa: BLE001 - whatever bad bytes lead to
            raise GoalreachError(f'{topic}: no {type_name}: {error}') from None

    def _require_same(self, topic: BagTopic) -> None:
        name = topic.type_name
        if name not in self._store.fielddefs:
            self._learn(topic)
        if topic.type_hash.startswith(_HASH):
            known = self._store.hash_rihs01(name)
            if known != topic.type_hash:
                raise GoalreachError(
                    f'{topic.name}: {name} has another definition in the bag '
                    f'({topic.type_hash[:15]}...) than here ({known[:15]}...)'
                )

    def _learn(self, topic: BagTopic) -> None:
        if topic.encoding != 'ros2msg' or not topic.definition:
            raise GoalreachError(f'{topic.name}: {topic.type_name} is not known')
        try:
            types = get_types_from_msg(topic.definition, topic.type_name)
            new = {key: value for key, value in types.items() if key not in self._store.fielddefs}
            self._store.register(new)
        except Exception as error:  # noqa: BLE001 - whatever a bad definition leads to
            raise GoalreachError(
                f'{topic.name}: definition of {topic.type_name}: {error}'
            ) from None


def flatten(value: Any, name: str = '') -> Iterator[tuple[str, Any]]:  # noqa: ANN401 - any
    """Yield the fields of a message by their dotted names, arrays of numbers whole.

    The values of diagnostics are named by their keys.

    Args:
        value: A message or a part of one.
        name: Name of that part.
    """
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            is_constant = hasattr(type(value), field.name)
            if not is_constant:
                inner = f'{name}.{field.name}' if name else field.name
                yield from flatten(getattr(value, field.name), inner)
    elif isinstance(value, list) and not isinstance(value, np.ndarray):
        yield f'{name}.length', len(value)
        for index, element in enumerate(value):
            if getattr(element, '__msgtype__', '') == _KEY_VALUE:
                yield f'{name}.{element.key}', element.value
            else:
                yield from flatten(element, f'{name}[{index}]')
    else:
        yield name, value


@dataclass(frozen=True, kw_only=True)
class FieldDifference:
    """One field that is not the same.

    Attributes:
        field: Its dotted name, with the index of the worst element for an array.
        first: Its value in the first message.
        second: Its value in the second.
        amount: Absolute difference; infinite where one is no number.
    """

    field: str
    first: Any
    second: Any
    amount: float


def differences(first: object, second: object) -> Iterator[FieldDifference]:
    """Yield the fields in which two messages differ.

    Texts that both are numbers count as numbers: diagnostics carry values that way. NaN equals
    NaN: it means "not seen".

    Args:
        first: A message.
        second: Another one of the same type.
    """
    for mine, yours in itertools.zip_longest(flatten(first), flatten(second)):
        if mine is None or yours is None or mine[0] != yours[0]:
            name = (mine or yours or ('', None))[0]
            yield _different(name, mine and mine[1], yours and yours[1], math.inf)
            return
        yield from _compare(mine[0], mine[1], yours[1])


def _compare(name: str, first: Any, second: Any) -> Iterator[FieldDifference]:  # noqa: ANN401
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        yield from _compare_arrays(name, first, second)
        return
    left, right = _number(first), _number(second)
    if left is None or right is None:
        if first != second:
            yield _different(name, first, second, math.inf)
        return
    amount = _distance(left, right)
    if amount:
        yield _different(name, first, second, amount)


def _compare_arrays(
    name: str, first: np.ndarray[Any, Any], second: np.ndarray[Any, Any]
) -> Iterator[FieldDifference]:
    if first.shape != second.shape:
        yield _different(f'{name}.length', len(first), len(second), math.inf)
        return
    with np.errstate(invalid='ignore'):
        distances = np.abs(first.astype(np.float64) - second.astype(np.float64))
    same = (first == second) | (np.isnan(distances) & _both_nan(first, second))
    distances[same] = 0.0
    distances[np.isnan(distances)] = np.inf
    if distances.size and distances.max() > 0.0:
        worst = int(distances.argmax())
        found = first.item(worst), second.item(worst)
        yield _different(f'{name}[{worst}]', *found, float(distances[worst]))


def _both_nan(
    first: np.ndarray[Any, Any], second: np.ndarray[Any, Any]
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    if first.dtype.kind != 'f':
        return np.zeros(first.shape, dtype=np.bool_)
    both: np.ndarray[Any, np.dtype[np.bool_]] = np.isnan(first) & np.isnan(second)
    return both


def _number(value: Any) -> float | None:  # noqa: ANN401 - a field of any type
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def _distance(first: float, second: float) -> float:
    if first == second or (math.isnan(first) and math.isnan(second)):
        return 0.0
    distance = abs(first - second)
    return math.inf if math.isnan(distance) else distance


def _different(name: str, first: object, second: object, amount: float) -> FieldDifference:
    return FieldDifference(field=name, first=first, second=second, amount=amount)


_ALIGNMENT: Final = 4
"""A message may end with bytes that bring its length to a multiple of this."""


class Canonical:
    """Zeroes the bytes between fields."""

    def __init__(self) -> None:
        self._store: Typestore = get_typestore(Stores.ROS2_JAZZY)

    def bytes_of(self, type_name: str, data: bytes) -> bytes:
        """Return a message with zeros between its fields; unchanged where that cannot be done.

        Args:
            type_name: `package/msg/Name`.
            data: The message.
        """
        if type_name not in self._store.fielddefs:
            return data
        try:
            message = self._store.deserialize_cdr(data, type_name)
            result = bytes(self._store.serialize_cdr(message, type_name))
        except Exception:  # noqa: BLE001 - whatever bad bytes lead to: they are kept
            return data
        missing = len(data) - len(result)
        return result + bytes(missing) if 0 <= missing < _ALIGNMENT else data


_CLOCK: Final = 'rosgraph_msgs/msg/Clock'


def begins_with_stamp(type_name: str, message_class: Any) -> bool:  # noqa: ANN401 - generated
    """Return whether a type begins with a header, or is the clock.

    Log and ParameterEvent begin with a time too, but one of the wall clock.

    Args:
        type_name: `package/msg/Name`.
        message_class: Its Python class.
    """
    fields = list(message_class.get_fields_and_field_types().values())
    return type_name == _CLOCK or (bool(fields) and fields[0] == 'std_msgs/Header')
