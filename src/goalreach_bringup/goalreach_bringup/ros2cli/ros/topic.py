"""`ros2 topic`: its verbs."""

import argparse

from goalreach_bringup.ros2cli.arguments import add
from goalreach_bringup.ros2cli.ros import names, topic_echo, topic_pub, topic_statistics


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 topic`."""
    verbs = names.add_verbs(parser, 'topic')
    for name, text in (
        ('list', 'List full details about each topic'),
        ('info', 'Print node name, type and QoS of each publisher and subscription'),
    ):
        add(verbs.choices[name], ('-v --verbose', text))
    topic_statistics.add_verbs(verbs)
    topic_echo.add_to(verbs)
    topic_pub.add_to(verbs)
