"""`python -m rumo` is the command `rumo`."""

from rumo.cli import app

app(prog_name="rumo")
