"""The connectors of an original robot with ROS 2, as its file has them."""

ORIGINAL_CONNECTORS = """\
  - { type: ros2-sender-sensor-Image, label: camera, params: { topic_name: "/camera/image_raw", recordable: "true" } }
  - type: ros2-sender-sensor-PointCloud2
    label: lidar
    params: { topic_name: /points, parallel_num: "3", stream_mode: progressive, voxel_size: "0.5", min_points_to_subdivide: "10" }
  - { type: ros2-sender-sensor-PointCloud2, label: lidar_main, params: { topic_name: /points, parallel_num: "1" } }
  - { type: ros2-sender-sensor-NavSatFix, label: gps, params: { topic_name: /fix } }
  - { type: ros2-sender-geometry-Pose, label: pose, params: { topic_name: /pose } }
  - { type: ros2-sender-geometry-PoseWithCovarianceStamped, label: amcl, params: { topic_name: /amcl_pose } }
  - { type: ros2-receiver-geometry-Twist, label: cmd_vel, params: { topic_name: /cmd_vel } }
  - { type: ros2-receiver-geometry-TwistStamped, label: cmd_vel_stamped, params: { topic_name: cmd_vel_stamped } }
"""  # noqa: E501 - as such files have it
