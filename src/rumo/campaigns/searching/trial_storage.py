"""Where trials are kept: a journal in a folder of one process, or a database of several."""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rumo.errors import ArgumentError, CampaignError
from rumo.extras import required

PATIENCE = 60.0
"""How long a process waits while others write to a SQLite database [s]."""


class _NoLock:
    """The folder of a journal has one process that writes. Optuna's own lock would outlive one that is killed."""

    def acquire(self) -> bool:
        return True

    def release(self) -> None:
        return


def optuna_for(what: str) -> Any:
    """Optuna, silent but for what it raises.

    Raises
    ------
    ArgumentError
        If it is not installed, or too old.
    """
    optuna = required("optuna", "campaign", what)
    if not hasattr(optuna.Trial, "set_constraint"):
        raise ArgumentError(what, f"Optuna {optuna.__version__}", "Optuna 5", 'pip install -U "rumo[campaign]"')
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def is_url(storage: str | Path | None) -> bool:
    """Whether a storage is a database, which others may use as well."""
    return "://" in str(storage)


def opened(optuna: Any, storage: str | Path | None) -> Any:
    """A storage of Optuna's.

    Parameters
    ----------
    optuna : module
        The package.
    storage : str or Path, optional
        A journal file in a folder to which only this process writes, or the URL of a database; memory without one.
    """
    if storage is None:
        return optuna.storages.InMemoryStorage()
    if is_url(storage):
        how: dict[str, Any] = {}
        if str(storage).startswith("sqlite:"):
            from sqlalchemy import NullPool

            # Nobody closes a pool: its files would stay open as long as the process lives.
            how = {"connect_args": {"timeout": PATIENCE}, "poolclass": NullPool}
        return optuna.storages.RDBStorage(str(storage), engine_kwargs=how)
    _cut(Path(storage))
    journal = optuna.storages.journal
    return optuna.storages.JournalStorage(journal.JournalFileBackend(str(storage), _NoLock()))


def _cut(path: Path) -> None:
    """Take away half a line, which a process that was killed has left: what comes next would be appended to it."""
    if path.is_file():
        with path.open("rb+") as file:
            content = file.read()
            file.truncate(content.rfind(b"\n") + 1)


def shown(storage: str | Path | None) -> str:
    """A storage for readers, without its password."""
    return re.sub(r"(//[^:/@]*):[^@]*@", r"\1:***@", str(storage))


@contextmanager
def opening(storage: str | Path | None) -> Generator[None]:
    """Whatever keeps a storage from being opened is an error of the argument."""
    try:
        yield
    except ArgumentError:
        raise
    except Exception as error:  # of SQLAlchemy, a database's driver, or the file system
        got = f"{shown(storage)} ({_first_line(error)})"
        raise ArgumentError("storage", got, "a file or database that can be opened") from None


@contextmanager
def reached(optuna: Any, storage: str | Path | None) -> Generator[None]:
    """A storage that can no longer be read or written ends the search; nothing that it has is lost."""
    try:
        yield
    except (OSError, optuna.exceptions.StorageInternalError) as error:
        told = _first_line(error.__cause__ or error)
        words = f"Trials cannot be kept in {shown(storage)}: {told}. Those that are there stay. Start again to go on."
        raise CampaignError(words) from error


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0].removesuffix(".") or type(error).__name__
