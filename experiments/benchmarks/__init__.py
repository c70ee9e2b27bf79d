"""Speed and memory of fogml beside the plain way of doing the same, in one process on one machine."""
