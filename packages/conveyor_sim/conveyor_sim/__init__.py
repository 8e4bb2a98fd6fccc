"""Supplies the cell: box streams, a circular belt, a scanner and a durable ledger.

Only :mod:`conveyor_sim.ros.node` imports ROS.
"""
