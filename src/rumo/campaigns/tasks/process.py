"""A child process that answers questions, until it ends or is ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack, suppress
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from time import monotonic
from typing import Any

from rumo.campaigns.tasks.frames import receive, send
from rumo.campaigns.tasks.last_words import last_words

KEPT = 16384
"""What is kept of that which a process has printed [bytes]."""
HEARTBEAT = 1.0
"""How long waiting may go without a look at the clock, and at Ctrl-C on Windows [s]."""
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class DiedError(Exception):
    """The process has ended: `words` is the last that it has printed."""

    def __init__(self, how: str, words: str) -> None:
        self.words = words
        super().__init__(f"{how}\n{words}".rstrip())


class LateError(Exception):
    """No answer came in time: `words` is the last that the process has printed."""

    def __init__(self, words: str) -> None:
        self.words = words
        super().__init__(f"no answer in time\n{words}".rstrip())


class Process:
    """`python -m rumo.campaigns.tasks.child`, in a session of its own: Ctrl-C does not reach it.

    Threads read what it answers and what it prints, so that neither it nor whoever asks ever waits for a full pipe.
    """

    def __init__(self) -> None:
        self._lifeline: int | None = None
        self._ending = Lock()
        options: dict[str, Any] = {"start_new_session": True}
        if sys.platform == "win32":
            options = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP | subprocess.CREATE_NO_WINDOW}
        with ExitStack() as stack:
            ends: list[int] = []
            if sys.platform == "linux":  # a pipe whose end says that this process has gone
                read, self._lifeline = os.pipe()
                stack.callback(os.close, read)
                ends.append(read)
                options["pass_fds"] = ends
            self._process = subprocess.Popen(
                # -P: the current folder may have modules with names of Python's own.
                [sys.executable, "-P", "-m", "rumo.campaigns.tasks.child", *map(str, ends)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=os.environ | dict.fromkeys(THREADS, "1"),
                **options,
            )
        self._answers, self._printed = SimpleQueue[Any](), bytearray()
        self._readers = [Thread(target=read, daemon=True) for read in (self._read_answers, self._read_printed)]
        for reader in self._readers:
            reader.start()

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def ask(self, question: object, patience: float, meanwhile: Callable[[], object] | None = None) -> Any:
        """Send something, and wait for what comes back; `meanwhile` is called every `HEARTBEAT` until then.

        Raises
        ------
        DiedError
            If the process has ended.
        LateError
            If nothing has come after `patience` [s]; it goes on.
        """
        deadline = monotonic() + patience
        self._printed.clear()
        assert self._process.stdin is not None
        with suppress(OSError):  # it has ended, of which its answers have an end
            send(self._process.stdin, question)
        while True:
            left = deadline - monotonic()
            try:
                answer = self._answers.get(timeout=min(HEARTBEAT, max(left, 0.0)))
            except Empty:
                if left <= 0.0:
                    raise LateError(self._words()) from None
                if meanwhile is not None:
                    meanwhile()
                continue
            if answer is None:
                self._end()
                raise DiedError(_how(self._process.returncode), self._words())
            return answer

    def kill(self) -> None:
        """End it, and all that it has started."""
        if self.alive:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.pid, signal.SIGKILL) if os.name == "posix" else self._process.kill()
        self._end()

    def _end(self) -> None:
        """It has ended, or will at once."""
        try:
            self._process.wait(HEARTBEAT)
        except subprocess.TimeoutExpired:  # it has closed its pipe, and goes on
            self._process.kill()
            self._process.wait()
        for reader in self._readers:
            reader.join(HEARTBEAT)
        with self._ending:  # it may have ended while another thread ends it
            assert self._process.stdin is not None
            with suppress(OSError):  # what was not sent yet
                self._process.stdin.close()
            if self._lifeline is not None:
                os.close(self._lifeline)
                self._lifeline = None

    def _read_answers(self) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as stream:
            while True:
                try:
                    self._answers.put(receive(stream))
                except Exception:  # its end, or nothing that could be read after it
                    self._answers.put(None)
                    return

    def _read_printed(self) -> None:
        assert self._process.stderr is not None
        with self._process.stderr as stream:
            while data := os.read(stream.fileno(), KEPT):
                self._printed += data
                del self._printed[:-KEPT]

    def _words(self) -> str:
        return last_words(bytes(self._printed).decode("utf-8", "replace"))


def _how(code: int) -> str:
    """How a process has ended."""
    if code >= 0:
        return f"its process ended with exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        return f"its process was ended by signal {-code}"
    return f"its process was ended by {name} ({signal.strsignal(-code)})"
