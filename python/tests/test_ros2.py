"""The node of docs/ros2.md, with stand-ins for the parts of ROS 2 that it uses."""

import importlib.util
import sys
import types
from pathlib import Path

import numpy as np
import pytest

NODE = Path(__file__).parents[2] / "examples" / "python" / "ros2_taxels.py"


class Image:
    """sensor_msgs/Image, with its fields and no others."""

    __slots__ = ("header", "height", "width", "encoding", "is_bigendian", "step", "data")

    def __init__(self, **fields):
        self.header = types.SimpleNamespace(stamp=None, frame_id="")
        for name, value in fields.items():
            setattr(self, name, value)


class Publisher:
    def __init__(self):
        self.published = []

    def publish(self, message):
        self.published.append(message)


class Node:
    def __init__(self, name):
        self.name, self.publishers, self.timers = name, {}, []

    def create_publisher(self, kind, topic, depth):
        assert kind is Image and depth > 0
        self.publishers[topic] = Publisher()
        return self.publishers[topic]

    def create_timer(self, period, callback):
        self.timers.append((period, callback))

    def get_clock(self):
        now = types.SimpleNamespace(to_msg=lambda: "now")
        return types.SimpleNamespace(now=lambda: now)


@pytest.fixture
def node(monkeypatch):
    parts = {
        "rclpy": {"init": lambda: None, "spin": lambda node: None},
        "rclpy.node": {"Node": Node},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"Image": Image},
    }
    for name, contents in parts.items():
        module = types.ModuleType(name)
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("ros2_taxels", NODE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.Taxels()


def values(message):
    assert (message.height, message.width, message.step, message.encoding) == (10, 10, 40, "32FC1")
    assert (message.header.stamp, message.header.frame_id) == ("now", "skin")
    return np.frombuffer(message.data, "<f4").reshape(message.height, message.width)


def test_the_node_publishes_what_presses_and_what_is_decoded(node):
    [(period, tick)] = node.timers
    # a quarter of the cup's way: it is deepest after 12 to 13 ticks
    for _ in range(13):
        tick()
    pressure, decoded = (node.publishers[f"skin/{name}"].published for name in ("pressure", "decoded"))
    assert period == pytest.approx(0.02) and len(pressure) == len(decoded) == 13
    deep, image = values(pressure[-1]), values(decoded[-1])
    assert deep.max() > 1e3
    assert np.isfinite(image).all()
    assert np.corrcoef(deep.ravel(), image.ravel())[0, 1] > 0.5
