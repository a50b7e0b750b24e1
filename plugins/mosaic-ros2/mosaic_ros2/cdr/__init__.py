"""CDR, the form in which ROS 2 sends its messages: plain Python values from bytes, and back."""
