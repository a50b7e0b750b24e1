"""The bus over Zenoh: reaches ROS nodes whose RMW is rmw_zenoh."""
