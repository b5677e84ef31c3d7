"""Valid files for every reader of files, and the readers fed with mutations of them."""

from collections.abc import Callable
import contextlib
from dataclasses import dataclass
from io import StringIO
import json
from pathlib import Path
import shutil
from typing import Any, Final

import numpy as np
import rclpy
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.signals import SignalHandlerOptions
import yaml

from goalreach_bags.metadata import METADATA_NAME
from goalreach_bags.options import ReplayOptions, StorageOptions
from goalreach_bags.reader import BagReader
from goalreach_bags.repair import repair_bag
from goalreach_bags.report import show_bag
from goalreach_bags.ros.player import Player
from goalreach_bags.storage import BagError
from goalreach_bags.topic import BagTopic, message_definition
from goalreach_bags.writer import BagWriter
from goalreach_evaluation.choices import choose_arena, choose_noise
from goalreach_evaluation.summary_file import read_recorded_run
from goalreach_lab.fuzz.mutation import mutate_bytes, mutate_value
from goalreach_lab.fuzz.reader import Reader, require_finite
from goalreach_lab.rigs.stack import free_domains
from goalreach_learning.policy import Policy
from goalreach_learning.policy_file import read_policy, write_policy
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.parameter_file import read_parameters
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile, use_profile

STRING: Final = 'std_msgs/msg/String'
_EVALUATION: Final[dict[str, Any]] = {
    'seed': 7,
    'mode': 'fuzzy',
    'policy': 'policy.json',
    'success_rate': 1.0,
    'config': {'noise': 'nominal'},
    'paths': [
        {'start': [1.0, 4.0, 0.0], 'outcome': 'goal', 'trace': [[1.0, 4.0], [1.1, 3.9]]},
        {'start': [2.0, 4.0, 0.0], 'outcome': 'bump', 'trace': None},
    ],
}
_NOISE: Final = {'read_noise_dn': 2.0, 'dropout_probability': 0.1, 'spot_sigma_px': 1.5}
_PARAMETERS: Final = {
    '/**': {'ros__parameters': {'use_sim_time': True}},
    'nomad200': {'ros__parameters': {'speed': 2.0, 'noise': {'read_noise_dn': 2.0}}},
    'landmark_localizer': {'ros__parameters': {'landmarks_m': [0.9, 0.0, 1.4] * 3}},
    'goal_reaching_controller': {'ros__parameters': {'mode': 'crisp', 'learning.alpha': 0.2}},
}
_ARENA: Final = {
    'name': 'test',
    'width_m': 2.4,
    'length_m': 5.08,
    'leds_m': [[0.6, 0.0, 1.42], [1.2, 0.5, 1.83], [1.8, 0.0, 1.63]],
    'regions': {
        'x_borders_m': [0.8, 1.6],
        'y_borders_m': [1.7, 3.4],
        'transition_width_m': 0.4,
        'goal': 'FRONT/NEAR',
    },
    'starts': {'border': 22},
}


@dataclass(frozen=True, kw_only=True)
class FileTarget:
    """A kind of file with its reader.

    Attributes:
        name: Name of the kind.
        valid: A value that the reader accepts: a document, or the bytes of another file.
        encode: Returns the bytes of a value.
        path: File that they are written to.
        read: The reader.
        finite: Whether all numbers read must be finite; otherwise a later reader checks them.
    """

    name: str
    valid: object
    encode: Callable[[object], bytes]
    path: Path
    read: Callable[[Path], object]
    finite: bool = True

    def take(self, data: bytes) -> object:
        """Write bytes, and return the value read from them.

        Raises:
            GoalreachError: The reader refuses them.
            InvalidAcceptedError: The reader accepts an invalid value.
        """
        self.path.write_bytes(data)
        found = self.read(self.path)
        if self.finite:
            require_finite(found, self.name)
        return found


def _as_json(value: object) -> bytes:
    return json.dumps(value, default=repr).encode('utf-8', errors='replace')


def _as_yaml(value: object) -> bytes:
    return yaml.safe_dump(value, sort_keys=False).encode('utf-8', errors='replace')


def _as_bytes(value: object) -> bytes:
    return value if isinstance(value, bytes) else b''


def document_readers(folder: Path) -> list[Reader]:
    """Return the readers of JSON and YAML files.

    Args:
        folder: Folder of the mutated files.
    """
    return [_document_reader(target) for target in document_targets(folder)]


def document_targets(folder: Path) -> list[FileTarget]:
    """Return the JSON and YAML files, written to a folder."""
    path = folder / 'valid.json'
    write_policy(path, Policy.unlearned(Arena().regions))
    policy = json.loads(path.read_text(encoding='utf-8'))

    kinds: list[tuple[str, object, Callable[[object], bytes], Callable[[Path], object]]] = [
        ('policy file', policy, _as_json, read_policy),
        ('arena file', _ARENA, _as_yaml, lambda path: choose_arena(str(path))),
        ('arena file, read alone', _ARENA, _as_yaml, read_arena),
        ('noise file', _NOISE, _as_yaml, choose_noise),
        ('parameter file', _PARAMETERS, _as_yaml, read_parameters),
        ('evaluation file', _EVALUATION, _as_json, read_recorded_run),
    ]
    return [
        FileTarget(
            name=name,
            valid=value,
            encode=encode,
            path=folder / f'{name.replace(" ", "-").replace(",", "")}.txt',
            read=read,
            finite=value is not _PARAMETERS,
        )
        for name, value, encode, read in kinds
    ]


def bag_targets(folder: Path) -> list[FileTarget]:
    """Return the files of bags, each next to the other files of a valid bag."""
    targets = []
    for storage, pattern in (('mcap', '*.mcap'), ('sqlite3', '*.db3'), ('mcap', '*.yaml')):
        bag = folder / f'guided-{storage}-{pattern[2:]}'
        _write_bag(bag, storage)
        (path,) = bag.glob(pattern)
        targets.append(
            FileTarget(
                name=f'bag, {storage}, {path.suffix}',
                valid=path.read_bytes(),
                encode=_as_bytes,
                path=path,
                read=lambda path: _read_bag(path.parent),
            )
        )
    return targets


def _document_reader(target: FileTarget) -> Reader:
    """Return a reader of documents, about half with wrong values and half with wrong bytes."""

    def attempt(rng: np.random.Generator) -> object:
        value = mutate_value(target.valid, rng) if rng.random() < 0.6 else target.valid  # noqa: PLR2004
        try:
            data = target.encode(value)
        except (yaml.YAMLError, ValueError):
            data = target.encode(target.valid)
        if value is target.valid or rng.random() < 0.1:  # noqa: PLR2004
            data = mutate_bytes(data, rng)
        return target.take(data)

    return Reader(name=target.name, attempt=attempt)


def bag_readers(folder: Path) -> list[Reader]:
    """Return the readers of bags, and their repair."""
    readers = []
    for storage in ('mcap', 'sqlite3'):
        valid = folder / f'valid-{storage}'
        _write_bag(valid, storage)
        readers += [
            _bag_reader(folder, f'bag, {storage}', valid, _read_bag),
            _bag_reader(folder, f'bag repair, {storage}', valid, _repair_bag),
            _bag_reader(folder, f'bag metadata, {storage}', valid, _use_bag, METADATA_NAME),
        ]
    return readers


def _write_bag(path: Path, storage: str) -> None:
    writer = BagWriter(path, StorageOptions(storage=storage))
    definition = message_definition(STRING)
    writer.add_topic(BagTopic(name='/text', type_name=STRING, definition=definition))
    for number in range(20):
        writer.write('/text', 1_000_000 * (number + 1), serialize_text(f'{number:06d}'))
    writer.close()


def serialize_text(text: str) -> bytes:
    """Return a serialized std_msgs/String."""
    data = text.encode()
    return b'\0\1\0\0' + (len(data) + 1).to_bytes(4, 'little') + data + b'\0'


def _read_bag(path: Path) -> int:
    with BagReader(path) as bag:
        return sum(len(message.data) for message in bag.messages())


def _repair_bag(path: Path) -> int:
    """Repair a bag and read it: a repaired bag is valid."""
    result = repair_bag(path)
    try:
        with BagReader(path) as bag:
            found = sum(1 for _ in bag.messages())
    except BagError as error:
        raise AssertionError(f'repaired, but cannot be read: {error}') from None
    # SQLite has no check sums: a changed time or topic of a message is not detected.
    if found != result.messages and not list(path.glob('*.db3')):
        raise AssertionError(f'{result.messages} messages repaired, {found} read')
    return found


def _use_bag(path: Path) -> object:
    """Show a bag, open it for a replay and repair it, even if one of them refuses it."""
    refused: GoalreachError | None = None
    for use in (_show_bag, _open_for_replay, _repair_bag):
        try:
            use(path)
        except GoalreachError as error:  # noqa: PERF203 - the others are used nevertheless
            refused = error
    if refused is not None:
        raise refused
    return path


def _show_bag(path: Path) -> None:
    with BagReader(path) as bag, contextlib.redirect_stdout(StringIO()):
        show_bag(bag, check=None)


def _open_for_replay(path: Path) -> None:
    use_profile(fast_dds_profile())
    rclpy.init(domain_id=free_domains(1)[0], signal_handler_options=SignalHandlerOptions.NO)
    set_logger_level('player', LoggingSeverity.ERROR)
    try:
        with BagReader(path) as bag:
            Player(bag, ReplayOptions(bag=path), lambda: True, lambda _: '').destroy_node()
    finally:
        rclpy.shutdown()


def _bag_reader(
    folder: Path, name: str, valid: Path, read: Callable[[Path], object], pattern: str = '*'
) -> Reader:
    path = folder / name.replace(' ', '-').replace(',', '')

    def attempt(rng: np.random.Generator) -> object:
        shutil.rmtree(path, ignore_errors=True)
        shutil.copytree(valid, path)
        files = sorted(path.glob(pattern))
        for file in files:
            data = file.read_bytes()
            if file.suffix == '.yaml' and rng.random() < 0.5:  # noqa: PLR2004
                with contextlib.suppress(yaml.YAMLError):
                    data = _as_yaml(mutate_value(yaml.safe_load(data), rng))
                file.write_bytes(data)
            elif rng.random() < 1.2 / len(files):
                file.write_bytes(mutate_bytes(data, rng))
            elif rng.random() < 0.1:  # noqa: PLR2004
                file.unlink()
        return read(path)

    return Reader(name=name, attempt=attempt)
