#!/bin/bash
# Run a command in the environment of the cell: LD_LIBRARY_PATH, PYTHONPATH, AMENT_PREFIX_PATH.
source "$CELL_ENVIRONMENT"
exec "$@"
