"""Damaged and hostile inputs from good ones: bytes, tokens, lines, and the structures inside a
file.
"""

import io
import json
import re
import tomllib

import numpy as np

TOKENS = [
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"1e999",
        b"1e-999",
        b"-1",
        b"0",
        b"9" * 400,
        b"9" * 5000,
        b"true",
        b"null",
        b"NaN",
    ),
    *(
        b"\x00",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"\xc3\x28",
        "½".encode(),
        b"\n",
        b"\r",
        b"\t",
        b'"',
        b"'",
        b"\\",
        b"#",
    ),
    *(
        b"[" * 3000,
        b"{" * 3000,
        b'{"a":' * 2000,
        b"]",
        b"}",
        b",",
        b";",
        b"=",
        b":",
        b"..",
        b"../../etc/passwd",
        b"/",
    ),
    *(
        b"\xff" * 8,
        b"\x7f\xff\xff\xff",
        b"\xff\xff\xff\x7f",
        b"\x00" * 8,
        b"_",
        b"$(id)",
        b"!!python/object:os.system",
    ),
    *(
        b'"shape":[1,99999999999]',
        b"18446744073709551615",
        b"-9223372036854775808",
        b"1" + b"0" * 30,
        b"a" * 70_000,
    ),
    *(
        b"1e308",
        b"-1e308",
        b"1e-308",
        b"0x10",
        b"1_000",
        "٣".encode(),
        "\u2028".encode(),
        b"\x1a",
        b"'''",
        b'"""',
    ),
]
ODD = [
    *(
        None,
        True,
        False,
        0,
        -1,
        1,
        3,
        1.5,
        -0.0,
        1e308,
        -1e308,
        1e-308,
        float("nan"),
        float("inf"),
        2**31,
        2**63,
        2**64,
    ),
    *(
        10**30,
        -(10**30),
        "",
        "a",
        "nan",
        "inf",
        "../x",
        "/",
        "a" * 300,
        "\0",
        "\ud800",
        "<f8",
        "O",
        "|V8",
        "U9999999",
    ),
    *(
        [],
        [[]],
        [1, [2]],
        [0] * 50,
        {},
        {"a": 1},
        {"": {}},
        [None],
        ["a", 1],
        [-1],
        [2**40],
        [[1, 2], [3]],
    ),
]
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


NUMBERS = [
    b"0",
    b"-1",
    b"1e300",
    b"-1e300",
    b"1e-300",
    b"1e309",
    b"nan",
    b"65536",
    b"0.5",
    b"9" * 400,
]
SVG_WORDS = [
    *(
        b" M 0 0 ",
        b" Z",
        b" A 1e9 1 0 0 1 5 5",
        b" C 900000 100000 2 -1000000 3 0" * 200,
        b" h 1" * 900,
    ),
    *(
        b"<g>" * 500,
        b"</g>",
        b"<path d='M0 0H9V9Z'/>",
        b'<circle r="1e12"/>',
        b"<use href='#leaf'/>",
    ),
    *(
        b"matrix(1 0 0 0 0 0)",
        b"scale(1e300)",
        b"rotate(1e9)",
        b"&a;",
        b"url(http://localhost)",
        b"%",
    ),
]


def shape_svg(rng: np.random.Generator, seed: bytes) -> bytes:
    """A drawing with other numbers, commands, elements and attributes."""
    data = seed
    for _ in range(int(rng.geometric(0.5))):
        kind, words = int(rng.integers(5)), SVG_WORDS[rng.integers(len(SVG_WORDS))]
        found = list(
            re.finditer(rb"-?[\d.]+", data) if kind < 3 else re.finditer(rb"[A-Za-z ]", data)
        )
        at = found[rng.integers(len(found))]
        if kind < 2:
            words = NUMBERS[rng.integers(len(NUMBERS))]
        data = data[: at.start()] + words + data[at.end() if kind < 4 else at.start() :]
    return data


def shape_dxf(rng: np.random.Generator, seed: bytes) -> bytes:
    """A drawing with other group codes, values and entities, and groups gone, doubled or moved."""
    lines = seed.split(b"\n")
    pairs = [list(pair) for pair in zip(lines[::2], lines[1::2], strict=False)]
    for _ in range(int(rng.geometric(0.5))):
        place, kind = int(rng.integers(len(pairs))), int(rng.integers(6))
        if kind < 2:
            pairs[place][1] = NUMBERS[rng.integers(len(NUMBERS))]
        elif kind == 2:
            pairs[place][rng.integers(2)] = TOKENS[rng.integers(len(TOKENS))]
        elif kind == 3:
            pairs[place] = [
                b"0",
                [b"CIRCLE", b"ELLIPSE", b"SPLINE", b"INSERT", b"HATCH"][rng.integers(5)],
            ]
        elif kind == 4:
            pairs[place:place] = pairs[place : place + 8] * int(rng.integers(1, 200))
        elif len(pairs) > 1:
            del pairs[place]
    return b"\n".join(line for pair in pairs for line in pair)


def shape_mcap(rng: np.random.Generator, seed: bytes) -> bytes:
    """A recording whose records hold other things: lengths, times, texts and numbers of messages,
    each record as long as it says.
    """
    parts, place = [], 8
    while place + 9 <= len(seed) - 8:
        size = int.from_bytes(seed[place + 1 : place + 9], "little")
        parts.append([seed[place : place + 1], bytearray(seed[place + 9 : place + 9 + size])])
        place += 9 + size
    for _ in range(int(rng.geometric(0.4))):
        n, kind = int(rng.integers(len(parts))), int(rng.integers(4))
        if kind == 0:
            parts.insert(int(rng.integers(len(parts))), parts[n])
        elif kind == 1 and len(parts) > 1:
            del parts[n]
        else:
            body = parts[n][1]
            at = int(rng.integers(len(body) + 1))
            body[at : at + 4] = (
                rng.bytes(4) if kind == 2 else bytes(TOKENS[rng.integers(len(TOKENS))])
            )
    told = [kind + len(body).to_bytes(8, "little") + bytes(body) for kind, body in parts]
    return seed[:8] + b"".join(told) + seed[-8:]


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


def shape_table(rng: np.random.Generator, seed: bytes) -> bytes:
    """A tensor as CSV with a changed description."""
    mark = b"# description: "
    lines = seed.split(b"\n")
    place = next(n for n, line in enumerate(lines) if line.startswith(mark))
    lines[place] = mark + write_json(mutate_json(rng, json.loads(lines[place][len(mark) :])))
    return b"\n".join(lines)


def shape_mat(rng: np.random.Generator, seed: bytes) -> bytes:
    """A MATLAB file with changed variables or a changed description."""
    from scipy.io import loadmat, savemat

    content = {
        name: value
        for name, value in loadmat(io.BytesIO(seed)).items()
        if not name.startswith("__")
    }
    if rng.random() < 0.6:
        text = str(content["feeler_description"][0])
        content["feeler_description"] = write_json(mutate_json(rng, json.loads(text))).decode()
    else:
        name = list(content)[rng.integers(len(content))]
        odd = [
            np.zeros((0, 3)),
            np.zeros((2, 2, 2)),
            np.array(["a", "bc"]),
            1j * np.ones(3),
            np.full((1, 1), np.nan),
        ]
        odd += [
            np.int64(2**62),
            {"a": 1},
            np.array([[1, "x"]], dtype=object),
            np.uint8([1, 2, 3]),
            "",
            True,
        ]
        content[name] = odd[rng.integers(len(odd))]
    file = io.BytesIO()
    savemat(
        file, content, long_field_names=True, oned_as="row", do_compression=rng.random() < 0.5
    )
    return file.getvalue()


def change_hdf5(rng: np.random.Generator, path: str) -> None:
    """An HDF5 file whose objects have changed: removed, of another shape or type, linked, with odd
    attributes.
    """
    import h5py

    names: list[str] = []
    with h5py.File(path, "a") as file:
        file.visit(names.append)
        for _ in range(int(rng.geometric(0.6))):
            name = names[rng.integers(len(names))]
            if name not in file:
                continue
            kind = int(rng.integers(7))
            if kind == 0:
                del file[name]
            elif kind == 1:
                del file[name]
                file[name] = [
                    np.zeros((0, 2)),
                    np.float32([1]),
                    3,
                    "text",
                    np.array([b"a", b"b"]),
                    1j,
                ][rng.integers(6)]
            elif kind == 2:
                del file[name]
                link = [
                    h5py.SoftLink("/nowhere"),
                    h5py.ExternalLink("/etc/passwd", "/"),
                    h5py.SoftLink("/" + name),
                ]
                file[name] = link[rng.integers(3)]
            elif kind == 3:
                del file[name]
                file.create_dataset(name, (2**40,), "f8", chunks=(2**16,), compression="gzip")
            else:
                _change_attribute(rng, file[name] if rng.random() < 0.5 else file)


def _change_attribute(rng: np.random.Generator, item: object) -> None:
    names = [name for name in item.attrs if name not in ("DIMENSION_LIST", "REFERENCE_LIST")]
    odd = [
        0,
        -1.5,
        np.nan,
        "",
        "a b",
        "[]",
        b"\xff",
        np.zeros((3, 0)),
        np.arange(5),
        np.array(["x", "y"], "S1"),
        "🐜",
    ]
    if names and rng.random() < 0.7:
        name = names[rng.integers(len(names))]
        old = item.attrs[name]
        del item.attrs[name]
        if isinstance(old, str) and old.startswith("{") and rng.random() < 0.8:
            item.attrs[name] = write_json(mutate_json(rng, json.loads(old))).decode()
        elif rng.random() < 0.7:
            item.attrs[name] = odd[rng.integers(len(odd))]
    else:
        item.attrs["coordinates" if rng.random() < 0.3 else "new"] = odd[rng.integers(len(odd))]


def shape_stl(rng: np.random.Generator, seed: bytes) -> bytes:
    """A mesh with other corners and counts, and triangles gone, doubled, moved or turned."""
    kind = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("more", "<u2")])
    faces = np.frombuffer(seed[84:], kind).copy()
    count = len(faces)
    for _ in range(int(rng.geometric(0.5))):
        n, what = int(rng.integers(max(len(faces), 1))), int(rng.integers(7))
        if not len(faces) or what == 0:
            count = [0, 1, len(faces) + 1, 2**31, 2**32 - 1][rng.integers(5)]
        elif what < 3:  # a corner moves in all triangles that it belongs to
            old = faces["corner"][n, rng.integers(3)].copy()
            new = old.copy()
            new[rng.integers(3)] = CORNERS[rng.integers(len(CORNERS))]
            faces["corner"][(faces["corner"] == old).all(axis=2)] = new
        elif what == 3:
            faces["corner"][n, rng.integers(3), rng.integers(3)] = CORNERS[
                rng.integers(len(CORNERS))
            ]
        elif what == 4:
            faces["corner"][n] = faces["corner"][n, ::-1]
        elif what == 5:
            faces = np.delete(faces, n)
        else:
            faces = np.append(faces, faces[n : n + int(rng.integers(1, 9))])
    if count == len(np.frombuffer(seed[84:], kind)) and rng.random() < 0.8:
        count = len(faces)
    return seed[:80] + int(count).to_bytes(4, "little") + faces.tobytes()


CORNERS = [0.0, -1.0, 0.5, 1.5, 1e-30, 1e30, 3.4e38, -3.4e38, np.nan, np.inf, 1e-7, 100.0]
OBJ_WORDS = [
    *(b"f 1 2 3", b"f 1/1/1 2/2/2 3/3/3", b"f 1//1 2//1 3//1", b"f -1 -2 -3", b"f 0 1 2"),
    *(b"f 1 2 99999999999", b"f " + b"1 " * 5000, b"f 1 1 1", b"f 1/", b"f a b c", b"l 1 2"),
    *(b"v 1e309 0 0", b"v nan 0 0", b"v 1 2", b"v 1 2 3 4 5 6", b"v", b"vn 0 0 0", b"vt 1"),
    *(
        b"mtllib ../../etc/passwd",
        b"usemtl a",
        b"o \xff",
        b"g",
        b"call x.obj",
        b"\\",
        b"# \x00",
    ),
]


def shape_obj(rng: np.random.Generator, seed: bytes) -> bytes:
    """A mesh with other numbers and lines, and lines gone, doubled or moved."""
    lines = seed.split(b"\n")
    for _ in range(int(rng.geometric(0.5))):
        n, what = int(rng.integers(len(lines))), int(rng.integers(5))
        words = lines[n].split()
        if what == 0:
            lines.insert(n, OBJ_WORDS[rng.integers(len(OBJ_WORDS))])
        elif what < 3 and len(words) > 1:
            odd = [*NUMBERS, *(b"%g" % value for value in CORNERS)]
            words[rng.integers(1, len(words))] = odd[rng.integers(len(odd))]
            lines[n] = b" ".join(words)
        elif what == 3:
            lines = _change_lines(rng, b"\n".join(lines)).split(b"\n")
        else:
            lines[n] = _change_cell(rng, lines[n])
    return b"\n".join(lines)
