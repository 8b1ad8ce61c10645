"""Batches of a second, of an iterable that is read as they are taken."""

from fake_work import Tasks

from rumo.campaigns.engines.batches import LARGEST, Batches


def sizes(batches, seconds, workers=2, ahead=12):
    """Of all batches, where each task takes so long, and so many batches are on their way."""
    waiting, found = [], []
    while True:
        batch = batches.take(workers)
        if batch:
            waiting.append(len(batch))
        if not waiting:
            return found
        if len(waiting) == ahead or not batch:
            found.append(waiting.pop(0))
            batches.learn(found[-1], found[-1] * seconds)


def test_slow_tasks_go_alone():
    assert sizes(Batches(Tasks(30)), 2.0) == [1] * 30


def test_quick_ones_go_by_the_second():
    found = sizes(Batches(Tasks(3000)), 0.02)
    assert found[0] == 1
    assert max(found) == 50
    assert sum(found) == 3000
    assert found[-1] == 1
    assert len(found) < 120


def test_very_quick_ones_have_a_limit():
    assert max(sizes(Batches(iter(Tasks(50_000))), 1e-6)) == LARGEST


def test_tasks_are_read_as_they_are_needed():
    read = []
    batches = Batches(read.append(number) or number for number in range(10**12))
    for _ in range(20):
        batches.learn(len(batches.take(1)), 0.01)
    assert len(read) < 20 * LARGEST


def test_what_was_not_done_is_taken_again_first():
    batches = Batches(Tasks(40))
    for seconds in (0.05, 0.05):
        batches.learn(len(batches.take(1)), seconds)
    first = batches.take(1)
    assert len(first) == 16
    batches.learn(1, 30.0)
    batches.put_back(first[1:])
    taken = []
    while batch := batches.take(1):
        assert len(batch) == 1
        taken += batch
    assert [each["draw"] for each in taken] == [*range(6, 40)]


def test_a_first_batch_that_took_no_time():
    batches = Batches(Tasks(5))
    batches.learn(len(batches.take(1)), 0.0)
    assert batches.take(1)
