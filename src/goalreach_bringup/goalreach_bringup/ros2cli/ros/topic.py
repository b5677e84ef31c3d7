"""`ros2 topic`: its verbs."""

from __future__ import annotations

import argparse

from goalreach_bringup.ros2cli.arguments import add_flags
from goalreach_bringup.ros2cli.ros import names, topic_echo, topic_pub, topic_statistics


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 topic`."""
    verbs = names.add_verbs(parser, 'topic')
    for name, text in (
        ('list', 'List full details about each topic'),
        ('info', 'Print node name, type and QoS of each publisher and subscription'),
    ):
        add_flags(verbs.choices[name], ('-v', '--verbose', text))
    topic_statistics.add_verbs(verbs)
    topic_echo.add_arguments(verbs.add_parser('echo', help='Output messages from a topic'))
    topic_pub.add_arguments(verbs.add_parser('pub', help='Publish a message to a topic'))
