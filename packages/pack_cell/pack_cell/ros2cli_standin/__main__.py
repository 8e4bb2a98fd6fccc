"""``python -m pack_cell.ros2cli_standin``: what ``ros2`` is where ROS has no command line."""

import sys

from pack_cell.ros2cli_standin.cli import main

sys.exit(main())
