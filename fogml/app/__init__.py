"""A local web page to drop files on: each click is a command line, run in the background."""
