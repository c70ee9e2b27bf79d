"""The diagnosis on development cases, and the record of the one before it."""
