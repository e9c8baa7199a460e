"""Each row of CONTRIBUTING's table is carried out: the change is made with the files that it names.

What is open from outside is tested beside its room; the table names these tests. The other changes
are made here in a copy of feeler, and a file that the row does not name must stay as it is.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
ROWS = [
    [cell.strip() for cell in line.strip("|").split("|")]
    for line in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines()
    if line.startswith("| ") and not line.startswith("| your change")
]
FILES = {change: re.findall(r"`([\w/{}.*-]+)`", files) for change, files, _ in ROWS}
TESTS = {change: re.findall(r"`([\w/.:]+)`", tests) for change, _, tests in ROWS}


def test_every_row_names_a_test_that_is_there():
    assert len(ROWS) > 15
    for change, named in TESTS.items():
        assert named, f"no test makes this change: {change}"
        for one in named:
            file, _, name = one.partition("::")
            assert f"def {name}(" in (ROOT / "tests" / file).read_text(), f"{change}: {one}"


def test_every_file_that_a_row_names_is_there():
    missing = [
        (change, file)
        for change, files in FILES.items()
        for file in files
        if "/" in file
        and not list((ROOT / "src" / "feeler").glob(file)) + list(ROOT.glob(file))
    ]
    assert not missing


class Copy:
    """A copy of feeler in which a change is made."""

    def __init__(self, folder):
        self.source = folder / "feeler"
        shutil.copytree(
            ROOT / "src" / "feeler", self.source, ignore=shutil.ignore_patterns("__pycache__")
        )
        self.changed = set()

    def write(self, file, text):
        """Add a file, or put another text in its place."""
        (self.source / file).write_text(text, encoding="utf-8")
        self.changed.add(file)

    def replace(self, file, old, new):
        text = (self.source / file).read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{file} holds {old!r} {text.count(old)} times"
        self.write(file, text.replace(old, new))

    def run(self, *lines):
        """What a fresh Python that uses the copy prints of these lines."""
        done = subprocess.run(
            [sys.executable, "-c", "\n".join(lines)],
            env={**os.environ, "PYTHONPATH": str(self.source.parent)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout

    def check(self, change):
        """Nothing was touched but what the row names, by file or by folder."""
        named = [file.partition("{")[0].partition("*")[0] for file in FILES[change]]
        beside = [
            one for one in self.changed if not any(one.startswith(name) for name in named)
        ]
        assert not beside, f"{change}: also needs {beside}"


@pytest.fixture
def copy(tmp_path):
    return Copy(tmp_path)


def test_a_command(copy):
    copy.write(
        "cli/greet.py",
        '"""``feeler greet``: say hello."""\n\nimport typer\n\n\n'
        'def greet() -> None:\n    """Say hello."""\n    typer.echo("hello")\n',
    )
    copy.replace("cli/app.py", '("touch", ', '("touch", "greet", ')
    command = "import sys; sys.argv = ['feeler', 'greet']"
    assert copy.run(command, "from feeler.cli import main; main()") == "hello\n"
    copy.check("a command")


def test_a_preset(copy):
    text = (copy.source / "antenna" / "species" / "cricket.toml").read_text(encoding="utf-8")
    copy.write(
        "antenna/species/mine.toml", text.replace('name = "cricket"', 'name = "mine"', 1)
    )
    said = copy.run("import feeler", "print(feeler.presets.make_preset('mine').n_segments)")
    assert said == "120\n"
    assert "mine" in copy.run("import feeler", "print(*feeler.presets.PRESETS)").split()
    copy.check("a preset")


def test_a_parameter_of_an_antenna(copy):
    """A file keeps it, and an engine computes with it: hinges half as stiff again."""
    copy.replace(
        "antenna/segments.py",
        '    sensors: Annotated[np.ndarray, "sensor?"] = None',
        '    swelling: Annotated[np.ndarray, "segment?", Ge(0)] = 0.0\n'
        '    sensors: Annotated[np.ndarray, "sensor?"] = None',
    )
    copy.replace(
        "antenna/segments.py",
        '_QUANTITIES = ("segment_mass", ',
        '_QUANTITIES = ("swelling", "segment_mass", ',
    )
    copy.replace(
        "antenna/files.py",
        '    "taper": {"1": 1.0},\n',
        '    "taper": {"1": 1.0},\n    "swelling": {"1": 1.0, "%": 0.01},\n',
    )
    copy.replace(
        "antenna/files.py",
        '_OPTIONAL = ("rest_angle", ',
        '_OPTIONAL = ("swelling", "rest_angle", ',
    )
    copy.replace(
        "physics/chain/model.py",
        "        antenna.stiffness,\n",
        "        antenna.stiffness * (1 + antenna.swelling),\n",
    )
    said = copy.run(
        "import feeler",
        "from feeler.antenna.files import write_antenna",
        "from feeler.antenna.files import parse_antenna",
        "from feeler.physics.chain import fields as f",
        "from feeler.physics.chain.model import make_model",
        "from feeler.physics.scene import Scene",
        "plain = feeler.presets.cockroach()",
        "swollen = parse_antenna(write_antenna(plain.replace(swelling=0.5))).antenna",
        "rows = [make_model(Scene(antenna=one)).constants for one in (plain, swollen)]",
        "print(set((rows[1][f.C_STIFFNESS] / rows[0][f.C_STIFFNESS]).round(12)))",
    )
    assert said == "{np.float64(1.5)}\n" or said == "{1.5}\n"
    copy.check("a parameter of an antenna")


RECORDING = "\n".join(["reading;0;30;1;2", "reading;0;31;3;4", "reading;0;32;5;7"])


def test_a_recording_format(copy, tmp_path):
    """A logger's own lines, seconds and milliseconds apart, as ``feeler robot check`` and ``info``
    read them.
    """
    (tmp_path / "run.own").write_text(RECORDING)
    copy.replace(
        "robot/recordings.py",
        "read_table(path, words=True) if bag is None",
        "_read_own(path) if str(path).endswith('.own') else"
        " read_table(path, words=True) if bag is None",
    )
    text = (copy.source / "robot" / "recording.py").read_text(encoding="utf-8")
    own = (
        "\n\ndef _read_own(path):\n"
        "    rows = [line.split(';')[1:] for line in open(path).read().splitlines()]\n"
        "    lines = [f'{1e3 * int(s) + int(ms)},{a},{b}' for s, ms, a, b in rows]\n"
        "    from feeler.tensors.table import parse_table\n"
        "    return parse_table('\\n'.join(['time_ms,hinge1_deg,hinge2_deg', *lines]),"
        " source=str(path))\n"
    )
    copy.write("robot/recordings.py", text + own)
    copy.replace(
        "robot/recordings.py",
        "find_bag(path) is not None or",
        "path.suffix == '.own' or find_bag(path) is not None or",
    )
    said = copy.run(
        "import numpy as np",
        "from feeler.robot.recordings import ROBOT_FILES",
        "from feeler.robot.recordings import load_recording",
        "from feeler.tensors.formats import find_formats",
        f"path = {str(tmp_path / 'run.own')!r}",
        "print(np.degrees(load_recording(path, n_channels=2).values).round(9).tolist())",
        "print(next(iter(find_formats(path, ROBOT_FILES))))",
    )
    assert said == "[[1.0, 3.0, 5.0], [2.0, 4.0, 7.0]]\nrecording\n"
    copy.check("a recording format of a robot")


CLAIM = """
[[claim]]
id = "half"
where = "nowhere"
says = "Half of the segments are seventy"
paper = "70"
tag = "C"
kind = "value"
section = "antenna"
drawn = "nothing"
figure = "fig2c_antenna"
keys = ["antenna.half"]
target = 70.0
tolerance = 0.0
"""
JUDGE = (
    "import tempfile",
    "from pathlib import Path",
    "from feeler.report.page import Section",
    "from feeler.studies.paper import fig2a",
    "from feeler.studies.paper.context import Context",
    "from feeler.studies.paper.verdicts import judge_claims",
    "out = Path(tempfile.mkdtemp())",
    "context = Context(scale='smoke', out=out)",
    "section = Section(name='antenna', title='', folder=out, vector=False)",
    "fig2a.show(context, section)",
    "found = {one.claim.id: one for one in judge_claims([section], context)}",
)


@pytest.mark.parametrize(
    ("file", "change"),
    [
        ("claims.toml", "a claim of the paper"),
        pytest.param("own_claims.toml", "a claim of our own", marks=pytest.mark.long),
    ],
)
def test_a_claim(copy, file, change):
    old = (copy.source / "studies" / "paper" / file).read_text(encoding="utf-8")
    copy.write(f"studies/paper/{file}", old + CLAIM)
    copy.replace(
        "studies/paper/fig2a.py",
        '"antenna.n_segments": antenna.n_segments,',
        '"antenna.n_segments": antenna.n_segments,\n'
        '        "antenna.half": antenna.n_segments / 2,',
    )
    said = copy.run(*JUDGE, "print(found['half'].verdict)")
    assert said.strip() in ("reproduced", "holds")
    copy.check(change)


PANEL = """// @ts-check
import { make, makePanel } from "./dom.js";
/** @typedef {import("./studio.js").App} App */
/** A panel of somebody else: how many sensors feel. */

/** @param {App} app @returns {import("./panels.js").Panel} */
export function makeCountPanel(app) {
  const words = make("p", { class: "count-of-sensors" });
  const update = () => { words.textContent = `${app.records.A.index.length} sensors`; };
  const element = makePanel("Count", "count-panel", words);
  return { element, place: "right", isShown: () => true, update };
}
"""


NOTEBOOK = """
const heard = [], read = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
render({ model: { on: (name, f) => heard.push(f), off() {}, send() {} }, el: document.body });
window.tell = text => heard.forEach(f => f({}, [new DataView(read(text))]));
</script>"""


def test_a_panel_of_the_studio(copy, browser, tmp_path):
    copy.write("studio/page/count.js", PANEL)
    copy.replace(
        "studio/page/panels.js",
        "import { makeAntennaPanel, ",
        'import { makeCountPanel } from "./count.js";\nimport { makeAntennaPanel, ',
    )
    copy.replace(
        "studio/page/panels.js", "  makeSetPanel,\n", "  makeSetPanel,\n  makeCountPanel,\n"
    )
    page = tmp_path / "page.html"
    begin = "'type': 'touch', 'slot': 'A', 'id': 0, 'part': 'begin', 'total': 20"
    said = copy.run(
        "from base64 import b64encode",
        "from pathlib import Path",
        "from feeler.studio.export import write_module",
        "from feeler.studio.session import pack",
        "from feeler.studio.server import FILES",
        "from feeler.studio.requests import describe_scene",
        "from feeler.studio.requests import AntennaWish, TouchWish",
        "assert 'count.js' in FILES",
        "text = '<body><script type=module>' + write_module().replace('export default', '')",
        f"Path({str(page)!r}).write_text(text + {NOTEBOOK!r}, encoding='utf-8')",
        "wish = TouchWish(antenna=AntennaWish(sensors=17))",
        f"print(b64encode(pack({{{begin}, **describe_scene(wish)}})).decode())",
    )
    browser.get(page.as_uri())
    assert _wait(lambda: browser.execute_script("return Boolean(window.tell)"))
    browser.execute_script("tell(arguments[0])", said.strip())
    shown = "return (document.querySelector('.count-of-sensors') || {}).textContent"
    assert _wait(lambda: browser.execute_script(shown) == "17 sensors")
    copy.check("a panel of the studio")


def _wait(look, seconds=20.0):
    import time

    end = time.monotonic() + seconds
    while not (found := look()) and time.monotonic() < end:
        time.sleep(0.05)
    return found


def test_a_policy():
    from feeler.active import parse_policy
    from feeler.active.policies import POLICIES

    @POLICIES.register("as-told")
    def make_as_told(speed):
        return lambda known: speed

    try:
        assert parse_policy("as-told:0.2")(None) == 0.2
    finally:
        POLICIES.unregister("as-told")


TASK = """
from dataclasses import dataclass
from feeler.active.tasks import TouchTask


@dataclass(frozen=True, eq=False)
class HalfTask(TouchTask):
    \"\"\"Touches of half as long.\"\"\"

    duration: float = 50.0
"""


def test_an_environment(copy):
    copy.write("active/half.py", TASK)
    copy.replace(
        "active/environment.py",
        '    "feeler/Touch-v0": TouchTask,\n',
        '    "feeler/Touch-v0": TouchTask,\n    "feeler/Half-v0": HalfTask,\n',
    )
    copy.replace(
        "active/environment.py",
        "TASKS: dict",
        "from feeler.active.half import HalfTask\n\nTASKS: dict",
    )
    said = copy.run(
        "import gymnasium, feeler.active.environment",
        "env = gymnasium.make('feeler/Half-v0', pool=4)",
        "env.reset(seed=0)",
        "action = env.action_space.sample()",
        "steps = 0",
        "over = False",
        "while not over:",
        "    *_, ended, cut, _ = env.step(action)",
        "    over = ended or cut",
        "    steps += 1",
        "print(steps)",
    )
    assert said == "50\n"
    copy.check("an environment")
