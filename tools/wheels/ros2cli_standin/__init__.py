"""A stand-in for the ``ros2`` command where ROS 2 comes from wheels, which do not carry it.

It has the commands that the documentation of this project uses, with the syntax, the output and
the exit codes of ros2cli. A real ``ros2`` on the path is always preferred.
"""
