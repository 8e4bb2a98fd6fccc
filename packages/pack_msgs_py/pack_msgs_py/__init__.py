"""The vocabulary of the packing cell in plain Python.

Nothing here imports ROS, except the room :mod:`pack_msgs_py.ros`, which nodes use and cores do not.
"""
