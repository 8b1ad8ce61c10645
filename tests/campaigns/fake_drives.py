"""An engine that drives nothing: what a drive comes to is a function of its settings."""

from rumo.campaigns.tasks.rows import Attempt, complete_row


class FakeEngine:
    """Rows of `drive(settings)`, which returns columns or (outcome, error); after `most` of them Ctrl-C."""

    workers, address = 2, None

    def __init__(self, drive, most=None):
        self.drive, self.most, self.driven = drive, most, []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def rows(self, work, common, tasks, meanwhile=None):
        for task in tasks:
            if self.most is not None and len(self.driven) >= self.most:
                raise KeyboardInterrupt
            self.driven.append(task["key"])
            found = self.drive(task["settings"])
            outcome, error, columns = ("done", None, found) if isinstance(found, dict) else (*found, {})
            yield complete_row(task, outcome, error, columns, Attempt("2026-01-01T00:00:00+00:00", 0.1, 1))

    def close(self):
        pass
