"""The `replay` command."""

from __future__ import annotations

import argparse

from goalreach_bringup.commands.not_there_yet import refuse

__all__ = ['SUMMARY', 'configure', 'execute']

SUMMARY = 'Replay a rosbag2 directory into the graph (not there yet)'


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options: none so far."""
    parser.add_argument('rest', nargs='*', help=argparse.SUPPRESS)


def execute(_options: argparse.Namespace) -> int:
    """Say that the command is not there yet."""
    return refuse('replay')
