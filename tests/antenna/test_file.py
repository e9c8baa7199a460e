"""Antenna files: every number comes back to the last bit; every fault is named with its line and
key.
"""

import os
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feeler.antenna import PROFILES, Antenna, Exponential
from feeler.antenna.animals import PROFILE_NAMES, cockroach
from feeler.antenna.files import (
    FILE_UNITS,
    Source,
    load_antenna,
    parse_antenna,
    read_antenna_file,
    save_antenna,
    write_antenna,
)
from feeler.errors import InvalidInput

GOOD = """schema = "feeler.antenna/1"
name = "small"
n_segments = 3

[segment_length]
unit = "mm"
values = [1.0, 1.5, 2]

[segment_mass]
unit = "mg"
value = 0.5

[radius]
unit = "mm"
value = 0.2

[stiffness]
unit = "N·mm/rad"
tag = "P"
profile = "exponential"
base = 37.78
rate = -0.0827

[damping]
unit = "uN*m*s/rad"
value = 2.0

[sensors]
hinges = [1, 3]
"""


def same(a: Antenna, b: Antenna) -> bool:
    names = [*FILE_UNITS, "sensors"]
    return a.name == b.name and all(
        getattr(a, n).tobytes() == getattr(b, n).tobytes() for n in names
    )


@pytest.mark.parametrize("profile", PROFILE_NAMES)
def test_the_cockroach_returns_to_the_last_bit(tmp_path, profile):
    sources = {
        "stiffness": Source(
            tag="P+D", reference="doi:10.1101/2025.10.20.683587", note='p1 "quoted"\n\\ tab\t'
        )
    }
    save_antenna(cockroach(profile), tmp_path / "a.toml", sources)
    assert same(load_antenna(tmp_path / "a.toml"), cockroach(profile))
    assert read_antenna_file(tmp_path / "a.toml").sources == sources


positive = st.floats(min_value=5e-324, max_value=1e300)


@pytest.mark.long
@given(st.data(), st.integers(1, 12), st.text(st.characters(codec="utf-8"), max_size=30))
def test_any_antenna_returns_to_the_last_bit(data, n, name):
    def draw(values):
        return data.draw(st.lists(values, min_size=n, max_size=n))

    antenna = Antenna(
        segment_length=draw(positive),
        segment_mass=draw(positive),
        radius=draw(positive),
        stiffness=[data.draw(positive), *draw(st.floats(0, 1e300))[1:]],
        damping=draw(st.floats(0, 1e300)),
        rest_angle=draw(st.floats(-3.14, 3.14)),
        name=name,
    )
    assert same(parse_antenna(write_antenna(antenna)).antenna, antenna)


def test_units_profiles_and_single_values_are_understood():
    file = parse_antenna(GOOD)
    np.testing.assert_array_equal(file.antenna.segment_mass, np.full(3, 0.5e-3))
    np.testing.assert_array_equal(
        file.antenna.stiffness, Exponential(base=37.78, rate=-0.0827).sample(3)
    )
    np.testing.assert_array_equal(file.antenna.damping, np.full(3, 2.0))
    assert file.antenna.sensors.tolist() == [1, 3]
    assert file.sources == {"stiffness": Source(tag="P")}


@pytest.mark.parametrize("kind", PROFILES)
def test_every_profile_is_read_from_a_file(kind):
    numbers = {item.name: 0.3 + k for k, item in enumerate(fields(PROFILES[kind]))}
    said = f'profile = "{kind}"\n' + "".join(f"{k} = {v}\n" for k, v in numbers.items())
    text = GOOD.replace('profile = "exponential"\nbase = 37.78\nrate = -0.0827\n', said)
    np.testing.assert_array_equal(
        parse_antenna(text).antenna.stiffness, PROFILES[kind](**numbers).sample(3)
    )


@pytest.mark.parametrize(("name", "units"), FILE_UNITS.items())
def test_every_unit_means_what_it_says(name, units):
    space = {"stiffness": np.ones((2, 140))} if name == "taper" else {}
    for unit, factor in units.items():
        text = write_antenna(cockroach().replace(**{**space, name: np.ones(140)}))
        own = next(iter(units))
        head, tail = text.split(f"[{name}]\n")
        tail = tail.replace(f'unit = "{own}"', f'unit = "{unit}"', 1)
        text = f"{head}[{name}]\n{tail}"
        assert getattr(parse_antenna(text).antenna, name)[0] == factor


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'schema = "feeler.antenna/1"',
            'schema = "feeler.antenna/2"',
            r"line 1, schema: must be 'feeler.antenna/1'",
        ),
        (
            "n_segments = 3",
            "n_segments = 3.5",
            r"line 3, n_segments: must be a whole number from 1 to 1000",
        ),
        (
            "n_segments = 3",
            "n_segments = 4",
            r"line 7, segment_length.values: must be 4 numbers.*got 3",
        ),
        (
            "[1.0, 1.5, 2]",
            '[1.0, 1.5, "2"]',
            r"line 7, segment_length.values: must be a number, got '2'",
        ),
        (
            "[1.0, 1.5, 2]",
            "[1.0, 1.5, nan]",
            r"line 5, segment_length: .*finite and > 0.*segment 3",
        ),
        ("[1.0, 1.5, 2]", "[1.0, -1.5, 2]", r"line 5, segment_length: .*segment 2"),
        (
            'unit = "mg"',
            'unit = "pound"',
            r"line 10, segment_mass.unit: must be one of g, kg, mg, µg, got 'pound'",
        ),
        ('unit = "mg"\n', "", r"line 9, segment_mass.unit: must be one of"),
        (
            "value = 0.5",
            "valeu = 0.5",
            r"line 9, segment_mass: needs exactly one of value, values, profile, formula; got none",
        ),
        (
            "value = 0.5",
            "value = 0.5\nvalues = [1]",
            r"line 9, segment_mass: needs exactly one",
        ),
        (
            "value = 0.5",
            "value = 0.5\ncolour = 1",
            r"line 12, segment_mass.colour: unknown key; valid here: unit",
        ),
        ("[radius]", "[raduis]", r"line 13, raduis: unknown key; valid here: schema, name"),
        ('[radius]\nunit = "mm"\nvalue = 0.2\n', "", r"radius: is missing"),
        (
            'profile = "exponential"',
            'profile = "cubic"',
            r"line 20, stiffness.profile: must be one of exponential, lin",
        ),
        (
            "rate = -0.0827",
            "",
            r"line 20, stiffness.profile: exponential needs base, rate; missing: rate",
        ),
        ("rate = -0.0827", "rate = 1e6", r"line 17, stiffness: .*finite"),
        ("base = 37.78", "base = 1" + "0" * 400, r"line 21, stiffness.base: int too large"),
        ('tag = "P"', 'tag = "Q"', r"line 19, stiffness.tag: tag must be one of P, A, D, B, C"),
        (
            "hinges = [1, 3]",
            "hinges = [1, 4]",
            r"line 29, sensors.hinges: must be a whole number from 1 to 3, got 4",
        ),
        ("hinges = [1, 3]", "hinges = [3, 1]", r"line 29, sensors.hinges: must rise"),
        ("hinges = [1, 3]", "hinges = [3, 3]", r"line 29, sensors.hinges: must rise"),
        ("hinges = [1, 3]", "hinges = 1", r"line 29, sensors.hinges: must be a list"),
        ("[sensors]\n", "sensors = 3\n", r"unknown key|must be a table"),
        ("value = 0.2", "value = ", r"not valid TOML: .*line 15"),
        ("value = 0.2", "value = " + "[" * 100_000, "not valid TOML"),
        ("n_segments = 3", "n_segments = " + "9" * 5000, r"not valid TOML"),
    ],
)
def test_faults_are_named_with_line_and_key(old, new, words):
    assert GOOD.count(old) == 1
    with pytest.raises(InvalidInput, match=words):
        parse_antenna(GOOD.replace(old, new), "a.toml")


def test_what_is_no_regular_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "latin").write_bytes(b'name = "\xe4"')
    (tmp_path / "big").write_bytes(b"#" * (5 * 2**20))
    cases = {
        "pipe": "regular",
        "latin": "UTF-8",
        "big": "over the limit",
        "absent": "cannot read",
        "": "regular",
        "a\0b": "a path that a file can have",
    }
    for name, words in cases.items():
        with pytest.raises(InvalidInput, match=words):
            load_antenna(f"{tmp_path}/{name}")


def test_a_tag_may_name_every_kind_of_source_and_no_other():
    assert Source(tag="P+A+D+B+C").tag == "P+A+D+B+C"
    with pytest.raises(InvalidInput, match=r"tag must be one of .*got 'P\+X'"):
        Source(tag="P+X")


@pytest.mark.parametrize(("key", "most"), [("name", 200), ("note", 2000)])
def test_texts_end_somewhere(tmp_path, key, most):
    def write(size):
        words = {"name": "n", "note": "n"} | {key: size * "n"}
        antenna = cockroach().replace(name=words["name"])
        source = Source(tag="P", note=words["note"])
        (tmp_path / "a.toml").write_text(
            write_antenna(antenna, {"stiffness": source}), encoding="utf-8"
        )
        return antenna

    longest = write(most)
    assert load_antenna(tmp_path / "a.toml").name == longest.name
    write(most + 1)
    with pytest.raises(
        InvalidInput, match=f"{key}: must be a text of at most {most} characters"
    ):
        load_antenna(tmp_path / "a.toml")
