"""Files are written whole or not at all."""

import pytest

from rumo.files import write_whole


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path, error):
    path = tmp_path / "summary.json"
    path.write_text("old")

    def fail(place):
        place.write_text("ha")
        raise error

    with pytest.raises(error):
        write_whole(path, fail)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_replaces_the_old_one_under_its_name(tmp_path):
    path = tmp_path / "figure.png"
    path.write_text("old")
    write_whole(path, lambda place: place.write_text(place.suffix))
    assert path.read_text() == ".png"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_says_which_file(tmp_path):
    def fill(place):
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left") as error:
        write_whole(tmp_path / "page.html", fill)
    assert error.value.filename == str(tmp_path / "page.html")
