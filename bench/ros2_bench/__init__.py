"""The parts of `bench/ros2.py`: a node that shows pictures and clouds, and a bridge in the manner of rosbridge."""
