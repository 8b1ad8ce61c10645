"""The problems as C headers, made once."""

import pytest
from fixtures import fixture_header, fixtures, pattern_header, tailored_model


@pytest.fixture(scope="session")
def headers(tmp_path_factory):
    """A folder with fixtures.h and patterns.h."""
    folder = tmp_path_factory.mktemp("headers")
    (folder / "fixtures.h").write_text(fixture_header(fixtures(), samples=25), encoding="utf-8")
    (folder / "patterns.h").write_text(pattern_header(), encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def tailored_headers(tmp_path_factory):
    """A folder with fixtures.h of the paper's car alone, and what a build tailored to it needs: tailored.h, model.h."""
    folder = tmp_path_factory.mktemp("tailored")
    chosen = {"car_soft_2": fixtures()["car_soft_2"]}
    (folder / "fixtures.h").write_text(fixture_header(chosen, samples=25), encoding="utf-8")
    defines, model = tailored_model(chosen["car_soft_2"])
    (folder / "tailored.h").write_text(defines, encoding="utf-8")
    (folder / "model.h").write_text(model, encoding="utf-8")
    return folder
