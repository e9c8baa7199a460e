"""ROS recordings: one topic of numbers as a table; opened in the guard's process, needs the extra
``ros``.

MCAP is read by the library of those who made the format, which gives its metadata too; ROS 2's
SQLite bags and ROS 1's bags by rosbags, which needs no ROS either.
"""

import contextlib
import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, MissingDependencyError
from feeler.files import read_start
from feeler.sandbox import open_guarded
from feeler.tensors.table import MAX_COLUMNS, Table

_MAGIC = b"\x89MCAP0\r\n"
_STARTS = {_MAGIC: ".mcap", b"SQLite format 3\0": ".db3", b"#ROSBAG V2.0\n": ".bag"}
_JOINTS = "sensor_msgs/msg/JointState"
_NUMBERS = re.compile(r"std_msgs/msg/(Float|U?Int|Byte)\d*MultiArray")
_NOTES = "feeler"  # the metadata record of a bag that says what a CSV's notes say
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
        else re.fullmatch(r"(.+?\.(?:mcap|db3|bag)|[^:]+):([^:]*)(?::(\w*))?", text)
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
    return next((ending for magic, ending in _STARTS.items() if start.startswith(magic)), "")


def _list_parts(path: str) -> list[Path]:
    """The files of a bag in their order; a folder holds one kind of them."""
    if not os.path.isdir(path):
        return [Path(path)]
    for ending in (".mcap", ".db3"):
        if parts := sorted(Path(path).glob(f"*{ending}"), key=_count):
            return parts
    return []


def read_bag(path: str, topic: str = "", unit: str = "") -> Table:
    """Time [ms] since the first message and a column per number, of the one topic of numbers or of
    the one that is named.

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
    _require_library(path)
    about, arrays = open_guarded("feeler.tensors.bags:read_topic", path, words=(topic,))
    values, names = arrays["values"], about["names"]
    columns = names or [f"hinge{k + 1}" for k in range(values.shape[1])]
    notes = {**about["notes"], "unit": unit or about["unit"]}
    return Table(
        columns=("time_ms", *columns),
        values=np.column_stack([arrays["time"] * 1e-6, values]),
        notes={name: text for name, text in notes.items() if text},
        line=np.arange(1, len(values) + 1),
        source=f"{Path(path).name}:{about['topic']}",
    )


def describe_bag(path: str) -> list[str]:
    """Lines of ``feeler info``: span, topics of numbers, how many of other kinds."""
    _require_library(path)
    about, _ = open_guarded("feeler.tensors.bags:list_topics", path)
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
    name = Path(path).name
    if numeric:
        return [*lines, f"next        feeler robot check {name}:{numeric[0].lstrip('/')}"]
    return lines


def _require_library(path: str) -> None:
    parts = _list_parts(path)
    mcap = not parts or _find_ending(parts[0]) == ".mcap"
    if find_spec("mcap_ros2" if mcap else "rosbags") is None:
        raise MissingDependencyError(
            f"ROS recordings need {'mcap' if mcap else 'rosbags'}: pip install 'feeler[ros]'."
        )


def list_topics(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does for :func:`describe_bag`."""
    kinds: dict[str, str] = {}
    counts: dict[str, int] = {}
    ends: list[int] = []
    for part in _list_parts(path):
        with _open(part) as bag:
            kinds |= bag.kinds
            ends += bag.ends
            for topic, count in bag.counts.items():
                counts[topic] = counts.get(topic, 0) + count
    span = (max(ends) - min(ends)) / 1e9 if ends else 0.0
    return {"kinds": kinds, "counts": counts, "span": span}, {}


def read_topic(path: str, topic: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does: the numbers (message, channel) of a topic and their times [ns]
    since the first.
    """
    clocks: list[list[int]] = [[], []]  # when each message was sent, and when it was measured
    rows: list[Any] = []
    names: list[str] = []
    about: dict[str, Any] = {"notes": {}, "unit": "", "topic": topic}
    for part in _list_parts(path):
        with _open(part) as bag:
            if not bag.kinds:  # a recorder may close a part before anything was sent
                continue
            about["topic"] = chosen = _choose(bag.kinds, topic)
            about["notes"] |= bag.notes
            for message, sent in bag.read(chosen):
                found, names, about["unit"] = _take(message, bag.kinds[chosen], names)
                _check_length(len(found), rows, chosen)
                rows.append(found)
                clocks[0].append(sent)
                clocks[1].append(_read_stamp(message, bag.kinds[chosen]))
    if not rows:
        raise InvalidInput(f"{about['topic'] or 'it'} holds no message.")
    # one clock for all: a simulation's stamps may begin at 0, and who stamps nothing says 0 always
    time = clocks[1] if any(clocks[1]) else clocks[0]
    since = np.array([at - time[0] for at in time], dtype=float)
    return {**about, "names": names}, {"time": since, "values": np.array(rows, dtype=float)}


def _check_length(length: int, rows: list[Any], topic: str) -> None:
    if length != len(rows[0] if rows else range(length)) or not 0 < length < MAX_COLUMNS:
        raise InvalidInput(
            f"message {len(rows)} of {topic} holds {length} numbers, others not as many."
        )


def _read_stamp(message: Any, kind: str) -> int:
    """When a joint state was measured [ns]; 0 where it does not say so."""
    stamp = message.header.stamp if kind == _JOINTS else None
    return stamp.sec * 10**9 + stamp.nanosec if stamp else 0


def _open(part: Path) -> contextlib.AbstractContextManager[_Bag]:
    return (_open_mcap if _find_ending(part) == ".mcap" else _open_rosbag)(part)


@contextlib.contextmanager
def _open_mcap(part: Path) -> Iterator[_Bag]:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with open(part, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        if summary is None:
            raise InvalidInput("it has no index: it was not closed. `mcap recover` mends it.")
        channels, schemas = summary.channels, summary.schemas
        counts, ends = _count_messages(reader, summary.statistics)
        yield _Bag(
            kinds={
                c.topic: s.name if (s := schemas.get(c.schema_id)) else ""
                for c in channels.values()
            },
            counts={c.topic: counts.get(number, 0) for number, c in channels.items()},
            ends=ends,
            read=lambda topic: (
                (item.decoded_message, item.message.publish_time)
                for item in reader.iter_decoded_messages(topics=[topic])
            ),
            notes={
                name: text
                for record in reader.iter_metadata()
                if record.name == _NOTES
                for name, text in dict(record.metadata).items()
            },
        )


def _count_messages(reader: Any, counted: Any) -> tuple[dict[int, int], tuple[int, ...]]:
    """Messages of each channel, and the first and the last [ns]; counted here where the file does
    not say.
    """
    if counted and counted.message_count:
        ends = counted.message_start_time, counted.message_end_time
        return counted.channel_message_counts, ends
    counts: dict[int, int] = {}
    times = []
    for _, channel, message in reader.iter_messages():
        counts[channel.id] = counts.get(channel.id, 0) + 1
        times.append(message.log_time)
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
                    (reader.deserialize(raw, connection.msgtype), sent)
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


def _take(message: Any, kind: str, names: list[str]) -> tuple[Any, list[str], str]:
    """The numbers of one message, the names of its channels, and their unit where it says one."""
    if kind != _JOINTS:
        dims = message.layout.dim
        if len(dims) > 1:
            raise InvalidInput(
                f"its arrays have {len(dims)} dimensions; a message is one sample of all sensors."
            )
        # libraries give bytes as such, alone or each by itself
        numbers = [value[0] if isinstance(value, bytes) else value for value in message.data]
        return numbers, [], dims[0].label if dims else ""
    found = list(message.name)
    if names and found != names:
        raise InvalidInput(
            f"its joints change from {', '.join(names[:12])} to {', '.join(found[:12])}."
        )
    return message.position, found, "rad"
