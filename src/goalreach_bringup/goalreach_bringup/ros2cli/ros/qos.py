"""Quality of service: options of `ros2 topic`, and profiles compatible with the publishers."""

import argparse
from collections.abc import Iterable
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import (
    QoSDurabilityPolicy,
    QoSHistoryPolicy,
    QoSLivelinessPolicy,
    QoSPresetProfiles,
    QoSReliabilityPolicy,
)

from goalreach_bringup.ros2cli.arguments import SECONDS, add

_POLICIES = {
    'reliability': QoSReliabilityPolicy,
    'durability': QoSDurabilityPolicy,
    'history': QoSHistoryPolicy,
    'liveliness': QoSLivelinessPolicy,
}


def add_qos_arguments(parser: argparse.ArgumentParser, *, preset: str) -> None:
    """Add the `--qos-...` options.

    Args:
        parser: Parser of the verb.
        preset: Key of the default profile, which the other options change.
    """
    presets = {'choices': QoSPresetProfiles.short_keys(), 'default': preset}
    add(
        parser,
        ('--qos-profile', 'Quality of service preset (default: %(default)s)', presets),
        ('--qos-depth', 'Queue size', {'metavar': 'N', 'type': int}),
        ('--qos-liveliness-lease-duration-seconds', 'Its liveliness lease duration', SECONDS),
    )
    for name, policy in _POLICIES.items():
        text = f'Quality of service {name} setting (overrides that of --qos-profile)'
        add(parser, (f'--qos-{name}', text, {'choices': policy.short_keys()}))


def profile_from_options(args: argparse.Namespace) -> Any | None:
    """Return the profile that the options select, None where they name no policy."""
    named = {name: getattr(args, f'qos_{name}') for name in _POLICIES}
    lease_s = args.qos_liveliness_lease_duration_seconds
    if args.qos_depth is None and lease_s is None and not any(named.values()):
        return None
    profile = QoSPresetProfiles.get_from_short_key(args.qos_profile)
    for name, key in named.items():
        if key is not None:
            setattr(profile, name, _POLICIES[name].get_from_short_key(key))
    if lease_s is not None:
        profile.liveliness_lease_duration = Duration(seconds=lease_s)
    if args.qos_depth is not None:
        profile.depth = args.qos_depth
    elif profile.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL and profile.depth == 0:
        profile.depth = 1
    return profile


def compatible_profile(preset: str, publishers: Iterable[Any]) -> tuple[Any, list[str]]:
    """Return the strictest profile that receives from all publishers.

    Reliable if all are, transient local if all are; the preset where there is no publisher.

    Args:
        preset: Key of the profile for all other policies.
        publishers: Their endpoint information.

    Returns:
        The profile, and a line for the user per fallback.
    """
    profile = QoSPresetProfiles.get_from_short_key(preset)
    offered = [publisher.qos_profile for publisher in publishers]
    if not offered:
        return profile, []
    notes = []
    for name, strict, weak in (
        ('reliability', 'RELIABLE', 'BEST_EFFORT'),
        ('durability', 'TRANSIENT_LOCAL', 'VOLATILE'),
    ):
        policy: Any = _POLICIES[name]
        meets = [getattr(offer, name) == policy[strict] for offer in offered]
        setattr(profile, name, policy[strict if all(meets) else weak])
        if any(meets) and not all(meets):
            notes.append(
                f'Some, but not all, publishers are offering QoS{policy.__name__}.{strict}. '
                f'Falling back to QoS{policy.__name__}.{weak} as it will connect to all publishers'
            )
    return profile, notes
