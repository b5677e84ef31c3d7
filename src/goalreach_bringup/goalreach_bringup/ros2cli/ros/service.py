"""`ros2 service`: its verbs; calls services and shows their events."""

import argparse
import time
from typing import Any, Final

from rclpy.qos import qos_profile_services_default
from service_msgs.msg import ServiceEventInfo

from goalreach_bringup.ros2cli.arguments import add_values, positive_float, ros_name, values_text
from goalreach_bringup.ros2cli.message_fields import build_message, parse_values
from goalreach_bringup.ros2cli.message_text import message_to_csv, message_values, values_to_yaml
from goalreach_bringup.ros2cli.ros import names
from goalreach_bringup.ros2cli.ros.session import Session, add_verb
from goalreach_bringup.ros2cli.ros.topic_echo import TEXT_ARGUMENTS, text_options
from goalreach_msgs_py.errors import CommandError
from goalreach_msgs_py.ros.interfaces import full_type_name, service_class

_EVENTS: Final = {
    getattr(ServiceEventInfo, name): name
    for name in ('REQUEST_SENT', 'REQUEST_RECEIVED', 'RESPONSE_SENT', 'RESPONSE_RECEIVED')
}


def add_verbs(parser: argparse.ArgumentParser) -> None:
    """Add the verbs of `ros2 service`."""
    verbs = names.add_verbs(parser, 'service')
    name = ('service_name', "Name of the ROS service (e.g. '/add_two_ints')", {'type': ros_name})
    type_text = "Type of the ROS service (e.g. 'std_srvs/srv/Empty')"
    rate = ('-r --rate', 'Repeat at a rate in Hz', {'metavar': 'N', 'type': positive_float})
    kind: tuple[Any, ...] = ('service_type', type_text)
    verb = add_verb(verbs, 'call', 'Call a service', call_service, name, kind, rate)
    add_values(verb, "Values of the request in YAML (e.g. '{a: 1}')")
    text = 'Echo a service, whose introspection must be on'
    kind = ('service_type', type_text, {'nargs': '?'})
    add_verb(verbs, 'echo', text, echo_service, name, kind, *TEXT_ARGUMENTS)


def echo_service(args: argparse.Namespace) -> None:
    """Print the events of a service as they arrive.

    Raises:
        CommandError: The service is not there, or its type is not known here.
    """
    options = text_options(args)

    def on_event(event: Any) -> None:
        if args.csv:
            print(message_to_csv(event, options), flush=True)
            return
        values = message_values(event, options)
        values['info']['event_type'] = _EVENTS.get(event.info.event_type, event.info.event_type)
        print(f'{values_to_yaml(values, options)}---', flush=True)

    with Session(args) as session:
        name = session.node.resolve_service_name(args.service_name)
        if args.service_type is None:
            session.discover(lambda: name in session.services())
            args.service_type = next(iter(session.services().get(name, [])), None)
        if args.service_type is None:
            raise CommandError('Could not load the type for the passed service')
        kind = service_class(args.service_type).Event
        session.node.create_subscription(
            kind, f'{name}/_service_event', on_event, qos_profile_services_default
        )
        session.spin_until(lambda: False)


def call_service(args: argparse.Namespace) -> None:
    """Call a service once or repeatedly, and print request and response.

    Raises:
        CommandError: The type or the values are wrong, or the service has another type.
    """
    service = service_class(args.service_type)
    request, stampers = build_message(service.Request, parse_values(values_text(args)))
    with Session(args) as session:
        print('waiting for service to become available...', flush=True)
        name = session.node.resolve_service_name(args.service_name)
        session.spin_until(lambda: name in session.services(), session.spin_time_s)
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
