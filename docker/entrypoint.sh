#!/bin/bash
# Run a command in the environment of the cell: LD_LIBRARY_PATH, PYTHONPATH, AMENT_PREFIX_PATH, and
# how messages travel.
source "$CELL_ENVIRONMENT"
cell_tools=/cell/tools
source "$cell_tools/transport.sh"
# Numba insists on a cache that it can write: another user (docker run --user) has a copy of it.
if [ -d "${NUMBA_CACHE_DIR:-}" ] && [ ! -w "$NUMBA_CACHE_DIR" ]; then
  own=${XDG_CACHE_HOME:-${HOME:-/tmp}/.cache}/packing-cell-numba
  [ -d "$own" ] || { mkdir -p "$own" && cp -r "$NUMBA_CACHE_DIR/." "$own/"; }
  export NUMBA_CACHE_DIR=$own
fi
exec "$@"
