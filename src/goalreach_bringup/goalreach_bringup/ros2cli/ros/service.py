"""`ros2 service`: lists and calls services."""

from __future__ import annotations

import argparse
import time

from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from goalreach_bringup.ros2cli.arguments import positive_float
from goalreach_bringup.ros2cli.message_fields import build_message, parse_values
from goalreach_bringup.ros2cli.ros.session import Session, add_session_arguments
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import full_type_name, service_class


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 service`."""
    parser.add_argument('--include-hidden-services', action='store_true')
    verbs = parser.add_subparsers(title='Commands', metavar='VERB', required=True)
    verb = verbs.add_parser('list', help='Output a list of available services')
    add_session_arguments(verb)
    verb.add_argument(
        '-t', '--show-types', action='store_true', help='Additionally show the service type'
    )
    verb.add_argument(
        '-c', '--count-services', action='store_true', help='Only display the number of services'
    )
    verb.add_argument(
        '--include-hidden-services',
        action='store_true',
        default=argparse.SUPPRESS,
        help='Consider hidden services as well',
    )
    verb.set_defaults(run=list_services)

    verb = verbs.add_parser('call', help='Call a service')
    add_session_arguments(verb)
    verb.add_argument('service_name', help="Name of the ROS service (e.g. '/add_two_ints')")
    verb.add_argument('service_type', help="Type of the ROS service (e.g. 'std_srvs/srv/Empty')")
    verb.add_argument(
        'values', nargs='?', default='{}', help="Values of the request in YAML (e.g. '{a: 1}')"
    )
    verb.add_argument(
        '-r', '--rate', metavar='N', type=positive_float, help='Repeat the call at a rate in Hz'
    )
    verb.set_defaults(run=call_service)


def list_services(args: argparse.Namespace) -> None:
    """Print the names of the services."""
    with Session(args) as session:
        session.discover()
        services = {
            name: types
            for name, types in session.services().items()
            if args.include_hidden_services or not topic_or_service_is_hidden(name)
        }
    if args.count_services:
        print(len(services))
        return
    for name, types in services.items():
        print(f'{name} [{", ".join(types)}]' if args.show_types else name)


def call_service(args: argparse.Namespace) -> None:
    """Call a service once or repeatedly, and print request and response.

    Raises:
        CommandError: The type or the values are wrong, or the service has another type.
    """
    service = service_class(args.service_type)
    request, stampers = build_message(service.Request, parse_values(args.values))
    with Session(args) as session:
        print('waiting for service to become available...', flush=True)
        name = session.node.resolve_service_name(args.service_name)
        session.find(lambda: name in session.services())
        offered = session.services().get(name, [])
        wanted = full_type_name(args.service_type, 'srv')
        if offered and wanted not in offered:
            raise CommandError(
                f"The service '{name}' has the type '{', '.join(offered)}', not '{wanted}'"
            )
        client = session.node.create_client(service, name)
        session.spin_until(client.service_is_ready)
        while True:
            for stamp in stampers:
                stamp(session.node.get_clock().now().to_msg())
            print(f'requester: making request: {request!r}\n', flush=True)
            called_s = time.monotonic()
            future = client.call_async(request)
            response = session.result(future, None, 'Exception while calling service')
            print(f'response:\n{response!r}\n', flush=True)
            if args.rate is None:
                return
            session.spin_until(lambda: False, called_s + 1.0 / args.rate - time.monotonic())
