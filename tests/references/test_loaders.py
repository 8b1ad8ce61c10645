"""Tracks from files: what is written is read, and whatever is wrong in a file is named with its line."""

import os
from pathlib import Path as FilePath

import numpy as np
import pytest
from curves import lobed
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import rumo
from rumo.references import TRACKS, Path, SpeedLimits, Track, load_race_line, load_track, speed_profile
from rumo.references.loaders.gpx import local

FILES = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
CENTRE_LINES = os.environ.get("RUMO_TRACKS")
"""Folder of centre lines of race tracks, as in the TUM's database."""


def points_of(path, n):
    there = path.at(np.arange(n) * path.length / n)
    return np.column_stack([there.x, there.y])


EIGHT = points_of(TRACKS["eight"]().path, 80)
WIDTHS = 4.0 + np.cos(np.arange(80.0)), 5.0 + np.sin(np.arange(80.0))


def tum(points, right, left):
    rows = [f"{x:.6f},{y:.6f},{a:.3f},{b:.3f}" for (x, y), a, b in zip(points, right, left, strict=True)]
    return "\n".join(["# x_m,y_m,w_tr_right_m,w_tr_left_m", *rows]) + "\n"


def written(folder, text, name="track.csv"):
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return file


@FILES
@given(lobed(), st.sampled_from([",", ";", "\t", " "]), st.permutations(range(4)), st.booleans(), st.booleans())
def test_what_is_written_is_read(tmp_path, points, delimiter, order, comment, again):
    """Any delimiter and order of columns, header commented or not, first point repeated or not."""
    names = ["x", "Y [m]" if delimiter != " " else "y_m", "width_left", "w_tr_right_m"]
    widths = np.linspace(0.01, 0.02, len(points)) * np.abs(points).max()
    columns = [points[:, 0], points[:, 1], widths, 2.0 * widths]
    rows = [delimiter.join(repr(float(columns[i][k])) for i in order) for k in range(len(points))]
    rows += rows[:1] * again
    header = ("# " if comment else "") + delimiter.join(names[i] for i in order)
    track = load_track(written(tmp_path, "\r\n".join(["#made by hand", header, *rows, "", ""])), smoothing=0.0)
    exact = Path(points, closed=True)
    s = np.linspace(0.0, exact.length, 100)
    assert track.path.closed
    np.testing.assert_allclose(track.path.at(s), exact.at(s), atol=1e-9 * np.abs(points).max())
    left, right = track.limits(track.path.stations)
    np.testing.assert_allclose(left, widths, rtol=1e-9)
    np.testing.assert_allclose(right, 2.0 * widths, rtol=1e-9)
    assert track.name == "track"


def test_smoothing_leaves_the_edges_where_they_are(tmp_path):
    rng = np.random.default_rng(0)
    exact = points_of(TRACKS["club"]().path, 430)
    noisy = exact + rng.normal(0.0, 0.1, exact.shape)
    half = np.full(430, 5.0)
    track = load_track(written(tmp_path, tum(noisy, half, half)), smoothing=0.15)
    left, right = track.edges(track.path.stations)
    there = track.path.at(track.path.stations)
    across = np.column_stack([-np.sin(there.heading), np.cos(there.heading)])
    # Each edge is 5 m from its own point, seen across the smoothed line.
    np.testing.assert_allclose(((left - noisy) * across).sum(axis=1), 5.0, atol=1e-6)
    np.testing.assert_allclose(((right - noisy) * across).sum(axis=1), -5.0, atol=1e-6)
    usual = load_track(written(tmp_path, tum(noisy, half, half))).path
    assert np.ptp(track.path.at(track.path.nodes).curvature_rate) < np.ptp(usual.at(usual.nodes).curvature_rate)


def test_race_lines(tmp_path):
    line = Path(EIGHT, closed=True)
    profile = speed_profile(line, SpeedLimits.race(0.5, top=12.0))
    s = np.linspace(0.0, line.length, 300)
    there = line.at(s)
    psi = np.arctan2(np.sin(there.heading), np.cos(there.heading)) % (2.0 * np.pi)
    columns = (s, there.x, there.y, psi, there.curvature, profile.speed_at(s), profile.acceleration_at(s))
    head = "# made\n# by\n# s_m; x_m; y_m; psi_rad; kappa_radpm; vx_mps; ax_mps2\n"
    rows = "\n".join("; ".join(f"{value:.7f}" for value in row) for row in np.column_stack(columns))
    path, read = load_race_line(written(tmp_path, head + rows))
    assert path.closed
    assert path.length == pytest.approx(line.length, rel=1e-6)
    np.testing.assert_allclose(read.speed_at(s), profile.speed_at(s), rtol=1e-5)
    assert read.duration == pytest.approx(profile.duration, rel=1e-2)
    assert load_track(written(tmp_path, head + rows), width=3.0).limits(9.0)[0] == pytest.approx(1.5, abs=0.02)


def geodesic_metres(latitude, longitude):
    """Places about their middle as in a plane that touches the ellipsoid WGS 84 there: from the cartesian ones."""
    a, e2 = 6_378_137.0, 0.00669437999014
    lat, lon = np.deg2rad(latitude), np.deg2rad(longitude)
    n = a / np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
    place = np.stack([n * np.cos(lat) * np.cos(lon), n * np.cos(lat) * np.sin(lon), n * (1.0 - e2) * np.sin(lat)])
    la, lo = (0.5 * (angle.min() + angle.max()) for angle in (lat, lon))
    n = a / np.sqrt(1.0 - e2 * np.sin(la) ** 2)
    middle = np.array([n * np.cos(la) * np.cos(lo), n * np.cos(la) * np.sin(lo), n * (1.0 - e2) * np.sin(la)])
    east = np.array([-np.sin(lo), np.cos(lo), 0.0])
    north = np.array([-np.sin(la) * np.cos(lo), -np.sin(la) * np.sin(lo), np.cos(la)])
    d = place - middle[:, None]
    return east @ d, north @ d


@pytest.mark.parametrize("latitude", [-37.8, 0.0, 52.1, 69.0])
def test_recordings_of_satellite_navigation(tmp_path, latitude):
    lat, lon = latitude + EIGHT[:, 1] / 111e3, 13.4 + EIGHT[:, 0] / 111e3 / np.cos(np.deg2rad(latitude))
    points = "".join(
        f'<trkpt lat="{a:.8f}" lon="{b:.8f}"><ele>3</ele></trkpt>\n' for a, b in zip(lat, lon, strict=True)
    )
    head = '<?xml version="1.0"?>\n<gpx xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>\n'
    track = load_track(written(tmp_path, f"{head}{points}</trkseg></trk></gpx>", "lap.gpx"), width=8.0, smoothing=0.0)
    there = track.path.at(track.path.stations)
    x, y = geodesic_metres(lat, lon)
    np.testing.assert_allclose(there.x, x, atol=0.01)
    np.testing.assert_allclose(there.y, y, atol=0.01)
    assert track.path.closed


def test_places_on_both_sides_of_the_date_line():
    x, y = local(np.array([10.0, 10.0]), np.array([179.999, -179.999]))
    assert x[1] - x[0] == pytest.approx(219.3, abs=0.2)
    assert y.tolist() == [0.0, 0.0]


def lanelet(name, x, left, right, successor=""):
    def bound(side, y):
        points = "".join(f"<point><x>{a}</x><y>{y}</y></point>" for a in x)
        return f"<{side}Bound>{points}</{side}Bound>"

    after = f'<successor ref="{successor}"/>' if successor else ""
    return f'<lanelet id="{name}">{bound("left", left)}{bound("right", right)}{after}</lanelet>'


def scenario(*lanelets):
    return f'<?xml version="1.0"?><commonRoad commonRoadVersion="2020a">{"".join(lanelets)}</commonRoad>'


SCENARIO = scenario(
    lanelet(7, range(20, 45, 5), 3.0, -1.0),
    lanelet(5, range(0, 25, 5), 3.0, -1.0, 7),
    lanelet(9, range(0, 15, 5), 7.0, 3.0),
)


def test_lanes_of_scenarios(tmp_path):
    file = written(tmp_path, SCENARIO, "scenario.xml")
    track = load_track(file)
    assert track.path.length == pytest.approx(40.0)
    assert not track.path.closed
    np.testing.assert_allclose(track.path.at(np.array([0.0, 40.0])).y, 1.0)
    np.testing.assert_allclose(track.limits(20.0), 2.0)
    assert load_track(file, lanelets=[9]).path.at(0.0).y == pytest.approx(5.0)


GOOD = tum(EIGHT, *WIDTHS)
LINES = GOOD.splitlines()


def changed(line, text):
    return "\n".join([*LINES[: line - 1], text, *LINES[line:]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "track.csv: got no table, expected a header such as x_m,y_m"),
        ("x,y\n", "track.csv: got a header without rows, expected points below it"),
        (b"x,y\n1,2\n\xff\xfe,3\n", "track.csv, line 3: got the byte 0xff, expected text in UTF-8. Save it"),
        (changed(9, "1.0,nan,4.0,4.0"), "track.csv, line 9: got nan, expected a finite number. Fill the gap"),
        (changed(9, "1.0,far,4.0,4.0"), "track.csv, line 9: got 'far', expected a number."),
        (
            changed(9, "1.0,2.0,4.0"),
            "track.csv, line 9: got 3 values, expected 4, as the header has. The columns are x_m",
        ),
        (changed(9, "1.0;2.0;4.0;4.0"), "track.csv, line 9: got 1 value, expected 4"),
        (changed(9, LINES[7]), "track.csv, line 9: got the point before again, expected another point. Leave one"),
        (
            changed(9, "900.0,2.0,4.0,4.0"),
            r"track.csv, line 9: got a point \d+.* m from the one before, expected points some",
        ),
        (changed(9, ",".join(LINES[6].split(",")[:2]) + "1,4.0,4.0"), "line .*degrees, expected points in the order"),
        (
            changed(9, LINES[8].rsplit(",", 1)[0] + ",-3"),
            "track.csv, line 9: got a width of -3 m to the left, expected a pos",
        ),
        ("\n".join([LINES[0], LINES[1]]), "track.csv: got 1 points, expected at least three"),
        (GOOD.replace("x_m", "lat"), "track.csv, line 1: got columns lat, y_m, .*, expected one for x. Name the"),
        (GOOD.replace("y_m", "x"), "line 1: got two columns for x: x_m and x, expected one"),
        (GOOD.replace("w_tr_left_m", "w"), "track.csv: got a width to the right alone, expected widths to both sides"),
        ("x,y\n0,0\n1,0\n2,0\n", r"track.csv: got no widths, .*load_track\(file, width=10.0\)"),
        ("x;y\n0,5;1\n", "track.csv, line 2: got '0,5', expected a number. Write numbers with a point, 1.5."),
        ("0,0\n1,0\n2,0\n", "track.csv, line 1: got columns 0, 0, expected one for x. Name the columns"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, message):
    with pytest.raises(rumo.FileError, match=message):
        load_track(written(tmp_path, text))


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.gpx", "<gpx>\n<trkpt lat='1' lon='2'>", "a.gpx, line 2: got no element found, expected well-formed XML"),
        ("a.gpx", "<gpx></gpx>", "a.gpx: got no points, expected some of trkpt, rtept, wpt with lat and lon"),
        ("a.gpx", "<gpx>\n\n<trkpt lat='1'/></gpx>", "a.gpx, line 3: got a point without lon, expected lat and lon"),
        ("a.gpx", "<gpx>\n<trkpt lat='91' lon='1'/></gpx>", "line 2: got lat='91', expected degrees from -90 to 90"),
        ("a.xml", "<commonRoad>", "a.xml, line 1: got no element found.*, expected well-formed XML"),
        ("a.xml", "<osm/>", "a.xml, line 1: got <osm>, expected a scenario, <commonRoad>"),
        ("a.xml", scenario(), "a.xml: got no lanelets, expected a scenario of CommonRoad with some"),
        (
            "a.xml",
            SCENARIO.replace("<x>5</x>", "<x>?</x>"),
            "a.xml: got .* in the leftBound of lanelet 5, expected x and y",
        ),
        (
            "a.xml",
            SCENARIO.replace("<point><x>40</x><y>3.0</y></point>", ""),
            "lanelet 7 with 4 points on the left and 5",
        ),
    ],
)
def test_what_is_wrong_in_other_files_is_named(tmp_path, name, text, message):
    with pytest.raises(rumo.FileError, match=message):
        load_track(written(tmp_path, text, name), width=8.0)


def test_other_mistakes(tmp_path):
    with pytest.raises(FileNotFoundError):
        load_track(tmp_path / "none.csv")
    with pytest.raises(rumo.ArgumentError, match=r"lanelets: got .*, expected nothing: .* is no CommonRoad scenario"):
        load_track(written(tmp_path, GOOD), lanelets=[3])
    with pytest.raises(rumo.UnknownNameError, match=r"lanelets: got '4', expected one of 7, 5, 9"):
        load_track(written(tmp_path, SCENARIO, "a.xml"), lanelets=[4])
    with pytest.raises(rumo.FileError, match=r"track.csv: got no column for the speed, expected one such as vx_mps"):
        load_race_line(written(tmp_path, GOOD))


GPX = "<gpx>" + "".join(f'<trkpt lat="{52 + y / 1e5}" lon="{13 + x / 1e5}"/>\n' for x, y in EIGHT) + "</gpx>"
FILES_OF_ALL_KINDS = {"track.csv": GOOD.encode(), "lap.gpx": GPX.encode(), "scenario.xml": SCENARIO.encode()}


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(sorted(FILES_OF_ALL_KINDS)), st.data())
@example("track.csv", None)
def test_a_file_that_was_damaged_is_a_track_or_an_error_of_the_file(tmp_path, name, data):
    """Bytes removed, inserted or changed anywhere."""
    text = FILES_OF_ALL_KINDS[name]
    if data is not None:
        for _ in range(data.draw(st.integers(1, 3))):
            at = data.draw(st.integers(0, len(text)))
            end = at + data.draw(st.sampled_from([0, 1, 1, 7, 300]))
            inserted = data.draw(
                st.one_of(st.binary(max_size=3), st.sampled_from([b"0", b"-", b",", b"\n", b"nan", b"e9"]))
            )
            text = text[:at] + inserted + text[end:]
    try:
        track = load_track(written(tmp_path, text, name), width=8.0)
    except rumo.FileError:
        return
    assert isinstance(track, Track)
    s = np.linspace(0.0, track.path.length, 200)
    assert np.isfinite(track.path.at(s)).all()
    left, right = track.limits(s)
    assert (left + right > 0.0).all()


@pytest.mark.skipif(not CENTRE_LINES, reason="needs centre lines of race tracks in the folder RUMO_TRACKS")
def test_race_tracks():
    for file in sorted(FilePath(CENTRE_LINES).glob("*.csv")):
        track = load_track(file)
        points = np.loadtxt(file, delimiter=",")[:, :2]
        assert track.path.closed
        assert abs(track.path.turning) == pytest.approx(2.0 * np.pi)
        there = track.path.at(track.path.stations)
        distance = np.hypot(there.x - points[:, 0], there.y - points[:, 1])
        assert distance.max() < 0.35
        chord = np.linalg.norm(np.diff(np.vstack([points, points[:1]]), axis=0), axis=1).sum()
        assert track.path.length == pytest.approx(chord, rel=2e-3)
        assert np.abs(track.path.at(track.path.nodes).curvature_rate).max() < 0.02
