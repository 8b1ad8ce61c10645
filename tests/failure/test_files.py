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


def test_a_link_stays_one(tmp_path):
    path, link = tmp_path / "summary.json", tmp_path / "link.json"
    path.write_text("old")
    link.symlink_to(path)
    assert write_whole(link, lambda place: place.write_text("new")) == link
    assert link.is_symlink()
    assert path.read_text() == "new"


@pytest.mark.parametrize("name", ["x" * 400, "x/summary.json"])
def test_an_error_names_the_file_that_was_wanted(tmp_path, name):
    with pytest.raises(OSError) as error:  # noqa: PT011 -- the message is the system's
        write_whole(tmp_path / name, lambda place: place.write_text("new"))
    assert error.value.filename == str(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_an_error_says_which_file(tmp_path):
    def fill(place):
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space left") as error:
        write_whole(tmp_path / "page.html", fill)
    assert error.value.filename == str(tmp_path / "page.html")
