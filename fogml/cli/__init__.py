"""The command line: one declaration per command."""
