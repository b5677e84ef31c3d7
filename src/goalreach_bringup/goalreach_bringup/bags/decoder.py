"""From serialized messages to values, by the definitions of Jazzy."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import dataclasses
from typing import Any, Final

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from goalreach_bringup.bags.topic import BagTopic
from goalreach_msgs_py.errors import GoalreachError

__all__ = ['Decoder', 'flatten']

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
