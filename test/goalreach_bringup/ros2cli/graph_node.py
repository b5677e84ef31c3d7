"""A node with a bit of everything, for the commands to look at; ends with SIGTERM."""

from __future__ import annotations

import sys

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import SetBool

from goalreach_msgs_py.ros.process import StopRequest


class Talker(Node):
    def __init__(self) -> None:
        super().__init__('talker', namespace='/ns')
        limits = [FloatingPointRange(from_value=0.0, to_value=2.0)]
        self.declare_parameter('speed', 1.5, ParameterDescriptor(floating_point_range=limits))
        self.declare_parameter('gains.angular', [1.0, 2.0])
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        status = DiagnosticStatus(
            level=b'\x01', name='region_state', values=[KeyValue(key='mu_x.FRONT', value='0.25')]
        )
        self.create_publisher(DiagnosticArray, '/state', latched).publish(
            DiagnosticArray(status=[status])
        )
        self._chatter = self.create_publisher(String, '/chatter', 10)
        self._point = self.create_publisher(Point, '/point', qos_profile_sensor_data)
        self._array = self.create_publisher(Float64MultiArray, '/array', 10)
        self.create_subscription(String, '/in', self._on_text, 10)
        self.create_service(SetBool, '/ns/switch', self._on_switch)
        self.create_timer(0.05, self._on_timer)

    def _on_timer(self) -> None:
        self._chatter.publish(String(data='hello: world'))
        self._point.publish(Point(x=1.0, y=-2.5, z=1e-7))
        self._array.publish(Float64MultiArray(data=[float(i) for i in range(200)]))

    def _on_text(self, message: String) -> None:
        sys.stdout.write(f'heard {message.data}\n')
        sys.stdout.flush()

    def _on_switch(self, request: SetBool.Request, response: SetBool.Response) -> object:
        response.success = request.data
        response.message = 'done'
        return response


def main() -> None:
    # rclpy's own signal handler would invalidate the context in the middle of a callback.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    stop = StopRequest()
    node = Talker()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    sys.stdout.write('ready\n')
    sys.stdout.flush()
    while not stop.requested:
        executor.spin_once(timeout_sec=0.25)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == '__main__':
    main()
