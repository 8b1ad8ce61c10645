"""Modules compiled from what is in their files, whatever Python has compiled before."""

from __future__ import annotations

from importlib.machinery import ModuleSpec, SourceFileLoader
from types import CodeType


class AsWritten(SourceFileLoader):
    """Loads a file as it is now, and keeps nothing of it.

    Compiled files are known by size and time, in whole seconds: of two that are alike in these, one would run in the
    other's place, while keys of runs tell what is in a file.
    """

    def get_code(self, fullname: str) -> CodeType:
        """See `importlib.abc.InspectLoader`."""
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


def as_written(spec: ModuleSpec | None) -> ModuleSpec | None:
    """The same, but for how source is loaded."""
    if spec is not None and type(spec.loader) is SourceFileLoader:
        spec.loader = AsWritten(spec.loader.name, spec.loader.path)
    return spec
