"""ROS 2 recordings (MCAP), written by the format's own library with ROS 2's own message
definitions, become recordings.
"""

import json

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.robot import load_recording, repair
from feeler.tensors.bags import describe_bag, read_bag
from feeler.tensors.formats import load

RULE = "=" * 80
STAMP = (
    f"builtin_interfaces/Time stamp\nstring frame_id\n{RULE}\nMSG: builtin_interfaces/Time\nint32"
    " sec\nuint32 nanosec"
)
JOINT = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{RULE}
MSG: std_msgs/Header
{STAMP}"""
ARRAY = f"""MultiArrayLayout layout
float64[] data
{RULE}
MSG: std_msgs/MultiArrayLayout
MultiArrayDimension[] dim
uint32 data_offset
{RULE}
MSG: std_msgs/MultiArrayDimension
string label
uint32 size
uint32 stride"""
SENT = (
    1_780_000_000_000_000_000  # ns; as doubles these would be off by a quarter of a microsecond
)
NAMES = [
    f"hinge_{k}" for k in (0, 10, 11, 1, 2, 3, 4, 5, 6, 7, 8, 9)
]  # as joint_state_publisher sorts them
RNG = np.random.default_rng(0)
ANGLE, CAPACITANCE = RNG.random((50, 12)), RNG.random((50, 3))


def write(
    path,
    *,
    names=NAMES,
    label="pF",
    parts=1,
    metadata=None,
    dims=1,
    topics=("/joint_states", "/antenna/touch"),
    period=2_000_000,
    begin=SENT + 125,
    delay=0,
    **how,
):
    """A bag of joint states, an array and a text; in ``parts`` files where there are more."""
    for part in range(parts):
        file = path if parts == 1 else path / f"run_{part}.mcap"
        with open(file, "wb") as stream, Writer(stream, **how) as bag:
            kinds = (
                ("sensor_msgs/msg/JointState", JOINT),
                ("std_msgs/msg/Float64MultiArray", ARRAY),
            )
            joint, array = (bag.register_msgdef(*kind) for kind in kinds)
            bag.write_message(
                "/rosout",
                bag.register_msgdef("std_msgs/msg/String", "string data"),
                {"data": "hello"},
                SENT,
            )
            for k in np.array_split(np.arange(50), parts)[part].tolist():
                at = SENT + period * k + 125
                if "/joint_states" in topics:
                    stamp = 0 if begin is None else begin + period * k
                    header = {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}}
                    header["frame_id"] = ""
                    state = {"header": header, "name": names(k) if callable(names) else names}
                    state |= {"position": ANGLE[k].tolist(), "velocity": [], "effort": []}
                    bag.write_message(
                        "/joint_states", joint, state, at + 900_000 * (k % 2)
                    )  # the log is late by turns
                layout = {
                    "dim": dims * [{"label": label, "size": 3, "stride": 3}],
                    "data_offset": 0,
                }
                row = {"layout": layout, "data": CAPACITANCE[k].tolist()}
                bag.write_message("/antenna/touch", array, row, at + delay * k, at)
            if metadata:
                bag.add_metadata("feeler", metadata)
    return path


@pytest.mark.guarded
def test_joint_states_are_angles_at_their_own_times_in_the_order_of_their_numbers(tmp_path):
    read = load_recording(f"{write(tmp_path / 'run.mcap')}:joint_states", n_channels=12)
    assert read.quantity == "angle"
    np.testing.assert_allclose(read.time, 2.0 * np.arange(50), atol=1e-9)
    order = np.argsort([int(name[6:]) for name in NAMES])
    np.testing.assert_array_equal(read.values, ANGLE[:, order].T)
    assert read.history == (
        "read from run.mcap:/joint_states",
        "channels are " + ", ".join(f"hinge_{k}" for k in range(12)),
    )


def test_a_recording_of_several_seconds_keeps_its_clock(tmp_path):
    """Stamps hold seconds and the rest of each apart: 50 samples every 61.7 ms cross three."""
    path = write(tmp_path / "run.mcap", period=61_700_003)
    for topic, n in (("joint_states", 12), ("antenna/touch", 3)):
        table = read_bag(str(path), topic, "rad")
        assert table.values.shape == (50, 1 + n)
        expected = 61.700003 * np.arange(50)
        np.testing.assert_allclose(table.values[:, 0], expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("begin", "late"), [(0, 0.0), (None, 0.9)], ids=["simulated", "none"])
def test_one_clock_is_taken_for_all_messages(tmp_path, begin, late):
    """A simulation's stamps begin at 0, which is a stamp; who stamps nothing says 0 always, and the
    times of sending are taken."""
    path = write(tmp_path / "run.mcap", begin=begin)
    time = read_bag(str(path), "joint_states").values[:, 0]
    expected = 2.0 * np.arange(50) + late * (np.arange(50) % 2)
    np.testing.assert_allclose(time, expected, atol=1e-9)


def test_numbers_without_a_stamp_have_the_time_at_which_they_were_sent(tmp_path):
    """Not that at which somebody wrote them down, which comes later and later."""
    path = write(tmp_path / "run.mcap", delay=300_000)
    time = read_bag(str(path), "antenna/touch").values[:, 0]
    np.testing.assert_allclose(time, 2.0 * np.arange(50), atol=1e-9)


def test_a_bag_says_its_span_and_how_often_each_topic_speaks(tmp_path):
    """101 messages in 98.9 ms: 50 of each topic of numbers, with 49 pauses, and a text."""
    told = describe_bag(str(write(tmp_path / "run.mcap")))
    assert told[0].split() == ["span", "0.0989", "s,", "101", "messages"]
    assert [line.rsplit(", ", 1)[1] for line in told[1:3]] == ["495/s", "495/s"]


@pytest.mark.parametrize(
    ("label", "address"), [("pF", ":/antenna/touch"), ("row", ":antenna/touch:pF")]
)
def test_an_array_has_the_unit_that_its_label_or_the_address_says(tmp_path, label, address):
    notes = {
        "feature": "ball",
        "size": "4",
        "location": "0.9",
        "speed": "0.27",
        "source": "surrogate",
    }
    path = write(tmp_path / "run.mcap", label=label, metadata=notes)
    read = load_recording(f"{path}{address}", n_channels=3)
    assert read.quantity == "capacitance" and read.source == "surrogate"
    np.testing.assert_array_equal(read.values, CAPACITANCE.T)
    assert read.labels == {"feature": "ball", "size": 4.0, "location": 0.9, "speed": 0.27}


def test_a_bag_in_several_files_is_read_in_their_order(tmp_path):
    (tmp_path / "bag").mkdir()
    read = load_recording(f"{write(tmp_path / 'bag', parts=12)}:/antenna/touch", n_channels=3)
    np.testing.assert_array_equal(read.values, CAPACITANCE.T)
    table = read_bag(str(tmp_path / "bag"), "antenna/touch")
    assert table.columns == ("time_ms", "hinge1", "hinge2", "hinge3")


def test_a_topic_on_which_nobody_spoke_has_the_rate_0(tmp_path):
    with open(tmp_path / "run.mcap", "wb") as stream, Writer(stream) as bag:
        kind = bag.register_msgdef("std_msgs/msg/Float64MultiArray", ARRAY)
        bag._writer.register_channel("/silent", "cdr", kind.id)
        text = bag.register_msgdef("std_msgs/msg/String", "string data")
        for time in (0, 400):
            bag.write_message("/rosout", text, {"data": "hello"}, SENT + 1_000_000 * time)
    told = describe_bag(str(tmp_path / "run.mcap"))
    assert told[1].endswith("/silent (std_msgs/msg/Float64MultiArray), 0 messages, 0/s")


def test_a_part_that_was_closed_before_anything_was_sent_is_passed_over(tmp_path):
    with open(tmp_path / "run_0.mcap", "wb") as stream:
        Writer(stream).finish()
    with pytest.raises(InvalidInput, match=r"joint_states holds no message"):
        read_bag(str(tmp_path), "joint_states")
    write(tmp_path, parts=12)
    table = read_bag(str(tmp_path), "antenna/touch")
    np.testing.assert_array_equal(table.values[:, 1:], CAPACITANCE)


def write_texts(folder, ending, number, times):
    """One file of a bag: texts that were written down at ``times`` [ms]."""
    if ending == ".mcap":
        with open(folder / f"run_{number}.mcap", "wb") as stream, Writer(stream) as bag:
            kind = bag.register_msgdef("std_msgs/msg/String", "string data")
            bag._writer.register_channel("/nobody", "cdr", kind.id)  # spoken on by nobody
            for time in times:
                bag.write_message("/rosout", kind, {"data": "hello"}, SENT + 1_000_000 * time)
        return
    from rosbags.rosbag2 import Writer as Rosbag2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    text = store.types["std_msgs/msg/String"]
    with Rosbag2(folder / f"part {number}", version=8) as bag:
        topic = bag.add_connection("/rosout", text.__msgtype__, typestore=store)
        for time in times:
            bag.write(
                topic,
                SENT + 1_000_000 * time,
                store.serialize_cdr(text(data="hello"), text.__msgtype__),
            )
    next((folder / f"part {number}").glob("*.db3")).rename(folder / f"run_{number}.db3")


@pytest.mark.further
@pytest.mark.parametrize("ending", [".mcap", ".db3"])
@pytest.mark.parametrize(
    "parts",
    [
        [(0, 400), (5000, 5300)],
        [(0, 400), (300, 700), (650, 900)],
        [(0, 900), (300, 400)],
        [(500, 900), (0, 100)],
        [(), (200, 500), ()],
        [(250,), (1000,)],
        [(), ()],
    ],
    ids=["pause", "overlap", "within", "backwards", "empty", "single", "nothing"],
)
def test_a_bag_spans_from_its_first_message_to_its_last_in_whichever_file(
    tmp_path, parts, ending
):
    """Neither a pause between two files nor what two of them share is left out or counts twice."""
    for number, times in enumerate(parts):
        write_texts(tmp_path, ending, number, times)
    every = [time for times in parts for time in times]
    span = (max(every) - min(every)) * 1e-3 if every else 0.0
    told = describe_bag(str(tmp_path))[0].split()
    assert told == ["span", f"{span:.4g}", "s,", str(len(every)), "messages"]


@pytest.mark.further
@pytest.mark.parametrize(
    ("change", "address", "match"),
    [
        (
            {},
            "",
            (
                r"2 topics of numbers; it holds /antenna/touch \(std_msgs/msg/Float64MultiArray\),"
                r" /joint_states \(sensor_msgs/msg/JointState\)\. Read are"
            ),
        ),
        ({}, ":touch", r"no topic 'touch' of numbers; it holds /antenna/touch"),
        ({}, ":rosout", r"no topic 'rosout' of numbers; it holds /antenna/touch"),
        (
            {"label": "volts"},
            ":antenna/touch",
            r"unit of the channels is 'volts'; valid: .*run\.mcap:TOPIC:UNIT",
        ),
        ({"dims": 2}, ":antenna/touch", r"arrays have 2 dimensions; a message is one sample"),
    ],
)
def test_what_is_wrong_with_a_bag_is_said(tmp_path, change, address, match):
    with pytest.raises(InvalidInput, match=match):
        load_recording(f"{write(tmp_path / 'run.mcap', **change)}{address}", n_channels=3)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.97])
@pytest.mark.parametrize("compression", ["NONE", "ZSTD", "LZ4"])
def test_of_a_bag_that_was_cut_is_read_what_is_whole(tmp_path, share, compression):
    """Power was lost: chunks that are whole, and of the last what of it is there."""
    path = tmp_path / "run.mcap"
    how = {"chunk_size": 4000, "compression": CompressionType[compression]}
    whole = read_bag(str(write(path, **how)), "joint_states").values
    text = path.read_bytes()
    path.write_bytes(text[: int(share * len(text))])
    read = load_recording(f"{path}:joint_states", n_channels=12)
    n = read.time.size
    assert 0.7 * share * 50 - 4 < n <= 50
    assert any("not closed" in line for line in read.history)
    np.testing.assert_allclose(read.time, whole[:n, 0], atol=1e-9)
    order = np.argsort([int(name[6:]) for name in NAMES])
    np.testing.assert_array_equal(read.values, ANGLE[:n, order].T)


def test_what_holds_no_whole_message_is_refused_and_no_bag_is_no_file(tmp_path):
    path = write(tmp_path / "run.mcap")
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(InvalidInput, match="before its first message was whole"):
        load_recording(f"{path}:joint_states")
    with pytest.raises(InvalidInput, match=r"no such file|No such file"):
        load_recording(tmp_path / "none.mcap:joint_states")


@pytest.mark.parametrize("folder", [True, False])
def test_a_bag_that_was_compressed_as_a_file_is_the_bag(tmp_path, folder):
    """As ``ros2 bag record --compression-mode file`` leaves it."""
    home = tmp_path / "run"
    home.mkdir()
    plain = write(home / "run_0.mcap")
    expected = load_recording(f"{plain}:joint_states", n_channels=12)
    packed = home / "run_0.mcap.zstd"
    packed.write_bytes(zstandard.compress(plain.read_bytes()))
    plain.unlink()
    name = home if folder else packed
    read = load_recording(f"{name}:joint_states", n_channels=12)
    np.testing.assert_array_equal(read.values, expected.values)
    np.testing.assert_array_equal(read.time, expected.time)
    assert "/joint_states" in "".join(describe_bag(str(name)))
    packed.write_bytes(packed.read_bytes()[:-900])
    with pytest.raises(InvalidInput, match=r"run_0\.mcap\.zstd was cut off"):
        load_recording(f"{name}:joint_states", n_channels=12)


def test_joints_are_chosen_by_name_or_pattern_from_several_publishers(tmp_path):
    """An arm and a wheel share the topic, the antenna comes in two halves of one stamp each."""
    half = [f"antenna_{k}" for k in (10, 2, 1)], [f"antenna_{k}" for k in (4, 3)]

    def name(k):
        return [["wheel_1", *half[0]], ["arm"], half[1]][k % 3]

    path, sent = tmp_path / "run.mcap", {}
    with open(path, "wb") as stream, Writer(stream) as bag:
        joint = bag.register_msgdef("sensor_msgs/msg/JointState", JOINT)
        for k in range(60):
            names, at = name(k), SENT + 2_000_000 * (k // 3)
            values = RNG.random(len(names))
            header = {"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}, "frame_id": ""}
            state = {"header": header, "name": names, "position": values.tolist()}
            state |= {"velocity": (10 * values).tolist(), "effort": []}
            bag.write_message("/joint_states", joint, state, at)
            for one, value in zip(names, values, strict=True):
                sent.setdefault(one, []).append(value)
    address = f"{path}:joint_states"
    ordered = [f"antenna_{k}" for k in (1, 2, 3, 4, 10)]
    for joints in (("antenna_*",), ordered, ("antenna_[12]", "antenna_?", "antenna_10")):
        read = load_recording(address, n_channels=5, joints=joints)
        np.testing.assert_array_equal(read.values, [sent[one] for one in ordered])
        np.testing.assert_allclose(read.time, 2.0 * np.arange(20), atol=1e-9)
        np.testing.assert_allclose(read.velocity, 1e-2 * read.values)  # rad/s are 1e-3 rad/ms
        assert read.effort is None and "3 publishers on the topic" in read.history
    turned = load_recording(address, n_channels=2, joints=("antenna_10", "antenna_1"))
    np.testing.assert_array_equal(turned.values, [sent["antenna_10"], sent["antenna_1"]])
    even = repair(read, interval=1.0)
    np.testing.assert_allclose(even.velocity, 1e-2 * even.values, rtol=1e-9)
    with pytest.raises(InvalidInput, match=r"several publishers. Name those .* joints="):
        load_recording(address, n_channels=5)
    with pytest.raises(
        InvalidInput, match="no channel is called 'antena_\\*'; there are wheel_1"
    ):
        load_recording(address, n_channels=5, joints=("antena_*",))


def test_columns_of_a_table_are_chosen_as_joints_are(tmp_path):
    (tmp_path / "plot.csv").write_text(
        "__time,/js/wheel/position,/js/antenna_10/position,/js/antenna_2/position\n"
        + "\n".join(f"{k / 100},{k},{k / 1e3},{k / 1e2}" for k in range(9))
    )
    read = load_recording(
        tmp_path / "plot.csv", n_channels=2, joints=("/js/antenna_*",), unit="rad"
    )
    np.testing.assert_allclose(read.values, np.arange(9) / np.array([[1e2], [1e3]]))


@pytest.mark.parametrize("numbers", [(1, 2, 4), (0, 1, 3)])
def test_an_absent_channel_may_be_missing(tmp_path, numbers):
    rows = [f"{k},{k},{k + 1},{k + 2}" for k in range(9)]
    head = "time_ms," + ",".join(f"ch{number}_deg" for number in numbers)
    (tmp_path / "r.csv").write_text("\n".join([head, *rows]))
    with pytest.raises(InvalidInput, match=r"missing [234].*bad_channels='missing'"):
        load_recording(tmp_path / "r.csv", n_channels=4)
    read = load_recording(tmp_path / "r.csv", n_channels=4, bad_channels="missing")
    assert np.isnan(read.values[2]).all() and "absent, made missing: 3" in read.history
    np.testing.assert_allclose(np.rad2deg(read.values[3]), np.arange(9) + 2)


@pytest.mark.long
def test_the_verbs_take_a_bag(tmp_path):
    def run(*words):
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exit_code == 0, (done.output, done.exception)
        return done.stdout

    path = write(tmp_path / "run.mcap")
    run("convert", f"{path}:antenna/touch", tmp_path / "touch.csv")
    again = load_recording(tmp_path / "touch.csv", n_channels=3)
    np.testing.assert_allclose(again.values, CAPACITANCE.T, rtol=1e-8)
    run("robot", "new", tmp_path / "robot.toml", "--hinges", 12)
    (said,) = json.loads(
        run(
            "robot",
            "check",
            f"{path}:joint_states",
            "--antenna",
            tmp_path / "robot.toml",
            "--json",
        )
    )
    assert said["channels"] == 12 and "read from run.mcap:/joint_states" in said["history"]
    run(
        "robot",
        "convert",
        f"{path}:joint_states",
        "--antenna",
        tmp_path / "robot.toml",
        "--out",
        tmp_path / "set.nc",
    )
    tensors = load(tmp_path / "set.nc")
    np.testing.assert_allclose(tensors["angle"].values[0, 1, ::2], ANGLE[:, 3], rtol=1e-9)
    with pytest.raises(
        InvalidInput, match="becomes tensors with its antenna: feeler robot convert"
    ):
        CliRunner().invoke(
            app,
            ["convert", f"{path}:joint_states", str(tmp_path / "x.nc")],
            catch_exceptions=False,
        )
    with pytest.raises(InvalidInput, match="is a ROS 2 recording"):
        load(path)


def write_rosbag(folder, kind, packed=False):
    """The joint states by the library rosbags; ``packed``: each message compressed by itself."""
    from rosbags.rosbag1 import Writer as Rosbag1
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
    from rosbags.rosbag2 import Writer as Rosbag2
    from rosbags.typesys import Stores, get_typestore

    old = kind == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if old else Stores.ROS2_HUMBLE)
    types = store.types
    head, state = types["std_msgs/msg/Header"], types["sensor_msgs/msg/JointState"]
    path = folder / f"run{kind}"
    how = {"storage_plugin": StoragePlugin.MCAP} if kind == ".mcap" else {}
    made = Rosbag1(path) if old else Rosbag2(folder / "run", version=8, **how)
    if packed:
        made.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with made as bag:
        topic = bag.add_connection("/joint_states", state.__msgtype__, typestore=store)
        text = types["std_msgs/msg/String"]
        other = bag.add_connection("/rosout", text.__msgtype__, typestore=store)
        for k, row in enumerate(ANGLE):
            at = SENT + 2_000_000 * k
            stamp = types["builtin_interfaces/msg/Time"](sec=at // 10**9, nanosec=at % 10**9)
            header = head(stamp=stamp, frame_id="", **({"seq": k} if old else {}))
            empty = np.empty(0)
            message = state(
                header=header, name=NAMES, position=row, velocity=empty, effort=empty
            )
            pack = store.serialize_ros1 if old else store.serialize_cdr
            bag.write(topic, at, pack(message, state.__msgtype__))
        bag.write(other, at, pack(text(data="hello"), text.__msgtype__))
    return path if old else folder / "run"


@pytest.mark.long
@pytest.mark.parametrize("kind", [".bag", ".db3", "folder"])
def test_older_bags_give_the_same_joints_as_mcap(tmp_path, kind):
    path = write_rosbag(tmp_path, kind)
    path = next(path.glob("*.db3")) if kind == ".db3" else path
    mcap = load_recording(f"{write(tmp_path / 'new.mcap')}:joint_states", n_channels=12)
    read = load_recording(path, n_channels=12)
    np.testing.assert_array_equal(read.values, mcap.values)
    np.testing.assert_allclose(read.time, 2.0 * np.arange(50))
    told = describe_bag(str(path))
    assert any(
        "/joint_states (sensor_msgs/msg/JointState), 50 messages" in line for line in told
    )
    assert any(line.startswith("not read    /rosout") for line in told)


@pytest.mark.parametrize("ending", [".db3", ".mcap"])
@pytest.mark.parametrize("folder", [True, False])
def test_messages_compressed_one_by_one_are_those_of_the_plain_bag(tmp_path, ending, folder):
    """As ``ros2 bag record --compression-mode message`` leaves them."""
    path = write_rosbag(tmp_path, ending, packed=True)
    part = next(path.glob(f"*{ending}"))
    assert part.read_bytes().count(b"\x28\xb5\x2f\xfd") >= 50
    read = load_recording(f"{path if folder else part}:joint_states", n_channels=12)
    order = np.argsort([int(name[6:]) for name in NAMES])
    np.testing.assert_array_equal(read.values, ANGLE[:, order].T)
    np.testing.assert_allclose(read.time, 2.0 * np.arange(50))
    if ending == ".mcap":  # power was lost
        part.write_bytes(part.read_bytes()[: part.stat().st_size // 2])
        cut = load_recording(f"{part}:joint_states", n_channels=12)
        np.testing.assert_array_equal(cut.values, read.values[:, : cut.time.size])


@pytest.mark.parametrize("size", [9_000, 40_000])
def test_a_bag_that_was_cut_short_is_refused(tmp_path, size):
    path = next(write_rosbag(tmp_path, ".db3").glob("*.db3"))
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(InvalidInput, match=r"no ROS recording that is whole|damaged"):
        load_recording(path, n_channels=12)
