"""Files that cannot be written, in words: most often the disk is full."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from errno import EDQUOT, EFBIG, ENOSPC
from pathlib import Path

from rumo.errors import CampaignError


@contextmanager
def writing_to(folder: Path, stored: Callable[[], str] = lambda: "What is stored stays.") -> Generator[None]:
    """Whatever keeps files in a folder from being written is an error that names it.

    Parameters
    ----------
    folder : Path
        The campaign's.
    stored : callable, optional
        What has been stored until then, a sentence.

    Raises
    ------
    CampaignError
        In place of an OSError.
    """
    try:
        yield
    except OSError as error:
        cure = "Make room" if error.errno in (ENOSPC, EDQUOT, EFBIG) else "See to it"
        raise CampaignError(
            f"{folder} cannot be written to: {error.strerror or error}. {stored()} {cure}, and start again to go on."
        ) from error
