"""The program `posegate`."""

import signal
import sys

from . import _core


def main() -> None:
    """Runs the command line and ends the process with its exit code."""
    # Python would handle Ctrl-C only after the command has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    sys.exit(_core.program(_core.__file__, ["posegate", *sys.argv[1:]]))
