"""ROS recordings: one topic of numbers as a table; opened in the guard's process, needs the extra
``ros``.

MCAP is read by the library of those who made the format, which gives its metadata too; ROS 2's
SQLite bags and ROS 1's bags by rosbags, which needs no ROS either.
"""

import contextlib
import fnmatch
import io
import os
import re
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, require_extra
from feeler.files import read_start
from feeler.sandbox import find_limits, open_guarded
from feeler.tables import MAX_COLUMNS, Table

_MAGIC = b"\x89MCAP0\r\n"
_STARTS = {_MAGIC: ".mcap", b"SQLite format 3\0": ".db3", b"#ROSBAG V2.0\n": ".bag"}
_ZSTD = b"\x28\xb5\x2f\xfd"
_ENDINGS = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
_JOINTS = "sensor_msgs/msg/JointState"
_NUMBERS = re.compile(r"std_msgs/msg/(Float|U?Int|Byte)\d*MultiArray")
_NOTES = "feeler"  # the metadata record of a bag that says what a CSV's notes say
_STATES = ("values", "velocity", "effort")
_MAX_TOPICS = 12  # that a message or ``feeler info`` lists


@dataclass(frozen=True, kw_only=True)
class _Bag:
    """An open recording, as its library gives it: kinds of messages, how many and when.

    Attributes
    ----------
    kinds, counts : dict
        Topic → kind of its messages, and their number.
    ends : tuple[int, ...]
        When the first message and the last were written down [ns]; empty where there is none.
    read : Callable[[str], Iterator[tuple[Any, int]]]
        Messages of a topic, and when each was sent [ns].
    """

    kinds: dict[str, str]
    counts: dict[str, int]
    ends: tuple[int, ...]
    read: Callable[[str], Iterator[tuple[Any, int]]]
    notes: dict[str, str]


def find_bag(path: str | os.PathLike) -> tuple[str, str, str] | None:
    """File or folder, topic and unit of ``run.mcap``, ``run.mcap:TOPIC`` or
    ``run.mcap:TOPIC:UNIT`` (``.db3`` and ``.bag`` too); None for another file.
    """
    text = os.fspath(path)
    match = (
        None
        if os.path.exists(text)
        else re.fullmatch(
            r"(.+?\.(?:(?:mcap|db3)(?:\.zstd)?|bag)|[^:]+):([^:]*)(?::(\w*))?", text
        )
    )
    file, topic, unit = match.groups(default="") if match else (text, "", "")
    if os.path.isdir(file):
        return (file, topic, unit) if _list_parts(file) else None
    return (file, topic, unit) if _find_ending(file) else None


def _find_ending(file: str | os.PathLike) -> str:
    """The ending of bags that begin as this file does; empty for other files."""
    try:
        start = read_start(file, 16)
    except InvalidInput:
        return ""
    if start.startswith(_ZSTD):  # compressed as a file, by ros2 bag record
        return next((ending for ending in _ENDINGS[2:] if str(file).endswith(ending)), "")
    return next((ending for magic, ending in _STARTS.items() if start.startswith(magic)), "")


def _list_parts(path: str) -> list[Path]:
    """The files of a bag in their order; a folder holds one kind of them."""
    if not os.path.isdir(path):
        return [Path(path)]
    for ending in _ENDINGS:
        if parts := sorted(Path(path).glob(f"*{ending}"), key=_count):
            return parts
    return []


@contextlib.contextmanager
def _unpack(path: str) -> Iterator[str]:
    """The path of a bag whose files are not compressed: its own, or of a temporary copy."""
    parts = _list_parts(path)
    mcap = not parts or _find_ending(parts[0]).startswith(".mcap")
    require_extra("mcap_ros2" if mcap else "rosbags", "ros", "a ROS recording")
    if not parts or not _find_ending(parts[0]).endswith(".zstd"):
        yield path
        return
    require_extra("zstandard", "ros", "a compressed ROS recording")
    import zstandard

    left = find_limits().max_bytes
    with tempfile.TemporaryDirectory(prefix="feeler-bag-") as folder:
        home = Path(folder) / Path(path).name.removesuffix(".zstd")  # named in messages
        if os.path.isdir(path):
            home.mkdir()
        for part in parts:
            copy = home / part.name.removesuffix(".zstd") if home.is_dir() else home
            with part.open("rb") as packed, copy.open("wb") as plain:
                try:
                    for block in zstandard.ZstdDecompressor().read_to_iter(packed):
                        left -= len(block)
                        if left < 0:
                            raise InvalidInput(
                                f"{part.name} unpacks to more than the limit of"
                                f" {find_limits().max_bytes / 2**30:.4g} GiB (FEELER_MAX_GIB)."
                            )
                        plain.write(block)
                    if not plain.tell():
                        raise InvalidInput(f"{part.name} was cut off: nothing of it is whole.")
                except zstandard.ZstdError as error:
                    raise InvalidInput(
                        f"{part.name} is damaged, or was cut off while it was compressed ({error})."
                    ) from error
        yield str(home)


def read_bag(path: str, topic: str = "", unit: str = "", joints: Sequence[str] = ()) -> Table:
    """Time [ms] since the first message and a column per number, of the one topic of numbers or of
    the one that is named.

    ``joints`` are names or patterns (``antenna_*``) of those to be taken, base to tip, from a topic
    that has others too, from one publisher or several. Velocities and efforts stand in columns of
    their own, ``NAME/velocity`` [rad/s] and ``NAME/effort`` [N·m].

    Topics of ``std_msgs`` arrays (one sample a message; the label of their dimension may be the
    unit) and of ``sensor_msgs/msg/JointState`` (positions, in rad). A metadata record ``feeler``
    of an MCAP holds what a CSV's notes hold.

    Raises
    ------
    MissingDependencyError
        The library that reads this kind of bag is not installed.
    InvalidInput
        No such topic (those that exist are named), several to choose from, messages of changing
        length, or a damaged file.
    """
    with _unpack(path) as plain:
        about, arrays = open_guarded(
            "feeler.tensors.bags:read_topic", plain, words=(topic, *joints)
        )
    values, names = arrays["values"], about["names"]
    columns = names or [f"hinge{k + 1}" for k in range(values.shape[1])]
    beside = [name for name in ("velocity", "effort") if name in arrays]
    notes = {**about["notes"], "unit": unit or about["unit"]}
    return Table(
        columns=(
            "time_ms",
            *columns,
            *(f"{name}/{what}" for what in beside for name in columns),
        ),
        values=np.column_stack(
            [arrays["time"] * 1e-6, values, *(arrays[name] for name in beside)]
        ),
        notes={name: text for name, text in notes.items() if text},
        line=np.arange(1, len(values) + 1),
        source=f"{Path(path).name}:{about['topic']}",
    )


def describe_bag(path: str) -> list[str]:
    """Lines of ``feeler info``: span, topics of numbers, how many of other kinds."""
    with _unpack(path) as plain:
        about, _ = open_guarded("feeler.tensors.bags:list_topics", plain)
    kinds, counts = about["kinds"], about["counts"]
    numeric = [topic for topic, kind in kinds.items() if _is_numeric(kind)]
    other = [topic for topic in kinds if topic not in numeric]
    lines = [f"span        {about['span']:.4g} s, {sum(counts.values())} messages"]
    for topic in numeric[:_MAX_TOPICS]:
        # from the first message to the last there is one pause fewer than messages
        rate = max(counts[topic] - 1, 0) / about["span"] if about["span"] else 0.0
        lines.append(
            f"topic       {topic} ({kinds[topic]}), {counts[topic]} messages, {rate:.3g}/s"
        )
    if len(numeric) > _MAX_TOPICS:
        lines.append(f"            … {len(numeric)} topics of numbers in all")
    if not numeric:
        lines.append("topic       none of numbers (JointState, arrays of std_msgs)")
    if other:
        more = f", … ({len(other)} in all)" if len(other) > _MAX_TOPICS else ""
        lines.append(f"not read    {', '.join(other[:_MAX_TOPICS])}{more}")
    if numeric:
        topic = quote(f"{Path(path).name}:{numeric[0].lstrip('/')}")
        return [*lines, f"next        feeler robot check {topic}"]
    return lines


def list_topics(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does for :func:`describe_bag`."""
    kinds: dict[str, str] = {}
    counts: Counter[str] = Counter()
    ends: list[int] = []
    for part in _list_parts(path):
        with _open(part) as bag:
            kinds |= bag.kinds
            ends += bag.ends
            counts.update(bag.counts)
    span = (max(ends) - min(ends)) / 1e9 if ends else 0.0
    return {"kinds": kinds, "counts": counts, "span": span}, {}


def read_topic(path: str, topic: str, *joints: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does: the numbers (message, channel) of a topic and their times [ns]
    since the first.
    """
    clocks: list[list[int]] = [[], []]  # when each message was sent, and when it was measured
    rows: list[Any] = []
    named: list[tuple[str, ...]] = []
    about: dict[str, Any] = {"notes": {}, "unit": "", "topic": topic}
    for part in _list_parts(path):
        with _open(part) as bag:
            if not bag.kinds:  # a recorder may close a part before anything was sent
                continue
            about["topic"] = chosen = _choose(bag.kinds, topic)
            about["notes"] |= bag.notes
            kind = bag.kinds[chosen]
            for message, sent in bag.read(chosen):
                found, names, about["unit"] = _take(message, kind)
                wanted = len(rows[0] if rows else found)
                if kind != _JOINTS and not 0 < len(found) == wanted < MAX_COLUMNS:
                    raise InvalidInput(
                        f"message {len(rows)} of {chosen} holds {len(found)} numbers, others not as"
                        " many."
                    )
                rows.append(found)
                named.append(names)
                clocks[0].append(sent)
                # When a joint state was measured [ns]; 0 where it does not say so.
                stamp = message.header.stamp if kind == _JOINTS else None
                clocks[1].append(stamp.sec * 10**9 + stamp.nanosec if stamp else 0)
    if not rows:
        raise InvalidInput(f"{about['topic'] or 'it'} holds no message.")
    # one clock for all: a simulation's stamps may begin at 0, and who stamps nothing says 0 always
    stamped = any(clocks[1])
    if named[0] and not stamped:
        about["notes"]["clock"] = "the stamps are all 0: times are those of the recorder"
    time = np.array(clocks[1] if stamped else clocks[0])
    if not named[0]:
        since = (time - time[0]).astype(float)
        return {**about, "names": []}, {"time": since, "values": np.array(rows, dtype=float)}
    chosen_names, time, arrays = _join(rows, named, time, joints)
    if len({*named}) > 1:
        about["notes"]["publishers"] = f"{len({*named})} publishers on the topic"
    if not len(time):
        raise InvalidInput(f"{about['topic']} holds no message of {', '.join(joints)}.")
    return {**about, "names": chosen_names}, {"time": (time - time[0]).astype(float), **arrays}


def choose_names(names: Sequence[str], joints: Sequence[str]) -> list[str]:
    """Those of ``names`` that are named, in the order in which they are; those of one pattern
    (``*``, ``?``, ``[…]``) in the order of the numbers that end them.

    Raises
    ------
    InvalidInput
        A name or pattern that fits none.
    """
    chosen: list[str] = []
    for wanted in joints:
        found = [name for name in names if name == wanted]
        found = found or [name for name in names if fnmatch.fnmatchcase(name, wanted)]
        if not found:
            more = f", … ({len(names)} in all)" if len(names) > _MAX_TOPICS else ""
            raise InvalidInput(
                f"no channel is called {wanted!r}; there are"
                f" {', '.join(list(names)[:_MAX_TOPICS])}{more}."
            )
        chosen += [name for name in sort_names(found) if name not in chosen]
    return chosen


def sort_names(names: Sequence[str]) -> list[str]:
    """Names in the order of the numbers that end them; in their own where some have none."""
    ends = [int(found[1]) for name in names if (found := re.search(r"(\d{1,9})\D*$", name))]
    order = np.argsort(ends) if len({*ends}) == len(names) else np.arange(len(names))
    return [names[k] for k in order]


def _join(
    rows: list[Any], named: list[tuple[str, ...]], time: np.ndarray, joints: Sequence[str]
) -> tuple[list[str], np.ndarray, dict[str, np.ndarray]]:
    """Names, times and arrays (message, joint) of joint states, of which each names its own."""
    every = [*dict.fromkeys(name for names in dict.fromkeys(named) for name in names)]
    if not joints and any({*names} != {*every} for names in {*named}):
        first, other = list(dict.fromkeys(named))[:2]
        raise InvalidInput(
            f"its joints change from {', '.join(first[:12])} to {', '.join(other[:12])}: several"
            " publishers. Name those of the antenna: joints='antenna_*'."
        )
    chosen = choose_names(every, joints) if joints else [*named[0]]
    if not 0 < len(chosen) < MAX_COLUMNS // 3:
        raise InvalidInput(f"its messages name {len(chosen)} joints.")
    place = {name: k for k, name in enumerate(chosen)}
    arrays = {what: np.full((len(rows), len(chosen)), np.nan) for what in _STATES}
    for k, (row, names) in enumerate(zip(rows, named, strict=True)):
        there = [(i, place[name]) for i, name in enumerate(names) if name in place]
        for what, values in zip(_STATES, row, strict=True):
            if there and len(values) == len(names):
                own, to = map(list, zip(*there, strict=True))
                arrays[what][k, to] = np.asarray(values, dtype=float)[own]
    held = np.isfinite(arrays["values"]).any(axis=1)
    if joints:  # messages of other publishers are left out, times of several put in order
        order = np.flatnonzero(held)
        order = order[np.argsort(time[order], kind="stable")]
    else:
        order = np.arange(len(rows))
    time, arrays = time[order], {what: values[order] for what, values in arrays.items()}
    if joints and len({*named}) > 1:
        time, arrays = _merge(time, arrays)
    beside = {
        what: values
        for what, values in arrays.items()
        if what == "values" or np.isfinite(values).any()
    }
    return chosen, time, beside


def _merge(
    time: np.ndarray, arrays: dict[str, np.ndarray]
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """One row for messages of one time of which each holds joints that the others lack."""
    values = arrays["values"]
    fresh = np.ones(time.size, dtype=bool)
    for k in range(1, time.size):
        both = np.isfinite(values[k - 1]) & np.isfinite(values[k])
        if time[k] == time[k - 1] and not both.any():
            fresh[k - 1] = False
            for found in arrays.values():
                found[k] = np.where(np.isfinite(found[k]), found[k], found[k - 1])
    return time[fresh], {what: found[fresh] for what, found in arrays.items()}


def _open(part: Path) -> contextlib.AbstractContextManager[_Bag]:
    return (_open_mcap if _find_ending(part) == ".mcap" else _open_rosbag)(part)


@contextlib.contextmanager
def _open_mcap(part: Path) -> Iterator[_Bag]:
    from mcap.reader import make_reader

    with open(part, "rb") as stream:
        reader = make_reader(stream)
        try:
            summary = reader.get_summary()
        except (
            Exception
        ):  # cut off, such as by a loss of power: whatever its library stumbles over
            summary = None
        if summary is None:
            stream.seek(0)
            yield _salvage(stream)
            return
        channels, schemas = summary.channels, summary.schemas
        counts, ends = _count_messages(reader, summary.statistics)
        yield _Bag(
            kinds={
                c.topic: s.name if (s := schemas.get(c.schema_id)) else ""
                for c in channels.values()
            },
            counts={c.topic: counts.get(number, 0) for number, c in channels.items()},
            ends=ends,
            read=lambda topic: _decode(reader.iter_messages(topics=[topic])),
            notes={
                name: text
                for record in reader.iter_metadata()
                if record.name == _NOTES
                for name, text in dict(record.metadata).items()
            },
        )


def _decode(found: Iterable[tuple[Any, Any, Any]]) -> Iterator[tuple[Any, int]]:
    """Messages of (schema, channel, record), and when each was sent [ns]."""
    from mcap_ros2.decoder import DecoderFactory

    factory = DecoderFactory()
    for schema, channel, record in found:
        if decode := factory.decoder_for(channel.message_encoding, schema):
            yield decode(_unpack_message(record.data)), record.publish_time


def _unpack_message(data: bytes) -> bytes:
    """A message, which ros2 bag record may have compressed by itself (compression_mode: message);
    what is plain begins with its byte order, never with zstd's mark.
    """
    return _unpack_chunk("zstd", data) if data.startswith(_ZSTD) else data


def _unpack_chunk(compression: str, data: bytes) -> bytes:
    """The records of a chunk, as far as they are there."""
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    if compression == "lz4":
        import lz4.frame

        return lz4.frame.LZ4FrameDecompressor().decompress(data)
    return data


def _salvage(stream: Any) -> _Bag:
    """What is whole of an MCAP that was not closed, read from its beginning."""
    from mcap.records import Channel, Chunk, Message, Metadata, Schema
    from mcap.stream_reader import StreamReader

    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    messages: list[Any] = []
    notes: dict[str, str] = {}

    def take(source: Any, **how: Any) -> int:
        """Keep records until the first that is not whole; where that begins."""
        begin = source.tell()
        try:
            for record in StreamReader(source, record_size_limit=limit, **how).records:
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel):
                    channels[record.id] = record
                elif isinstance(record, Message) and record.channel_id in channels:
                    messages.append(record)
                elif isinstance(record, Metadata) and record.name == _NOTES:
                    notes.update(record.metadata)
                elif isinstance(record, Chunk):
                    take(
                        io.BytesIO(_unpack_chunk(record.compression, record.data)),
                        skip_magic=True,
                    )
                begin = source.tell()
        except Exception:  # whatever its library stumbles over
            return begin
        return begin

    limit = find_limits().max_bytes
    stream.seek(take(stream, emit_chunks=True))
    rest = stream.read(limit)
    if rest[:1] == b"\x06" and len(rest) > 45:  # a chunk: what of it is there
        word = int.from_bytes(rest[37:41], "little")
        packed = rest[41 + word + 8 :]
        plain = _unpack_chunk(rest[41 : 41 + word].decode("ascii", "replace"), packed)
        take(io.BytesIO(plain), skip_magic=True)
    if not messages:
        raise InvalidInput("it was cut off before its first message was whole.")
    counts = Counter(message.channel_id for message in messages)
    times = [message.log_time for message in messages]

    def read(topic: str) -> Iterator[tuple[Any, int]]:
        ordered = sorted(messages, key=lambda one: one.log_time)
        found = [(channels[message.channel_id], message) for message in ordered]
        return _decode((schemas.get(c.schema_id), c, m) for c, m in found if c.topic == topic)

    kinds = {
        c.topic: s.name if (s := schemas.get(c.schema_id)) else "" for c in channels.values()
    }
    whole = f"the file was not closed: read are the {len(messages)} messages that are whole"
    return _Bag(
        kinds=kinds,
        counts={c.topic: counts[number] for number, c in channels.items()},
        ends=(min(times), max(times)),
        read=read,
        notes={**notes, "cut": whole},
    )


def _count_messages(reader: Any, counted: Any) -> tuple[dict[int, int], tuple[int, ...]]:
    """Messages of each channel, and the first and the last [ns]; counted here where the file does
    not say.
    """
    if counted and counted.message_count:
        ends = counted.message_start_time, counted.message_end_time
        return counted.channel_message_counts, ends
    found = [(channel.id, message.log_time) for _, channel, message in reader.iter_messages()]
    counts, times = Counter(number for number, _ in found), [time for _, time in found]
    return counts, (min(times), max(times)) if times else ()


@contextlib.contextmanager
def _open_rosbag(part: Path) -> Iterator[_Bag]:
    """ROS 2's SQLite bag or ROS 1's bag; what an old one does not define are ROS 2's messages."""
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.typesys import Stores, get_typestore

    try:
        with AnyReader([part], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield _Bag(
                kinds={name: about.msgtype or "" for name, about in reader.topics.items()},
                counts={name: about.msgcount for name, about in reader.topics.items()},
                ends=(reader.start_time, reader.end_time) if reader.message_count else (),
                read=lambda topic: (
                    (reader.deserialize(_unpack_message(raw), connection.msgtype), sent)
                    for connection, sent, raw in reader.messages(
                        [c for c in reader.connections if c.topic == topic]
                    )
                ),
                notes={},
            )
    except AnyReaderError as error:
        raise InvalidInput(
            f"it is no ROS recording that is whole ({error}). Databases of another kind are not"
            " read; a bag that was cut off is mended by ros2 bag reindex (ROS 1: rosbag reindex)."
        ) from error


def _count(part: Path) -> tuple[int, str]:
    """Files of a bag are numbered: run_2.mcap stands before run_10.mcap."""
    digits = re.search(r"(\d+)\.\w+$", part.name)
    return int(digits[1]) if digits else 0, part.name


def _is_numeric(kind: str) -> bool:
    return kind == _JOINTS or _NUMBERS.fullmatch(kind) is not None


def _choose(kinds: dict[str, str], topic: str) -> str:
    """The topic that is asked for, or the only one of numbers."""
    numeric = [name for name, kind in kinds.items() if _is_numeric(kind)]
    fitting = [name for name in numeric if topic in ("", name, name.lstrip("/"))]
    if len(fitting) == 1:
        return fitting[0]
    asked = f"no topic {topic!r} of numbers" if topic else f"{len(numeric)} topics of numbers"
    listed = numeric or list(kinds)
    shown = ", ".join(f"{name} ({kinds[name]})" for name in sorted(listed)[:_MAX_TOPICS])
    more = f", … ({len(listed)} in all)" if len(listed) > _MAX_TOPICS else ""
    raise InvalidInput(
        f"it has {asked}; it holds {shown}{more}. Read are JointState and arrays of std_msgs; name"
        " one: FILE:TOPIC."
    )


def _take(message: Any, kind: str) -> tuple[Any, tuple[str, ...], str]:
    """The numbers of one message (of joints: position, velocity, effort), the names of its
    channels, and their unit where it says one.
    """
    if kind != _JOINTS:
        dims = message.layout.dim
        if len(dims) > 1:
            raise InvalidInput(
                f"its arrays have {len(dims)} dimensions; a message is one sample of all sensors."
            )
        # libraries give bytes as such, alone or each by itself
        numbers = [value[0] if isinstance(value, bytes) else value for value in message.data]
        return numbers, (), dims[0].label if dims else ""
    return (message.position, message.velocity, message.effort), (*message.name,), "rad"
