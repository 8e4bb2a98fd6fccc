"""The only modules of pack_msgs_py that import ROS: conversions, QoS, parameters of a node."""
