"""``python -m ros2cli_standin``: what ``ros2`` is where ROS has no command line."""

import sys

from ros2cli_standin.cli import main

sys.exit(main())
