"""What is shown, exported: picture, movie, Python script, or a page that computes independently."""

import base64
import io
import json
import re
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from importlib.metadata import metadata, version
from importlib.resources import files
from threading import Event
from typing import Annotated, Any, NamedTuple

import numpy as np
from jinja2 import Environment, StrictUndefined

from feeler.antenna.animals import match_damping
from feeler.antenna.files import write_antenna
from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.execute.workers import ThreadExecutor, hold_blas
from feeler.files import temporary_folder
from feeler.objects.bodies import Object
from feeler.objects.shapes import Feature
from feeler.objects.trials import SPEEDS, Trial
from feeler.physics.chain import fields as f
from feeler.physics.chain.model import make_model, stack_shapes
from feeler.physics.contact import get_contact
from feeler.physics.scene import Scene
from feeler.records import Ge
from feeler.studio import study
from feeler.studio.live import LONGEST, Command, read_commands, replay
from feeler.studio.requests import (
    PREVIEW,
    SAMPLE_INTERVAL,
    AntennaRequest,
    TouchRequest,
    count_samples,
    describe_antenna,
    draw_feature,
    make_shape,
    read_number,
    simulate_pieces,
)
from feeler.studio.study import ANSWERS, NOISE, UNSURE, train
from feeler.validation import checked

# One front end for three hosts: its modules as they are, as one module, and as one page with
# the engine in it.

PAGE = files("feeler.studio").joinpath("page")
_ENTRY = "studio.js"
SPACE_SCRIPT = "turn.js"
"""How a touch in space is drawn: the report's file, up to what starts its own views."""
_IMPORT = re.compile(r'^import\s[^;]*?from\s+"\./([\w-]+\.js)";\n', re.M)
_EXPORT = re.compile(r"^export (\{.*\n|(?=(async function|function|const|class|let)\b))", re.M)
_REMARK = re.compile(r"^ *(/\*\*((?!\*/)[\s\S])*\*/|// .*)\n", re.M)
_INDENT = re.compile(r"^ +", re.M)
_ICON = re.compile(r'rel="icon" href="([^"]*)"')
_CSP = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
    " blob:; worker-src blob:"
)
_SHELL = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, \
initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{csp}">
<link rel="icon" href="{icon}">
<meta name="description" content="An insect's antenna, computed while you touch it">
<meta property="og:title" content="feeler: drag this ball">
<title>feeler: drag this ball</title><style>{css}</style></head>
<body><main id="studio"></main><noscript>This page computes touches with JavaScript, which this \
browser does not run.</noscript><script type="application/json" id="config">{config}</script>
<script type="text/plain" id="engine">{engine}</script>
<script type="module">{script}
startAlone(document.getElementById("studio"));
</script></body></html>
"""


def read_page(name: str) -> str:
    """One file of the front end."""
    if name != SPACE_SCRIPT:
        return PAGE.joinpath(name).read_text(encoding="utf-8")
    text = files("feeler").joinpath("report", name).read_text(encoding="utf-8")
    return text[: text.index("const startTurnable")] + "export { drawScene };\n"


@lru_cache(maxsize=4)
def _bundle(entry: str = _ENTRY) -> str:
    """A module and all that it imports as one: each stands before those that import it, ``import``
    lines, ``export`` words, remarks and most of the indents taken out.

    So no module may rename what it imports, and no two may use one name at their top level.
    """
    done: dict[str, str] = {}
    _add(entry, done)
    return "\n".join(done.values())


def _add(name: str, done: dict[str, str]) -> None:
    text = read_page(name)
    for needed in _IMPORT.findall(text):
        if needed not in done:
            _add(needed, done)
    done[name] = _INDENT.sub(" ", _REMARK.sub("", _EXPORT.sub("", _IMPORT.sub("", text))))


def write_module() -> str:
    """The module that a notebook loads: it hands out ``render``."""
    return _bundle() + "\nexport default { render };\n"


# A wish as a Python script: running it gives the same tensor, to the last bit of its float32.

_SHAPES = {
    "ball": "feeler.Ball(radius={0!r})",
    "box": "feeler.Box(half_width={0!r}, half_height={0!r})",
    "triangle": "feeler.Triangle(half_width={0!r})",
    "wall": "feeler.Wall()",
}


def _write_script(
    wish: TouchRequest, commands: list[Command] | None = None, n_samples: int = 0
) -> str:
    """The text of a script; with ``commands`` that of a run by hand of so many samples."""
    asked, antenna = wish.antenna, wish.antenna.make_any()
    text = asked.toml.replace("\\", "\\\\")
    step = f", timestep={get_contact(None, antenna).scale_timestep(PREVIEW)}"
    changed = [name for name in ("stiffness", "damping") if getattr(asked, name) is not None]
    found = Environment(trim_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined)
    found.filters["repr"] = repr
    script = files("feeler.studio").joinpath("script.jinja").read_text(encoding="utf-8")
    return found.from_string(script).render(
        title=wish.make_trial().label,
        version=version("feeler"),
        wish=wish,
        antenna=asked,
        spatial=antenna.spatial,
        toml=re.sub(r'"""|"\Z', lambda found: found[0].replace('"', '\\"'), text),
        handles=[
            (name, *map(list, zip(*getattr(asked, name), strict=True))) for name in changed
        ],
        shape=lambda kind, size: _SHAPES[kind].format(size),
        objects=[(item, item.make(number)) for number, item in enumerate(wish.objects)],
        commands=None if commands is None else [tuple(command) for command in commands],
        n_samples=count_samples(wish) if commands is None else n_samples,
        interval=SAMPLE_INTERVAL,
        step=step if wish.preview else "",
    )


# What a page shows, as a picture and as a movie: its quantity, all of its objects, and a run by
# hand too.

_LABELS = {"angle": "hinge angle [°]", "curvature": "curvature [1/mm]"}
_FPS = 30
_MARGIN = 2.0  # mm around whatever moves


class _PageView(NamedTuple):
    """A touch, or a run by hand, from its first to its last sample."""

    antenna: Antenna
    features: list[Feature]
    readings: dict[str, np.ndarray]  # as feeler.studio.requests.join_samples gives them
    values: np.ndarray  # (segment, sample)
    label: str
    title: str

    @property
    def tensor(self) -> np.ndarray:
        """What the sensors say (sensor, sample)."""
        return self.values[self.antenna.sensors - 1]

    @property
    def side(self) -> float:
        """−1 where the sensors bend most the other way than in a touch from the left, else 1."""
        return -1.0 if -self.tensor.min() > self.tensor.max() else 1.0

    @property
    def time(self) -> np.ndarray:
        """ms."""
        return SAMPLE_INTERVAL * np.arange(self.values.shape[1])


def read_shown(
    wish: TouchRequest, readings: dict[str, np.ndarray], quantity: str, *, by_hand: bool
) -> _PageView:
    """What the page shows of these readings."""
    antenna, objects = wish.antenna.make(), wish.make_objects()
    angle = readings["angle"].T
    curved = quantity == "curvature"
    values = angle / antenna.segment_length[:, None] if curved else np.rad2deg(angle)
    what = f"{wish.kind} moved by hand" if by_hand else wish.make_trial().label
    more = f", and {len(objects) - 1} more" if len(objects) > 1 else ""
    return _PageView(
        antenna=antenna,
        features=[item.shape if isinstance(item, Trial) else item.feature for item in objects],
        readings=readings,
        values=values,
        label=_LABELS["curvature" if curved else "angle"],
        title=f"{antenna.name}: {what}{more}",
    )


def draw(shown: _PageView, kind: str) -> bytes:
    """The tensor as a picture, ``svg`` or ``png``."""
    from matplotlib.figure import Figure

    from feeler.plotting.style import style

    with style():
        figure = Figure(figsize=(4.5, 3.2), layout="constrained")
        _draw_tensor(shown, figure, figure.subplots())
        figure.axes[0].set_title(shown.title, fontsize=8)
        out = io.BytesIO()
        figure.savefig(out, format=kind)
    return out.getvalue()


def _draw_tensor(shown: _PageView, figure: Any, ax: Any) -> Any:
    from feeler.plotting import plot_tensor
    from feeler.plotting.tensors import choose_scale, name_scale

    facing = shown.side * shown.tensor
    norm, colours = choose_scale(facing)
    image = plot_tensor(facing, shown.time, ax, norm, colours=colours)
    label = f"−{shown.label}, as of a touch from the left" if shown.side < 0 else shown.label
    figure.colorbar(image, ax=ax, label=name_scale(label, norm))
    return image


def film(shown: _PageView) -> bytes:
    """The antenna as from above, base left, beside its tensor, which grows; slowed down."""
    from matplotlib.figure import Figure
    from matplotlib.transforms import Affine2D

    from feeler.plotting.antennas import (
        MovingAntenna,
        choose_frames,
        make_patch,
        say_clock,
        write_movie,
    )
    from feeler.plotting.style import style

    base, place = shown.readings["base"], shown.readings["place"]
    points = shown.antenna.shape(shown.readings["angle"], base[:, 2:]) + base[:, None, :2]
    frames = choose_frames(shown.time, fps=_FPS)
    with style():
        figure = Figure(figsize=(10.0, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.2, 1))
        image = _draw_tensor(shown, figure, right)
        clock = right.set_title(say_clock(0.0))
        left.set_title(shown.title, fontsize=8)
        along, across = points[..., 1], -points[..., 0]
        reach = 0.25 * (along.max() - along.min())  # room of the objects before they touch
        left.set(
            xlim=(along.min() - _MARGIN, along.max() + _MARGIN),
            ylim=(across.min() - reach, across.max() + reach),
            aspect="equal",
            xlabel="along [mm]",
            ylabel="across [mm]",
        )
        turned = Affine2D().rotate_deg(-90) + left.transData
        antenna = MovingAntenna(shown.antenna, left, image.norm, image.cmap.name)
        patches: list[Any] = []

        def move(frame: int) -> list[Any]:
            now = frames[frame]
            while patches:
                patches.pop().remove()
            for feature, (x, y, turn) in zip(shown.features, place[now], strict=True):
                forward = np.array([np.sin(turn), np.cos(turn)])
                patch = make_patch(feature, np.array([x, y]), forward)
                patch.set_transform(turned)
                patches.append(left.add_patch(patch))
            image.set_data(
                np.where(shown.time <= shown.time[now], shown.side * shown.tensor, np.nan)
            )
            clock.set_text(say_clock(shown.time[now]))
            seen = points[now, :, ::-1] * (1, -1)
            return [
                image,
                clock,
                *patches,
                *antenna.move(seen, shown.side * shown.values[:, now]),
            ]

        with temporary_folder() as folder:
            return write_movie(
                folder / "touch.mp4", figure, move, len(frames), _FPS
            ).read_bytes()


# A standalone page: one file of HTML with the engine in it, which asks no server
# and no other host for anything.

_PAPER = (
    "Meng, McDonnell, Jayaram & Mongeau 2025, Physically intelligent soft antennae enhance tactile"
    " perception by active touch"
)
_DOI = "https://doi.org/10.1101/2025.10.20.683587"
_NAME_LENGTH = 40  # letters of an antenna's name on a switch
_NEARLY_LEVEL = (
    1.05  # [C] stiffest over softest hinge, up to which an antenna counts as uniform
)
# [C] of what a decoder was trained on, in rad; the finest with which a page stays small
_STEPS = (0.008, 0.016)
_LARGEST = 480_000  # characters
_Choice = tuple[str, AntennaRequest]
"""An antenna that a page offers: its name and what it is."""
_KINDS = {f.KIND_BALL: "ball", f.KIND_BOX: "box", f.KIND_POLYGON: "polygon"}


@checked
def write_touch_page(
    wish: TouchRequest | None = None,
    other: AntennaRequest | None = None,
    *,
    unsure: Annotated[float, Ge(0)] = UNSURE,
    commands: Sequence[Command] | None = None,
    samples: int = 0,
) -> str:
    """The page that computes touches in a browser, as text of HTML.

    It holds two antennas, ``slow`` and ``fast``, ball, box and triangle, and a decoder for each
    antenna and speed, trained on touches at random locations and of random sizes.

    Parameters
    ----------
    wish
        What it shows first; default: a ball of 1.5 mm meets the cockroach's antenna slowly.
    other
        The second antenna; default: the first one with uniform hinges, or the cockroach's
        where the first is so already.
    unsure
        How well the decoder knows the speed, as a share of it.
    commands, samples
        A run by hand to be shown first, and its length.
    """
    wish = TouchRequest() if wish is None else wish.replace(preview=False)
    choices = _choose(wish.antenna, other)
    speeds = sorted({SPEEDS["slow"], wish.speed, SPEEDS["fast"]})
    names = {value: name for name, value in SPEEDS.items()}
    state = {
        "mode": "touch" if commands is None else "hand",
        "A": wish.antenna.to_plain(),
        "B": None,
        "touch": {k: v for k, v in wish.to_plain().items() if k not in ("antenna", "preview")},
        "unsure": unsure,
    }
    urls = metadata("feeler").get_all("Project-URL") or ()
    homes = dict(item.split(", ", 1) for item in urls)
    config = {
        "version": version("feeler"),
        "state": state,
        "contact": _pack_contact(),
        "antennas": [_pack(*choice) for choice in choices],
        "speeds": [{"name": names.get(v, f"{v:g} m/s"), "value": v} for v in speeds],
        "shapes": _pack_shapes(wish.antenna.make()),
        "commands": None if commands is None else list(commands),
        "samples": samples,
        "paper": _PAPER,
        "doi": _DOI,
        "home": homes.get("Repository") or homes.get("Homepage") or "",
    }
    # the engine is text that a worker runs, or the page itself where workers are not allowed
    parts = {"script": _bundle("alone.js"), "engine": _bundle("worker.js")}
    code = {name: text.replace("</", "<\\/") for name, text in parts.items()}
    icon = _ICON.findall(read_page("index.html"))[0]
    for step in _STEPS:
        config["taught"] = _teach_all(choices, speeds, unsure, step)
        data = json.dumps(config, allow_nan=False).replace("<", "\\u003c")
        page = _SHELL.format(
            csp=_CSP, icon=icon, css=read_page("studio.css"), config=data, **code
        )
        if len(page) <= _LARGEST:
            break
    return page


def _choose(first: AntennaRequest, other: AntennaRequest | None) -> list[_Choice]:
    """The two antennas of a page."""
    antenna = first.make()
    if other is not None:
        return [
            (f"A: {antenna.name}"[:_NAME_LENGTH], first),
            (f"B: {other.make().name}"[:_NAME_LENGTH], other),
        ]
    if np.max(antenna.stiffness) <= _NEARLY_LEVEL * np.min(antenna.stiffness):
        return [("graded", AntennaRequest()), ("uniform", first)]
    level = (
        AntennaRequest(preset="matched")
        if first == AntennaRequest()
        else _level(first, antenna)
    )
    return [("graded", first), ("uniform", level)]


def _level(wish: AntennaRequest, antenna: Antenna) -> AntennaRequest:
    """The same antenna with equal hinges: of the same total compliance, and of the same damping
    ratio of the first mode.
    """
    even = np.full(antenna.n_segments, antenna.n_segments / np.sum(1 / antenna.stiffness))
    damping = float(match_damping(antenna.replace(stiffness=even), antenna).damping[0])
    stiffness = float(even[0])
    return wish.replace(
        stiffness=((0.0, stiffness), (1.0, stiffness)),
        damping=((0.0, damping), (1.0, damping)),
        matched=False,
        name=f"{antenna.name[:70]}, uniform",
    )


def _pack(name: str, wish: AntennaRequest) -> dict[str, Any]:
    antenna = wish.make()
    return {
        "name": name,
        "wish": wish.to_plain(),
        "constants": _pack_antenna(antenna),
        "finer": round(1 / get_contact(None, antenna).scale_timestep(1.0)),
        "drawn": describe_antenna(antenna),
    }


def _pack_shapes(antenna: Antenna) -> dict[str, Any]:
    """Every kind of shape at a half-width of 1 mm, from which the page makes the others."""
    found = {}
    for kind in ("ball", "box", "triangle", "wall"):
        feature = make_shape(kind, 1.0)
        found[kind] = {**_pack_shape(feature, antenna), "rims": draw_feature(feature)}
    return found


def _teach_all(
    choices: Sequence[_Choice], speeds: Sequence[float], unsure: float, step: float
) -> dict[str, Any]:
    """The decoders of a page (antenna, speed), and what they answer."""
    wishes = [wish for _, wish in choices for _ in speeds]
    keep = partial(_keep, unsure=unsure, step=step)
    with hold_blas(), ThreadExecutor() as pool:
        kept = list(pool.map(keep, wishes, [*speeds] * len(choices)))
    n = len(speeds)
    return {
        "answers": ANSWERS,
        "noise": NOISE,
        "kept": [kept[k : k + n] for k in range(0, len(kept), n)],
    }


@lru_cache(maxsize=24)
def _keep(
    wish: AntennaRequest, speed: float, unsure: float, step: float
) -> dict[str, Any] | None:
    """A decoder as the page reads it; None where this antenna's touches teach nothing."""
    antenna = wish.make()
    try:
        decoder, trained, scores = train(
            antenna, speed, lambda doing, share: None, Event(), unsure, step
        )
    except (InvalidInput, SimulationDivergedError):
        return None
    most = np.abs(decoder.templates_).max(axis=(0, 2))
    return {
        **decoder.to_plain(),
        "peak": float(most.max()),
        "curvature": float((most / antenna.segment_length[antenna.sensors - 1]).max()),
        "range": trained.to_plain(),
        "scores": scores,
    }


def _pack_antenna(antenna: Antenna) -> str:
    """The engine's constants (field, segment) of an antenna, to the last bit, as base64."""
    constants = make_model(Scene(antenna=antenna, contact=get_contact(None, antenna))).constants
    return base64.b64encode(constants.astype("<f8").tobytes()).decode()


def _pack_contact() -> dict[str, float]:
    """What of the default contact does not depend on the antenna."""
    contact = get_contact()
    least, _, _, midpoint, power = contact.solimp
    rates = {"lingering": contact.lingering, "crossing": contact.crossing}
    return {"least": least, "midpoint": midpoint, "power": power, **rates}


def _pack_shape(feature: Feature, antenna: Antenna) -> dict[str, Any]:
    """A feature as the engine's search for contacts sees it: convex parts, half planes, rounding.

    ``antenna`` is any antenna: a scene has one.
    """
    model = make_model(Scene(antenna=antenna, objects=(Object(feature=feature),)))
    kinds, corners, starts, bounds, _, _ = (table[0] for table in stack_shapes([model]))
    parts = [
        {
            "kind": _KINDS[int(kinds[k])],
            "corners": corners[starts[k] : starts[k + 1]].ravel().tolist(),
            "box": bounds[k].tolist(),
        }
        for k in range(len(model.parts))
    ]
    planes = model.obj[0, f.O_PLANES :].reshape(f.N_PLANES, 3)
    rounding, unbounded = float(feature.rounding), bool(feature.unbounded)
    return {
        "parts": parts,
        "planes": np.asarray(planes).tolist(),
        "rounding": rounding,
        "unbounded": unbounded,
    }


# Whatever is shown can leave: as antenna file, Python script, picture, movie or a page that
# computes by itself.


def make_file(message: dict[str, Any]) -> tuple[str, str, bytes]:
    """Name, kind and content of what the page asks to be saved: ``what`` is toml, script, svg, png,
    mp4 or html.
    """
    wish = TouchRequest.from_plain(message.get("wish"))
    commands = read_commands(message["commands"]) if message.get("commands") else None
    samples = int(
        read_number(message.get("samples", count_samples(wish)), "samples", 2, LONGEST)
    )
    unsure = read_number(message.get("unsure", study.UNSURE), "unsure", 0.0, 0.5)
    what, quantity = message.get("what"), str(message.get("quantity", "angle"))
    asked = message.get("other")
    other = None if asked is None else TouchRequest.from_plain(asked).antenna

    def shown() -> _PageView:
        readings = _read_whole(wish, commands, samples)
        return read_shown(wish, readings, quantity, by_hand=commands is not None)

    makers: dict[str, tuple[str, Callable[[], bytes]]] = {
        "toml": ("application/toml", lambda: write_antenna(wish.antenna.make_any()).encode()),
        "script": ("text/x-python", lambda: _write_script(wish, commands, samples).encode()),
        "svg": ("image/svg+xml", lambda: draw(shown(), "svg")),
        "png": ("image/png", lambda: draw(shown(), "png")),
        "mp4": ("video/mp4", lambda: film(shown())),
        "html": (
            "text/html",
            lambda: write_touch_page(
                wish, other, unsure=unsure, commands=commands, samples=samples
            ).encode(),
        ),
    }
    if not isinstance(what, str) or what not in makers:
        raise InvalidInput(f"what must be one of {', '.join(makers)}, got {str(what)[:40]!r}.")
    mime, make = makers[what]
    stem = "antenna" if what == "toml" else "touch"
    return f"feeler-{stem}.{'py' if what == 'script' else what}", mime, make()


def _read_whole(
    wish: TouchRequest, commands: list | None, samples: int
) -> dict[str, np.ndarray]:
    """The readings of a touch, or of a run by hand, from its first to its last sample."""
    if commands is not None:
        return replay(wish, commands, samples)
    pieces = [readings for _, readings in simulate_pieces(wish, Event())]
    return {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
