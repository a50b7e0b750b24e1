"""A node of ROS itself, run by a Python that has rclpy: publishes ten times a second, and prints each velocity and each
state of joints that it is told."""

import json

import rclpy
from geometry_msgs.msg import Twist
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import Image, Imu, JointState, LaserScan
from std_srvs.srv import SetBool

rclpy.init()
node = rclpy.create_node("acme")
scans = node.create_publisher(LaserScan, "/scan", qos_profile_sensor_data)
images = node.create_publisher(Image, "/image", qos_profile_sensor_data)
imus = node.create_publisher(Imu, "/imu", 10)
scan = LaserScan(angle_min=-1.0, angle_max=1.0, angle_increment=1.0, range_max=8.0, ranges=[1.0, 2.0, 9.0])
image = Image(height=48, width=64, step=192, encoding="rgb8")
image.data.frombytes(bytes((10, 20, 30)) * 64 * 48)
imu = Imu()
imu.linear_acceleration.z = 9.81


def speak() -> None:
    scans.publish(scan)
    images.publish(image)
    imus.publish(imu)


def tell(**said: object) -> None:
    print(json.dumps(said), flush=True)


node.create_timer(0.1, speak)
node.create_subscription(Twist, "/cmd_vel", lambda heard: tell(x=heard.linear.x, turn=heard.angular.z), 10)
node.create_subscription(JointState, "/joints", lambda heard: tell(names=list(heard.name)), 10)
node.create_service(SetBool, "/lamp", lambda _, answer: answer)
tell(rmw=rclpy.get_rmw_implementation_identifier())
rclpy.spin(node)
