"""The vocabulary of the packing cell in plain Python.

Nothing here imports ROS, except :mod:`pack_msgs_py.conversions`, :mod:`pack_msgs_py.qos` and
:mod:`pack_msgs_py.ros_params`, which nodes use and cores do not.
"""
