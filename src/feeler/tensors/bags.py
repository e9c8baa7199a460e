"""ROS 2 recordings (MCAP): one topic of numbers as a table; opened in the guard's process, needs
the extra ``ros``.
"""

import os
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, MissingExtra
from feeler.guard import open_guarded
from feeler.tensors.table import MAX_COLUMNS, Table

MAGIC = b"\x89MCAP0\r\n"
JOINTS = "sensor_msgs/msg/JointState"
NUMBERS = re.compile(r"std_msgs/msg/(Float|U?Int)\d+MultiArray")
NOTES = "feeler"  # the metadata record of a bag that says what a CSV's notes say


def find_bag(path: str | os.PathLike) -> tuple[str, str, str] | None:
    """File or folder, topic and unit of ``run.mcap``, ``run.mcap:TOPIC`` or
    ``run.mcap:TOPIC:UNIT``; None for another file.
    """
    text = os.fspath(path)
    match = (
        None
        if os.path.exists(text)
        else re.fullmatch(r"(.+?\.mcap|[^:]+):([^:]*)(?::(\w*))?", text)
    )
    file, topic, unit = match.groups(default="") if match else (text, "", "")
    if os.path.isdir(file):
        return (file, topic, unit) if any(Path(file).glob("*.mcap")) else None
    try:
        with open(file, "rb") as stream:
            return (file, topic, unit) if stream.read(len(MAGIC)) == MAGIC else None
    except (OSError, ValueError):
        return None


def read_bag(path: str, topic: str = "", unit: str = "") -> Table:
    """Time [ms] since the first message and a column per number, of the one topic of numbers or of
    the one that is named.

    Topics of ``std_msgs`` arrays (one sample a message; the label of their dimension may be the
    unit) and of ``sensor_msgs/msg/JointState`` (positions, in rad). A metadata record ``feeler``
    holds what a CSV's notes hold.

    Raises
    ------
    MissingExtra
        mcap or mcap-ros2-support is not installed.
    InvalidInput
        No such topic (those that exist are named), several to choose from, messages of changing
        length, or a damaged file.
    """
    if find_spec("mcap_ros2") is None:
        raise MissingExtra("ROS 2 recordings need mcap: pip install 'feeler[ros]'.")
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


def read_topic(path: str, topic: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does: the numbers (message, channel) of a topic and their times [ns]
    since the first.
    """
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    parts = sorted(Path(path).glob("*.mcap"), key=_count) if os.path.isdir(path) else [Path(path)]
    sent: list[int] = []
    stamped: list[int] = []
    rows: list[Any] = []
    names: list[str] = []
    about: dict[str, Any] = {"notes": {}, "unit": "", "topic": topic}
    for part in parts:
        with open(part, "rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])
            summary = reader.get_summary()
            if summary is None or not summary.channels:
                raise InvalidInput(
                    "it has no index: it was not closed, or is empty. `mcap recover` mends it."
                )
            kinds = {
                c.topic: s.name if (s := summary.schemas.get(c.schema_id)) else ""
                for c in summary.channels.values()
            }
            about["topic"] = chosen = _choose(kinds, topic)
            for record in reader.iter_metadata():
                about["notes"] |= dict(record.metadata) if record.name == NOTES else {}
            for item in reader.iter_decoded_messages(topics=[chosen]):
                message = item.decoded_message
                found, names, about["unit"] = _take(message, kinds[chosen], names)
                if (
                    len(found) != len(rows[0] if rows else found)
                    or not 0 < len(found) < MAX_COLUMNS
                ):
                    raise InvalidInput(
                        f"message {len(rows)} of {chosen} holds {len(found)} numbers, others not as"
                        " many."
                    )
                rows.append(found)
                sent.append(item.message.publish_time)
                if kinds[chosen] == JOINTS:
                    stamp = message.header.stamp
                    stamped.append(stamp.sec * 10**9 + stamp.nanosec)
    if not rows:
        raise InvalidInput(f"{about['topic']} holds no message.")
    # one clock for all: a simulation's stamps may begin at 0, and who stamps nothing says 0 always
    time = stamped if any(stamped) else sent
    since = np.array([at - time[0] for at in time], dtype=float)
    return {**about, "names": names}, {"time": since, "values": np.array(rows, dtype=float)}


def _count(part: Path) -> tuple[int, str]:
    """Files of a bag are numbered: run_2.mcap stands before run_10.mcap."""
    digits = re.search(r"(\d+)\.mcap$", part.name)
    return int(digits[1]) if digits else 0, part.name


def _choose(kinds: dict[str, str], topic: str) -> str:
    """The topic that is asked for, or the only one of numbers."""
    numeric = [name for name, kind in kinds.items() if kind == JOINTS or NUMBERS.fullmatch(kind)]
    fitting = [name for name in numeric if topic in ("", name, name.lstrip("/"))]
    if len(fitting) == 1:
        return fitting[0]
    shown = ", ".join(f"{name} ({kind})" for name, kind in sorted(kinds.items())[:20])
    asked = f"no topic {topic!r} of numbers" if topic else f"{len(numeric)} topics of numbers"
    raise InvalidInput(
        f"it has {asked}; it holds {shown}. Read are JointState and arrays of std_msgs; name one:"
        " run.mcap:TOPIC."
    )


def _take(message: Any, kind: str, names: list[str]) -> tuple[Any, list[str], str]:
    """The numbers of one message, the names of its channels, and their unit where it says one."""
    if kind != JOINTS:
        dims = message.layout.dim
        if len(dims) > 1:
            raise InvalidInput(
                f"its arrays have {len(dims)} dimensions; a message is one sample of all sensors."
            )
        return message.data, [], dims[0].label if dims else ""
    found = list(message.name)
    if names and found != names:
        raise InvalidInput(
            f"its joints change from {', '.join(names[:12])} to {', '.join(found[:12])}."
        )
    return message.position, found, "rad"
