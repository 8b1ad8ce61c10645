"""`python -m rumo` is the command `rumo`."""

from rumo.cli import main

main()
