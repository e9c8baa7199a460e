"""A ROS 2 node: joint states in, the touch that is felt out, by a decoder of feeler robot train.

python antenna_node.py my.decoder        (topics: /joint_states, and /antenna/touch as JSON)
"""

import json
import sys

import numpy as np

from feeler.errors import InvalidInput
from feeler.robot import RobotDecoder
from feeler.tensors.bags import choose_names


class Feeler:
    """The part without ROS: joints by name and a time [ms] in, an answer out if it is new.

    A message without all of the antenna's joints is of another publisher, and gives none.
    """

    def __init__(self, path):
        decoder = RobotDecoder.load(path)
        self.joints, self.n = decoder.joints or ("*",), decoder.antenna.sensors.size
        self.touch, self.last = decoder.start(), None

    def take(self, names, position, time):
        try:
            wanted = choose_names(list(names), self.joints)
        except InvalidInput:  # of another publisher
            return None
        if len(wanted) != self.n:
            return None
        angle = [position[list(names).index(name)] for name in wanted]
        state = self.touch.update(np.array(angle), time)
        found = {"state": state.state, "touch": state.label, "unlike_all": bool(state.strange)}
        if state.state == "over":
            self.touch.begin()
        new, self.last = found != self.last, found
        sure = float(state.probability)  # not a number before contact, which JSON does not know
        return (
            {**found, "probability": round(sure, 3) if sure == sure else None} if new else None
        )


def main():
    import rclpy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import String

    rclpy.init()
    node, feeler = rclpy.create_node("antenna"), Feeler(sys.argv[1])
    out = node.create_publisher(String, "/antenna/touch", 10)

    def hear(message):
        time = message.header.stamp.sec * 1e3 + message.header.stamp.nanosec * 1e-6
        if answer := feeler.take(message.name, message.position, time):
            out.publish(String(data=json.dumps(answer)))

    node.create_subscription(JointState, "/joint_states", hear, 100)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
