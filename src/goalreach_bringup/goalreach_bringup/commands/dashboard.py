"""The `dashboard` command: the live page of a graph that runs, or of a bag that is replayed."""

from dataclasses import dataclass
import os
from pathlib import Path
import secrets
import socket

from goalreach_evaluation.choices import arena_option, choose_arena
from goalreach_msgs_py.options import CommandOptions, option, parse_namespace

SUMMARY = 'Show the live page of a graph that already runs, or of a bag that is replayed'


@dataclass(frozen=True, kw_only=True)
class Options(CommandOptions):
    """Options of the command."""

    host: str = option(
        '127.0.0.1',
        'address to listen on; any address but this machine needs a token, which is printed',
        metavar='ADDRESS',
    )
    port: int | None = option(
        None,
        'port; 0: any free one (default: the first free one from 8080)',
        minimum=0,
        maximum=65535,
    )
    arena: str = arena_option()
    robot: str = option(
        '', 'namespace of the robot that is shown', metavar='NAME',
        parse=lambda text: text and parse_namespace(text, '--robot'),
    )  # fmt: skip
    events: Path | None = option(None, 'reports of the run that started the page', hidden=True)
    listener: int | None = option(None, 'number of the socket of that run', hidden=True, minimum=0)


def execute(options: Options) -> int:
    """Serve the page until Ctrl-C."""
    from goalreach_bringup.launch.auxiliary_processes import require_page

    require_page()
    from goalreach_dashboard.address import TOKEN_VARIABLE, bind, is_loopback, url
    from goalreach_dashboard.web.server import serve

    local = is_loopback(options.host)
    arena = choose_arena(options.arena)
    if options.listener is not None:  # the launcher has printed the link
        token = os.environ.get(TOKEN_VARIABLE)
        listener = socket.socket(fileno=options.listener)
    else:
        token = None if local else secrets.token_urlsafe(24)
        listener = bind(options.host, options.port)
        port = int(listener.getsockname()[1])
        print(f'live page: {url(options.host, port, token)}', flush=True)
    return serve(
        listener, arena=arena, token=token, local=local, events=options.events, robot=options.robot
    )
