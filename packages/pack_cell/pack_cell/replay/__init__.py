"""A recorded run seen again: as a page, decided again, as a picture."""
