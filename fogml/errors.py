"""The errors that fogml raises on purpose.

Anything else that escapes is a defect. The command line turns an `InputError` into one
message and exit status 2.
"""

from __future__ import annotations


class FogmlError(Exception):
    """Base of every error that fogml raises on purpose."""


class InputError(FogmlError):
    """Bad input or usage.

    The message names the file, the column and the row where they are known, what was
    expected, and what to do.
    """
