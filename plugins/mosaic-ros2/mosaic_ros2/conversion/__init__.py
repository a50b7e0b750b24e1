"""Between ROS' messages and ours: standard messages, plain JSON, pictures and point clouds."""
