"""What a process has printed before its end, as far as it says why."""

from __future__ import annotations

import re
from itertools import takewhile

LONGEST = 2000
"""Characters that are kept."""
FRAMES = 10
"""Calls of a dump that are kept, the innermost."""

_DUMP = re.compile(r"^(Fatal Python error:|Windows fatal exception:|Timeout \()", re.MULTILINE)
_CALL = re.compile(r"^  File .*$", re.MULTILINE)
_OWN = re.compile(r'campaigns.tasks.child.py", line \d+ in _answer')


def last_words(printed: str) -> str:
    """The dump of Python's fault handler if there is one, without what comes after the innermost calls; else the end.

    The handler lists all threads, most recent call first, and all extension modules, which may be hundreds.
    """
    dumps = list(_DUMP.finditer(printed))
    if not dumps:
        return printed.strip()[-LONGEST:]
    before, dump = printed[: dumps[-1].start()], printed[dumps[-1].start() :]
    head, *stacks = re.split(r"^(?=(?:Current thread|Thread) 0x)", dump, flags=re.MULTILINE)
    chosen = next(filter(_OWN.search, stacks), stacks[0] if stacks else "")
    frames = list(takewhile(lambda call: not _OWN.search(call), _CALL.findall(chosen)))[:FRAMES]
    words = "\n".join([head.strip(), *frames])
    room = LONGEST - len(words) - 1
    return f"{before.strip()[-room:]}\n{words}".strip() if room > 0 else words[:LONGEST]
