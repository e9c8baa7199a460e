"""Damaged and hostile inputs from good ones: bytes, tokens, lines, cells, and parts of JSON and
TOML.
"""

import json
import tomllib

import numpy as np

_WORDS = """
nan inf -inf 1e999 1e-999 -1 0 true null NaN
½ " ' \\ # ] } , ; = : .. ../../etc/passwd / _ $(id) !!python/object:os.system
"shape":[1,99999999999] 18446744073709551615 -9223372036854775808 1e308 -1e308 1e-308 0x10 1_000 ٣
'''
"""
TOKENS = [
    *(b"9" * 5000, b"\n", b"1" + b"0" * 30),
    *(word.encode() for word in _WORDS.split()),
    *(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3\x28", b"\r", b"\t", b"\x1a", b"\xff" * 8),
    *(b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x00" * 8, "\u2028".encode(), b'"""'),
    *(b"[" * 3000, b"{" * 3000, b'{"a":' * 2000, b"a" * 70_000),
]
ODD = [10**30, "a" * 300, [0] * 50]
ODD += json.loads(
    "[null, true, false, 0, -1, 1, 3, 1.5, -0.0, 1e308, -1e308, 1e-308, NaN, Infinity, 2147483648,"
    ' 9223372036854775808, 18446744073709551616, 1e30, -1e30, "", "a", "nan", "inf", "../x", "/",'
    r' "\u0000", "\ud800", "<f8", "O", "|V8", "U9999999", [], [[]], [1, [2]], {}, {"a": 1},'
    ' {"": {}}, [null], ["a", 1], [-1], [1099511627776], [[1, 2], [3]]]'
)
KINDS = 12


def mutate(rng: np.random.Generator, seeds: list[bytes]) -> bytes:
    """One input: a seed with a few things done to it, rarely pure noise."""
    if rng.random() < 0.02:
        return rng.bytes(int(rng.integers(0, 300)))
    data = bytearray(seeds[rng.integers(len(seeds))])
    for _ in range(int(rng.geometric(0.65))):
        _change(rng, data, seeds)
    return bytes(data)


def shape_text(rng: np.random.Generator, seed: bytes) -> bytes:
    """A text whose numbers, cells, lines and columns have changed, the rest as it was."""
    data = bytearray(seed)
    for _ in range(int(rng.geometric(0.65))):
        _change(rng, data, [seed], first=8)
    return bytes(data)


def _change(
    rng: np.random.Generator, data: bytearray, seeds: list[bytes], first: int = 0
) -> None:
    place = int(rng.integers(len(data) + 1))
    end = min(len(data), place + int(rng.geometric(0.1)))
    kind = int(rng.integers(first, KINDS))
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
    elif kind == 8:  # a digit becomes something else
        digits = [n for n, byte in enumerate(data) if 48 <= byte <= 57]
        if digits:
            where = digits[rng.integers(len(digits))]
            data[where : where + 1] = TOKENS[rng.integers(12)]
    elif kind == 9:
        data[:] = _change_lines(rng, bytes(data))
    else:  # a whole cell or value becomes another, so that the rest still fits
        data[:] = _change_cell(rng, bytes(data))


def _change_lines(rng: np.random.Generator, data: bytes) -> bytes:
    """A line gone, doubled, moved or repeated often, or a column gone."""
    lines = data.split(b"\n")
    place, kind = int(rng.integers(len(lines))), int(rng.integers(5))
    if kind == 0:
        del lines[place]
    elif kind == 1:
        lines.insert(int(rng.integers(len(lines))), lines[place])
    elif kind == 2:
        lines.append(lines.pop(place))
    elif kind == 3:
        lines[place:place] = [lines[place]] * int(rng.integers(2, 200))
    else:
        column = int(rng.integers(4))
        lines = [
            b",".join(cell for n, cell in enumerate(line.split(b",")) if n != column)
            for line in lines
        ]
    return b"\n".join(lines)


def _change_cell(rng: np.random.Generator, data: bytes) -> bytes:
    marks = [n for n, byte in enumerate(data) if byte in b',;=: \t\n[]{}"']
    if not marks:
        return data
    n = int(rng.integers(len(marks)))
    start, end = marks[n] + 1, marks[n + 1] if n + 1 < len(marks) else len(data)
    return data[:start] + TOKENS[rng.integers(len(TOKENS))] + data[end:]


def mutate_json(rng: np.random.Generator, value: object) -> object:
    """A JSON value with one to four of its parts replaced, removed, renamed or exchanged."""
    value = json.loads(json.dumps(value))
    for _ in range(int(rng.geometric(0.6))):
        places = list(_walk(value))
        if not places:
            return pick_odd(rng)
        holder, key = places[rng.integers(len(places))]
        kind = int(rng.integers(6))
        if kind == 0:
            del holder[key]
        elif kind == 1 and isinstance(holder, dict):
            holder[str(pick_odd(rng))] = holder.pop(key)
        elif kind == 2:
            other, there = places[rng.integers(len(places))]
            holder[key] = json.loads(json.dumps(other[there]))
        else:
            holder[key] = pick_odd(rng)
    return value


def pick_odd(rng: np.random.Generator) -> object:
    """One of ODD, as a copy of its own."""
    return json.loads(json.dumps(ODD[rng.integers(len(ODD))]))


def _walk(value: object):
    """Every place (holder, key) in a JSON value; of a long list the ends only."""
    if isinstance(value, dict):
        keys = list(value)
    else:
        keys = (
            [n for n in range(len(value)) if n < 4 or n > len(value) - 3]
            if isinstance(value, list)
            else []
        )
    for key in keys:
        yield value, key
        yield from _walk(value[key])


def write_json(value: object) -> bytes:
    """JSON with whatever ODD values it holds, lone surrogates included."""
    return json.dumps(value, ensure_ascii=True).encode()


def shape_json(rng: np.random.Generator, seed: bytes) -> bytes:
    """A JSON file whose parts have changed."""
    return write_json(mutate_json(rng, json.loads(seed)))


def shape_toml(rng: np.random.Generator, seed: bytes) -> bytes:
    """A TOML file whose keys and values have changed, written in one line each."""
    changed = mutate_json(rng, tomllib.loads(seed.decode()))
    if not isinstance(changed, dict):
        return write_json(changed)
    lines = [f"{json.dumps(key)} = {_write_inline(value)}" for key, value in changed.items()]
    return "\n".join(lines).encode("utf-8", "replace")


def _write_inline(value: object) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(k)} = {_write_inline(v)}' for k, v in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_write_inline, value))}]"
    return (
        json.dumps(value, ensure_ascii=False).replace("Infinity", "inf").replace("NaN", "nan")
    )


def shape_safetensors(rng: np.random.Generator, seed: bytes) -> bytes:
    """A model whose header or settings have changed, with the header's length put right."""
    size = int.from_bytes(seed[:8], "little")
    header = json.loads(seed[8 : 8 + size])
    if rng.random() < 0.5:
        notes = header["__metadata__"]
        notes["settings"] = write_json(mutate_json(rng, json.loads(notes["settings"]))).decode()
    else:
        header = mutate_json(rng, header)
    text = write_json(header)
    return len(text).to_bytes(8, "little") + text + seed[8 + size :]
