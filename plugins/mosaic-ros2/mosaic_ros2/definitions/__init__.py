"""What ROS 2 messages, services and actions consist of."""
