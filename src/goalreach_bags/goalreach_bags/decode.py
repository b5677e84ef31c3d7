"""From serialized messages to values, by the definitions of Jazzy."""

from collections.abc import Iterable, Iterator
import dataclasses
from functools import lru_cache
from typing import Any, Final

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from goalreach_bags.topic import BagTopic
from goalreach_msgs_py.errors import GoalreachError

_HASH: Final = 'RIHS01_'
_KEY_VALUE: Final = 'diagnostic_msgs/msg/KeyValue'
_CLOCK: Final = 'rosgraph_msgs/msg/Clock'
_ALIGNMENT: Final = 4
"""A message may end with bytes that bring its length to a multiple of this."""


class Decoder:
    """Deserialises the messages of a bag.

    Types that Jazzy's own packages lack are taken from the bag's definitions.

    Args:
        topics: The topics of the bag.

    Raises:
        GoalreachError: A type has another definition here than in the bag, or none at all.
    """

    def __init__(self, topics: Iterable[BagTopic] = ()) -> None:
        self._store: Typestore = get_typestore(Stores.ROS2_JAZZY)
        self._types: dict[str, str] = {}
        for topic in topics:
            self._add(topic)

    def decode(self, topic: str, data: bytes) -> Any:  # noqa: ANN401 - any message
        """Return a message as a value with the fields of its type.

        Raises:
            GoalreachError: The bytes are no such message.
        """
        type_name = self._types[topic]
        try:
            return self._store.deserialize_cdr(data, type_name)
        except Exception as error:  # noqa: BLE001 - bad bytes lead to any error
            raise GoalreachError(f'{topic}: no {type_name}: {error}') from None

    def _add(self, topic: BagTopic) -> None:
        name = topic.type_name
        if topic.serialization != 'cdr':
            raise GoalreachError(f'{topic.name}: its messages are {topic.serialization}, not cdr')
        if name not in self._store.fielddefs:
            self._register(topic)
        if topic.type_hash.startswith(_HASH):
            try:
                known = self._store.hash_rihs01(name)
            except KeyError as error:
                problem = f'definition of {name}: {error} is missing'
                raise GoalreachError(f'{topic.name}: {problem}') from None
            if known != topic.type_hash:
                raise GoalreachError(
                    f'{topic.name}: {name} has another definition in the bag '
                    f'({topic.type_hash[:15]}...) than here ({known[:15]}...)'
                )
        self._types[topic.name] = name

    def _register(self, topic: BagTopic) -> None:
        if topic.encoding != 'ros2msg' or not topic.definition:
            raise GoalreachError(f'{topic.name}: {topic.type_name} is not known')
        try:
            types = get_types_from_msg(topic.definition, topic.type_name)
            new = {key: value for key, value in types.items() if key not in self._store.fielddefs}
            self._store.register(new)
        except Exception as error:  # noqa: BLE001 - a bad definition leads to any error
            problem = f'definition of {topic.type_name}: {error}'
            raise GoalreachError(f'{topic.name}: {problem}') from None


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
    elif isinstance(value, list):
        yield f'{name}.length', len(value)
        for index, element in enumerate(value):
            if getattr(element, '__msgtype__', '') == _KEY_VALUE:
                yield f'{name}.{element.key}', element.value
            else:
                yield from flatten(element, f'{name}[{index}]')
    else:
        yield name, value


@lru_cache(maxsize=1)
def _jazzy_types() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


def erase_padding(type_name: str, data: bytes) -> bytes:
    """Return a message with zeros between its fields, which DDS leaves undefined.

    It is unchanged where that cannot be done.
    """
    store = _jazzy_types()
    if type_name not in store.fielddefs:
        return data
    try:
        result = bytes(store.serialize_cdr(store.deserialize_cdr(data, type_name), type_name))
    except Exception:  # noqa: BLE001 - bad bytes lead to any error; they are kept
        return data
    missing = len(data) - len(result)
    return result + bytes(missing) if 0 <= missing < _ALIGNMENT else data


def begins_with_stamp(type_name: str, message_class: Any) -> bool:  # noqa: ANN401 - generated
    """Return whether a type begins with a header, or is the clock.

    Log and ParameterEvent begin with a time too, but one of the wall clock.
    """
    fields = list(message_class.get_fields_and_field_types().values())
    return type_name == _CLOCK or (bool(fields) and fields[0] == 'std_msgs/Header')
