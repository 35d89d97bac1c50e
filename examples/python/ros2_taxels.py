"""A ROS 2 node that publishes a tactile skin: `python3 ros2_taxels.py`, with a ROS 2 environment sourced.

Publishes, 50 times a second, sensor_msgs/Image of encoding 32FC1, rows × columns of taxels, row 0 first:

    /skin/pressure   what presses on the taxels, Pa
    /skin/decoded    what a decoder makes of 20 measurements of the skin's one wire, V

A cup is moved up and down here; in your node, the poses come from your robot (tf2, or its simulator). Needs rclpy,
sensor_msgs and spts.
"""

import math

import rclpy
import spts
from rclpy.node import Node
from sensor_msgs.msg import Image

RATE_HZ = 50.0
MEASUREMENTS = 20


class Taxels(Node):
    """The skin, what touches it, and its wire."""

    def __init__(self):
        super().__init__("spts_taxels")
        self.skin = spts.Skin(rows=10, cols=10, pitch=0.015)
        self.cup = spts.Body.cylinder(radius=0.03, length=0.08)
        self.wire = spts.Wire(self.skin, readout="as_built", seeds="mixed", seed=1)
        self.pressure = self.create_publisher(Image, "skin/pressure", 10)
        self.decoded = self.create_publisher(Image, "skin/decoded", 10)
        self.ticks = 0
        self.create_timer(1.0 / RATE_HZ, self.tick)

    def tick(self):
        # 2 mm up and down; the cup's origin is 40 mm above its bottom
        height = 0.04 - 0.002 * math.sin(2.0 * math.pi * self.ticks / RATE_HZ)
        self.ticks += 1
        touch = self.skin.touch({self.cup: ((0.0, 0.0, height), (1.0, 0.0, 0.0, 0.0))}, dt=1.0 / RATE_HZ)
        y, phi = self.wire.record(touch, MEASUREMENTS)
        self.pressure.publish(self.image(touch.pressure))
        self.decoded.publish(self.image(spts.decode(phi, y, self.skin)))

    def image(self, taxels):
        message = Image(height=taxels.shape[0], width=taxels.shape[1], encoding="32FC1", is_bigendian=0)
        message.step = 4 * taxels.shape[1]
        message.data = taxels.astype("<f4").tobytes()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = "skin"
        return message


def main():
    rclpy.init()
    rclpy.spin(Taxels())


if __name__ == "__main__":
    main()
