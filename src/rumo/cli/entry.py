"""The beginning and the end of the command, whatever happens in between."""

import sys


def main() -> None:
    """Run the command.

    Ctrl-C is an exit code, also while modules are imported; a file or an output that cannot be written is one line on
    standard error, a reader that has gone away is silence.
    """
    try:
        code = _guarded()
    except KeyboardInterrupt:
        from rumo.interrupts import EXIT_CODE

        code = EXIT_CODE
    sys.exit(code)


def _guarded() -> int | str | None:
    """Its exit code, also if nobody can read what it says."""
    from contextlib import redirect_stderr

    from rumo.cli.streams import Unheeded, give_up, open_closed  # takes a while, in which Ctrl-C may come

    open_closed()
    with redirect_stderr(Unheeded()):
        try:
            code = _run()
            sys.stdout.flush()
        except BrokenPipeError:
            give_up(sys.stdout)
            return 1
        except OSError as error:
            # Errors of files say which one.
            if error.filename is None:
                give_up(sys.stdout)
            print(f"Error: {'' if error.filename else 'the output cannot be written: '}{error}", file=sys.stderr)
            return 1
    return code


def _run() -> int | str | None:
    from rumo.cli.app import app

    try:
        app(prog_name="rumo")
    except SystemExit as end:
        return end.code
    return 0
