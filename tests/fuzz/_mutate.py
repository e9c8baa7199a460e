"""Damaged and hostile inputs from a good one, and what counts as surviving them."""

import signal
import warnings
from contextlib import contextmanager

import numpy as np

from feeler.errors import FeelerError

SECONDS = 20  # a reader that takes longer over a few kilobytes hangs
TOKENS = [
    *(b"nan", b"inf", b"-inf", b"1e999", b"1e-999", b"-1", b"0", b"9" * 400, b"9" * 5000, b"true", b"null", b"NaN"),
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3\x28", "½".encode(), b"\n", b"\r", b"\t", b'"', b"'", b"\\", b"#"),
    *(b"[" * 3000, b"{" * 3000, b'{"a":' * 2000, b"]", b"}", b",", b";", b"=", b":", b"..", b"../../etc/passwd", b"/"),
    *(b"\xff" * 8, b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x00" * 8, b"_", b"$(id)", b"!!python/object:os.system"),
    *(b'"shape":[1,99999999999]', b"18446744073709551615", b"-9223372036854775808", b"1" + b"0" * 30, b"a" * 70_000),
]


def mutate(rng: np.random.Generator, seeds: list[bytes]) -> bytes:
    """One input: a seed with a few things done to it, rarely pure noise."""
    if rng.random() < 0.02:
        return rng.bytes(int(rng.integers(0, 300)))
    data = bytearray(seeds[rng.integers(len(seeds))])
    for _ in range(int(rng.geometric(0.45))):
        _change(rng, data, seeds)
    return bytes(data)


def _change(rng: np.random.Generator, data: bytearray, seeds: list[bytes]) -> None:
    place = int(rng.integers(len(data) + 1))
    end = min(len(data), place + int(rng.geometric(0.1)))
    kind = int(rng.integers(9))
    if kind == 0 and place < len(data):
        data[place] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        data[place:end] = rng.bytes(end - place)
    elif kind == 2:
        del data[place:end]
    elif kind == 3:
        del data[place:]
    elif kind == 4:
        data[place:end] = TOKENS[rng.integers(len(TOKENS))]
    elif kind == 5:
        data[place:place] = TOKENS[rng.integers(len(TOKENS))]
    elif kind == 6:
        data[place:place] = data[place:end] * int(rng.integers(1, 20))
    elif kind == 7:
        other = seeds[rng.integers(len(seeds))]
        start = int(rng.integers(len(other) + 1))
        data[place:end] = other[start : start + 40]
    else:  # a number becomes another
        digits = [n for n, byte in enumerate(data) if 48 <= byte <= 57]
        if digits:
            where = digits[rng.integers(len(digits))]
            data[where : where + 1] = TOKENS[rng.integers(12)]


@contextmanager
def survives(data: object):
    """Only feeler's own errors may come out, in time, without a RuntimeWarning."""

    def ring(*_):
        raise AssertionError(f"took more than {SECONDS} s over {data!r}")

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            yield
    except FeelerError as error:
        assert str(error), "an error without words"
    except Exception as error:
        raise AssertionError(f"{type(error).__name__}: {error}\nfrom the input {data!r}") from error
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
