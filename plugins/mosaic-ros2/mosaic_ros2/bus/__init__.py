"""The way to ROS 2's nodes: one small Protocol, over DDS or Zenoh."""
