"""ROS 2 for MOSAIC: topics, pictures, point clouds, commands, services and actions, without a ROS installation."""
