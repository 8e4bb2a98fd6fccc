#!/bin/bash
# Run a command in the environment of the cell: LD_LIBRARY_PATH, PYTHONPATH, AMENT_PREFIX_PATH, and
# how messages travel.
source "$CELL_ENVIRONMENT"
cell_tools=/cell/tools
source "$cell_tools/transport.sh"
exec "$@"
