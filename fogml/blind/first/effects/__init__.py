"""Other forms of the catalogue's effects, by subject."""
