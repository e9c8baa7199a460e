"""What the authors give turns "cannot be compared" into verdicts."""

import pytest

from feeler.errors import InvalidInput
from feeler.files import read_shipped
from feeler.robot.classify import draw_robots, touch_robots
from feeler.robot.recordings import save_recording
from paper.context import Context
from paper.inputs import make_section, read_inputs
from paper.statements import NEVER, NOT, OWN_WORDS, judge_statements, load_statements

TABLE = {"frequency": 17.494, "damping_ratio": 0.5402, "ratio_71": 0.2212, "ratio_86": 0.5517}


def judge_inputs(tmp_path, text):
    (path := tmp_path / "inputs.toml").write_text(text)
    context = Context(out=tmp_path, inputs=path)
    section = make_section(path, context)
    judged = {one.statement.id: one for one in judge_statements([section], context)}
    return section.values, judged


def write_table(**changes):
    rows = "\n".join(f"{name} = {value}" for name, value in (TABLE | changes).items())
    return f"[table_1]\n{rows}\n"


def test_the_model_meets_a_table_that_it_makes_and_no_other(tmp_path):
    values, judged = judge_inputs(tmp_path, write_table())
    assert [values[f"inputs.{name}"] for name in TABLE] == pytest.approx([1] * 4, rel=1e-3)
    assert values["inputs.cost"] < 1e-3
    assert judged["frequency"].verdict == judged["ratio-86"].verdict == OWN_WORDS
    assert judged["error"].verdict == NOT  # the paper's 0.067 is far more
    assert judged["sigmoid"].verdict == NEVER  # nothing is given
    values, judged = judge_inputs(tmp_path, write_table(frequency=25.0))
    assert values["inputs.frequency"] == pytest.approx(17.494 / 25, rel=1e-3)
    assert judged["frequency"].verdict == NOT and judged["damping"].verdict == OWN_WORDS


def test_a_part_of_the_table_decides_a_part(tmp_path):
    values, judged = judge_inputs(tmp_path, "[table_1]\ndamping_ratio = 0.9\n")
    assert {*values} == {"inputs.damping_ratio"}
    assert judged["damping"].verdict == NOT
    assert judged["frequency"].verdict == judged["error"].verdict == NEVER


def test_lengths_and_speeds_are_used(tmp_path):
    rows = [[0.1 + 0.01 * k * (1 + 0.1 * n) for k in range(20)] for n in range(4)]
    text = f"[segments]\nlengths = {rows}\n[exploration]\nangular_speed = [80.0, 93.3]\n"
    values, judged = judge_inputs(tmp_path, text)
    assert values["inputs.explore"] == pytest.approx(86.65)
    assert judged["explore-speed"].verdict == OWN_WORDS and judged["sigmoid"].verdict != NEVER


@pytest.mark.long
def test_contacts_of_a_robot_like_its_model_are_classified(tmp_path):
    read = touch_robots(draw_robots(0.0, 1, 0), 1)[0]
    rows = []
    for number, (recording, label) in enumerate(zip(read.recordings, read.labels, strict=True)):
        save_recording(recording, tmp_path / f"{number}.csv")
        feature, location, speed = label
        rows.append(
            f'{{file = "{number}.csv", feature = "{feature}", location = {location},'
            f" speed = {speed}}}"
        )
    values, judged = judge_inputs(tmp_path, f"[robot]\ncontacts = [{', '.join(rows)}]\n")
    found = values["inputs.transfer"]
    assert found["n"] == len(rows) and 0.5 < found["value"] <= 1.0
    assert found["low"] < found["value"] <= found["high"] + 1e-9
    assert judged["robot-transfer"].verdict in (OWN_WORDS, NOT, NEVER)
    assert "inputs" not in judged["robot-transfer"].why


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[table_2]\nx = 1\n", r"has no input \[table_2\]; there are: \[table_1\]"),
        ("[table_1]\nf = 1\n", r"has no input \[table_1\] f"),
    ],
)
def test_a_misspelt_input_is_refused(tmp_path, text, message):
    (path := tmp_path / "inputs.toml").write_text(text)
    with pytest.raises(InvalidInput, match=message):
        read_inputs(path)
    with pytest.raises(InvalidInput, match="there is no file"):
        read_inputs(tmp_path / "none.toml")
    with pytest.raises(InvalidInput, match=r"contact 1 of \[robot\] needs feature, file"):
        judge_inputs(tmp_path, '[robot]\ncontacts = [{file = "x.csv"}]\n')


def test_the_template_is_read_and_asks_nothing_by_itself():
    assert not any(read_shipped("paper", "inputs.toml").values())
    given = [one for one in load_statements() if one.given]
    assert len(given) >= 8 and all(one.why for one in given)
    assert all(one.judge_given().list_sentences() for one in given)
