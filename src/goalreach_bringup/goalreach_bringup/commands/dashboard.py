"""The `dashboard` command: the live page of a graph that runs, or of a bag that is replayed."""

from __future__ import annotations

import argparse
import os
import secrets

from goalreach_evaluation.choices import add_arena_option
from goalreach_msgs_py.errors import ConfigurationError, GoalreachError

SUMMARY = 'Show the live page of a graph that already runs, or of a bag that is replayed'

_LARGEST_PORT = 65535


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add(
        '--host',
        default='127.0.0.1',
        help='address to listen at; any but this machine alone needs a token, which is printed',
    )
    add(
        '--port',
        type=int,
        metavar='N',
        help='port; 0: any free one (default: the first from 8080)',
    )
    add_arena_option(parser)
    add('--controls', action='store_true', help=argparse.SUPPRESS)


def execute(options: argparse.Namespace) -> int:
    """Serve the page until Ctrl-C.

    Raises:
        GoalreachError: The web library is missing, or the address cannot be listened at.
    """
    if options.port is not None and not 0 <= options.port <= _LARGEST_PORT:
        raise ConfigurationError('--port', options.port, 'from 0 to 65535')
    try:
        import nicegui  # noqa: F401 - only whether it is there
    except ModuleNotFoundError as error:
        reason = f'needs {error.name}: install the extra, pip install "goalreach[dashboard]"'
        raise GoalreachError(reason) from None
    from goalreach_dashboard.ros.graph import serve
    from goalreach_dashboard.web.access import TOKEN_VARIABLE, bind, is_loopback, url
    from goalreach_evaluation.choices import choose_arena

    local = is_loopback(options.host)
    token = os.environ.get(TOKEN_VARIABLE) or None
    if options.controls and (token is None or not local):
        raise ConfigurationError('--controls', options.host, 'used by run, on this machine')
    if not options.controls:
        token = None if local else secrets.token_urlsafe(24)
    arena = choose_arena(options.arena)
    listener = bind(options.host, options.port)
    port = int(listener.getsockname()[1])
    shown = None if options.controls else token  # the launcher tells its own link
    print(f'live page: {url(options.host, port, shown)}', flush=True)
    return serve(listener, arena=arena, token=token, local=local)
