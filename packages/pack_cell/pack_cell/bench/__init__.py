"""The benchmark: packing without arm, belt or ROS, many collections of boxes, and its figures."""
