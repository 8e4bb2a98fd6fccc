"""``python -m pack_cell``: the same as ``./cell`` after set-up."""

import sys

from pack_cell.cli import main

sys.exit(main())
