"""The only modules of pack_cell that import ROS."""
