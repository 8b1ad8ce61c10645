"""The folder in which tailored builds are kept: only what its owner alone could have put there is loaded."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import time
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from secrets import token_hex

from platformdirs import user_cache_path

from rumo.locks import locked

SUFFIX = ".dll" if os.name == "nt" else ".so"
SIZE = 200.0
"""What the libraries of a cache may take together [MB], unless RUMO_CACHE_SIZE says otherwise: some five hundred."""
ABANDONED = 600.0
"""Age from which a folder of a build is left over if the process that made it has ended [s]; no build takes as long."""
FORGOTTEN = 86400.0
"""Age from which it is, whatever process has that number [s]."""
CURE = (
    "The environment variable RUMO_CACHE names the folder for tailored builds: one of your own, with room on its disk."
)


class CacheError(Exception):
    """No folder in which libraries can be kept safely."""


def open_cache() -> Cache:
    """The cache in the folder RUMO_CACHE, or in the user's cache folder, which is made.

    Raises
    ------
    CacheError
        If there is no such folder, or others may write to it; the message has the cure.
    """
    try:
        folder = Path(os.environ.get("RUMO_CACHE") or user_cache_path("rumo"))
        if not (os.environ.get("RUMO_CACHE") or folder.is_absolute()):
            raise CacheError(f"the user's cache folder, {folder}, depends on the current folder. {CURE}")
        return Cache(_own_folder(folder), _size())
    except (OSError, RuntimeError) as error:  # the latter where a user has no home
        raise CacheError(f"no cache folder: {error}. {CURE}") from None


class Cache:
    """Libraries in a folder, each under the name of what it was made from and the digest of what is in it.

    Parameters
    ----------
    folder : Path
        Absolute; checked by `open_cache`.
    size : float
        What the libraries may take together [bytes]; those not used for longest are removed.
    """

    def __init__(self, folder: Path, size: float) -> None:
        self.folder = folder
        self._size = size

    def find(self, name: str) -> Iterator[Path]:
        """The libraries of a name that are whole and the user's own; others of that name are removed."""
        for library in sorted(self.folder.glob(f"{name}-*{SUFFIX}")):
            if self._is_sound(library):
                with suppress(OSError):  # a cache may be read-only
                    os.utime(library)
                yield library
            else:
                self.remove(library)

    def remove(self, library: Path) -> None:
        """Remove a library, if it is there and this user may."""
        with suppress(OSError):
            library.unlink()

    @contextmanager
    def workshop(self) -> Generator[Path]:
        """A folder to build in, on the same disk; it is removed afterwards, and so are those that others left.

        Raises
        ------
        CacheError
            If something cannot be written there.
        """
        self._clean()
        own = self.folder / f"build-{os.getpid()}-{token_hex(4)}"
        try:
            own.mkdir(mode=0o700)
            yield own
        except OSError as error:
            raise CacheError(f"{self.folder} cannot be written to: {error.strerror or error}. {CURE}") from None
        finally:
            shutil.rmtree(own, ignore_errors=True)

    @contextmanager
    def alone(self, name: str, patience: float) -> Generator[None]:
        """Within the block, this process builds what has that name: others that want to as well wait.

        Parameters
        ----------
        name : str
            Of what is built.
        patience : float
            After which both build [s]: the other may hang.
        """
        with ExitStack() as stack:
            with suppress(OSError):  # whether anything can be written there is said by who has to
                stack.enter_context(locked(self.folder / f"{name}.lock", patience))
            yield

    def keep(self, made: Path, name: str) -> None:
        """Move a library from a workshop to its place in one go: no process ever sees half of it."""
        os.chmod(made, 0o644)
        place = self.folder / f"{name}-{_digest(made)}{SUFFIX}"
        os.replace(made, place)
        self._make_room(place)

    def _is_sound(self, library: Path) -> bool:
        try:
            status = library.lstat()
            if not stat.S_ISREG(status.st_mode) or _others_may_change(status):
                return False
            return library.stem.endswith(f"-{_digest(library)}")
        except OSError:
            return False

    def _make_room(self, newest: Path) -> None:
        found: list[tuple[float, int, Path]] = []
        for library in self.folder.glob(f"*{SUFFIX}"):
            with suppress(OSError):  # another process removes it
                status = library.lstat()
                found.append((status.st_mtime, status.st_size, library))
        excess = sum(size for _, size, _ in found) - self._size
        for _, size, library in sorted(found):
            if excess > 0.0 and library != newest:
                self.remove(library)
                excess -= size

    def _clean(self) -> None:
        """Remove what processes left that were killed while they built."""
        for folder in self.folder.glob("build-*"):
            with suppress(OSError):
                age = time.time() - folder.lstat().st_mtime
                if age > (FORGOTTEN if _is_at_work(folder.name) else ABANDONED):
                    shutil.rmtree(folder, ignore_errors=True)


def _own_folder(folder: Path) -> Path:
    """A folder, made if need be, in which only this user and the administrator can change anything."""
    real = folder.resolve()
    for place in (*reversed(real.parents), real):
        try:
            status = place.stat()
        except FileNotFoundError:
            place.mkdir(mode=0o700, exist_ok=True)
            status = place.stat()
        if not stat.S_ISDIR(status.st_mode):
            raise CacheError(f"{place} is no folder. {CURE}")
        # In a parent that everyone may write to, the sticky bit keeps others from moving what is mine.
        if _others_may_change(status) and not (place != real and _is_shared_safely(status)):
            raise CacheError(
                f"others than this user may put libraries into {real}, since {place} belongs to user "
                f"{status.st_uid} and has mode {stat.S_IMODE(status.st_mode):o}. Take their right to write "
                f"(chmod go-w). {CURE}"
            )
    return real


def _others_may_change(status: os.stat_result) -> bool:
    """Whether anyone but this user and the administrator may. Windows keeps a user's folders by lists of its own."""
    if os.name != "posix":
        return False
    return status.st_uid not in (0, os.geteuid()) or bool(status.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _is_shared_safely(status: os.stat_result) -> bool:
    return status.st_uid in (0, os.geteuid()) and bool(status.st_mode & stat.S_ISVTX)


def _is_at_work(name: str) -> bool:
    """Whether the process of a workshop still runs; on Windows, age alone tells."""
    number = name.split("-")[1]
    if os.name != "posix" or not number.isdecimal():
        return False
    try:
        os.kill(int(number), 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        pass
    return True


def _size() -> float:
    """What libraries may take together [bytes]."""
    text = os.environ.get("RUMO_CACHE_SIZE") or str(SIZE)
    try:
        size = float(text)
    except ValueError:
        size = -1.0
    if not size >= 0.0:
        raise CacheError(f"RUMO_CACHE_SIZE: got {text!r}, expected megabytes, a number of at least 0.")
    return 1e6 * size


def _digest(library: Path) -> str:
    return hashlib.sha256(library.read_bytes()).hexdigest()[:32]
