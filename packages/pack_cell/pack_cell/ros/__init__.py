"""The recorder: the only room of this package that imports ROS."""
