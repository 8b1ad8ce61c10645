"""The beginning and the end of the command, whatever happens in between."""

from __future__ import annotations

import sys

from rumo.cli.streams import Unheeded, give_up, open_closed
from rumo.interrupts import EXIT_CODE


def main() -> None:
    """Run the command.

    Ctrl-C is an exit code, also while modules are imported; a file or an output that cannot be written is one line on
    standard error, a reader that has gone away is silence.
    """
    open_closed()
    code: int | str | None = 1
    try:
        code = _run()
        sys.stdout.flush()
    except BrokenPipeError:
        give_up(sys.stdout)
    except OSError as error:
        # Errors of files say which one.
        if error.filename is None:
            give_up(sys.stdout)
        print(f"Error: {'' if error.filename else 'the output cannot be written: '}{error}", file=Unheeded())
    except KeyboardInterrupt:
        code = EXIT_CODE
    sys.exit(code)


def _run() -> int | str | None:
    from rumo.cli.app import app  # takes a while, in which Ctrl-C may come

    try:
        app(prog_name="rumo")
    except SystemExit as end:
        return end.code
    return 0
