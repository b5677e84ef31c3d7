"""Topics of a bag: type, definition and offered quality of service."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
import os
from pathlib import Path
import re
import sys
from typing import Any, Final

from rosbags.rosbag2.metadata import dump_qos_v9, parse_qos
import yaml

from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.files import load_yaml

Offer = Mapping[str, Any]
"""Quality of service that a publisher offers, as metadata.yaml of version 9 writes it."""

DURATIONS: Final = ('deadline', 'lifespan', 'liveliness_lease_duration')
"""Policies that are mappings of `sec` and `nsec`."""
_LARGEST: Final = 2**63
_PARTS: Final = 3
_SEPARATOR: Final = 80 * '='
_FIELD: Final = re.compile(r'^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+', re.MULTILINE)
_BUILT_IN: Final = re.compile(r'^(?:bool|byte|char|w?string|float\d+|u?int\d+)$')


@dataclass(frozen=True, kw_only=True)
class BagTopic:
    """One topic of a bag.

    Attributes:
        name: Name with its leading slash.
        type_name: `package/msg/Name`.
        type_hash: `RIHS01_...`, or empty where the bag has none.
        offers: Quality of service that each publisher offered.
        definition: Message definition, followed by those of all types in it.
        encoding: Format of the definition, `ros2msg` or `ros2idl`.
        serialization: Format of the messages.
    """

    name: str
    type_name: str
    type_hash: str = ''
    offers: tuple[Offer, ...] = ()
    definition: str = ''
    encoding: str = 'ros2msg'
    serialization: str = 'cdr'


def merge_topics(topics: Iterable[BagTopic]) -> dict[str, BagTopic]:
    """Return topics by name; of several descriptions later ones add what the first lacks."""
    merged: dict[str, BagTopic] = {}
    for topic in topics:
        first = merged.setdefault(topic.name, topic)
        merged[topic.name] = replace(
            first,
            type_hash=first.type_hash or topic.type_hash,
            offers=first.offers or topic.offers,
        )
    return merged


def offers_to_text(offers: Sequence[Offer]) -> str:
    """Return offers as the YAML text in MCAP channels and SQLite topics."""
    return yaml.safe_dump(list(offers), sort_keys=False) if offers else ''


def parse_offers(value: Any) -> tuple[Offer, ...]:  # noqa: ANN401 - as YAML gives it
    """Return the offers in a YAML text or its list, of any version; none where it is damaged."""
    try:
        documents = load_yaml(value) if isinstance(value, str) else value
        offers: Any = dump_qos_v9(parse_qos(documents or []))
        numbers = [offer['depth'] for offer in offers]
        numbers += [n for offer in offers for name in DURATIONS for n in offer[name].values()]
        valid = all(isinstance(n, int) and 0 <= n < _LARGEST for n in numbers)
    except (yaml.YAMLError, TypeError, KeyError, AttributeError, ValueError):
        return ()
    return tuple(offers) if valid else ()


@lru_cache(maxsize=256)
def message_definition(type_name: str) -> str:
    """Return a message's installed definition, followed by those of all types in it.

    Args:
        type_name: `package/msg/Name`.

    Raises:
        GoalreachError: The package is not installed, or has no such `.msg` file.
    """
    parts = type_name.split('/')
    if len(parts) != _PARTS or parts[1] != 'msg':
        raise GoalreachError(f'{type_name}: is not the name of a message')
    return _full_text(parts[0], parts[2], set())


def _full_text(package: str, name: str, seen: set[tuple[str, str]]) -> str:
    text = _read(package, name)
    names = {n for n in _FIELD.findall(re.sub(r'#.*', '', text)) if not _BUILT_IN.match(n)}
    parts = [nested.split('/') if '/' in nested else [package, nested] for nested in names]
    for full_name in sorted({(part[0], part[-1]) for part in parts}):
        if full_name not in seen:
            seen.add(full_name)
            text += f'\n{_SEPARATOR}\nMSG: {"/".join(full_name)}\n'
            text += _full_text(*full_name, seen)
    return text


def _read(package: str, name: str) -> str:
    prefixes = [*os.environ.get('AMENT_PREFIX_PATH', '').split(os.pathsep), sys.prefix]
    for prefix in filter(None, prefixes):
        path = Path(prefix) / 'share' / package / 'msg' / f'{name}.msg'
        with suppress(OSError):
            return path.read_text(encoding='utf-8')
    raise GoalreachError(f'{package}/msg/{name}: its definition is not installed')
