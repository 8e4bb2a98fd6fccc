"""Where the arm reaches in a layout, and how long it takes to get there."""
