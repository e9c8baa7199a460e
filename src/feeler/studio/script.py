"""A wish as a Python script: running it gives the same tensor, to the last bit of its float32."""

import re

from feeler.studio.hand import Command
from feeler.studio.touching import SAMPLE_INTERVAL
from feeler.studio.wish import AntennaWish, ObjectWish, TouchWish

_HEAD = '''"""What feeler studio showed: {title}. Needs feeler {version}."""

import hashlib

import numpy as np

import feeler
'''
_TAIL = """
tensor = angle.astype("<f4")  # (sensor, time) [rad], as shown
print(tensor.shape, hashlib.sha256(np.ascontiguousarray(tensor).tobytes()).hexdigest())
"""


def write_script(
    wish: TouchWish, commands: list[Command] | None = None, n_samples: int = 0
) -> str:
    """The text of a script; with ``commands`` that of a run by hand of so many samples."""
    from importlib.metadata import version

    lines = [
        _HEAD.format(title=wish.make_trial().label, version=version("feeler")),
        *_write_antenna(wish.antenna),
    ]
    lines += ["trial = feeler.Trial(", *_write_trial(wish), ")"]
    if commands is not None:
        lines += _write_hand(wish, commands, n_samples)
    elif wish.objects:
        lines += [
            *_write_objects(wish.objects),
            f"simulation = feeler.Simulation(antenna, [trial, *objects]{_step(wish)})",
            "rows = [simulation.angle]",
            f"for _ in range({round(wish.duration / SAMPLE_INTERVAL) - 1}):",
            f"    simulation.step({SAMPLE_INTERVAL})  # ms",
            "    rows.append(simulation.angle)",
            "angle = np.array(rows)[:, antenna.sensors - 1].T",
        ]
    else:
        lines += [
            f"tensors = feeler.touch(antenna, trial, duration={wish.duration!r}{_step(wish)})",
            _read_angle(wish),
        ]
    return "\n".join(lines) + "\n" + _TAIL


def _read_angle(wish: TouchWish) -> str:
    """The line that takes the tensor; in space the sensors of one plane after those of another."""
    if not wish.antenna.make_any().spatial:
        return 'angle = tensors["angle"].values[0]'
    return 'angle = tensors["angle"].values[0].reshape(-1, tensors.sizes["time"])'


def _step(wish: TouchWish) -> str:
    from feeler.physics.contact import get_contact
    from feeler.studio.wish import PREVIEW

    if not wish.preview:
        return ""
    return f", timestep={get_contact(None, wish.antenna.make_any()).scale_timestep(PREVIEW)}"


def _write_antenna(wish: AntennaWish) -> list[str]:
    if wish.toml:
        text = wish.toml.replace("\\", "\\\\")
        text = re.sub(r'"""|"\Z', lambda found: found[0].replace('"', '\\"'), text)
        lines = [
            "from feeler.antenna.parse import parse_antenna",
            "",
            f'antenna = parse_antenna("""\\\n{text}""").antenna',
        ]
    else:
        lines = [f"antenna = feeler.presets.make_preset({wish.preset!r})"]
    changes = []
    for name in ("stiffness", "damping"):
        handles = getattr(wish, name)
        if handles is not None:
            at, values = [list(column) for column in zip(*handles, strict=True)]
            lines += [
                f"# {name}: straight lines of the logarithm between these places",
                "places = np.linspace(0.0, 1.0, antenna.n_segments)",
                f"{name} = np.exp(np.interp(places, {at}, np.log({values})))",
            ]
            changes.append(f"{name}={name}")
    if wish.matched and wish.stiffness is not None:
        lines.append(
            "stiffness *= float(np.sum(1 / stiffness)) / float(np.sum(1 / antenna.stiffness))  #"
            " same compliance"
        )
    if wish.length is not None:
        lines.append(f"factor = {wish.length!r} / antenna.length")
        changes += [
            "segment_length=factor * antenna.segment_length",
            "segment_mass=factor * antenna.segment_mass",
        ]
    if wish.sensors is not None:
        lines.append("from feeler.antenna.antenna import make_even_sensors\n")
        changes.append(f"sensors=make_even_sensors(antenna.n_segments, {wish.sensors})")
    if wish.name:
        changes.append(f"name={wish.name!r}")
    if changes:
        lines += ["antenna = antenna.replace(", *(f"    {change}," for change in changes), ")"]
    return lines


def _write_trial(wish: TouchWish) -> list[str]:
    names = ["location", "speed", "approach", "side", "friction", "lead"]
    names += ["azimuth"] if wish.antenna.make_any().spatial else []
    return [
        f"    feature={_write_shape(wish.kind, wish.size)},",
        *(f"    {n}={getattr(wish, n)!r}," for n in names),
    ]


def _write_shape(kind: str, size: float) -> str:
    return {
        "ball": f"feeler.Ball(radius={size!r})",
        "box": f"feeler.Box(half_width={size!r}, half_height={size!r})",
        "triangle": f"feeler.Triangle(half_width={size!r})",
        "wall": "feeler.Wall()",
    }[kind]


def _write_objects(objects: tuple[ObjectWish, ...]) -> list[str]:
    made = [item.make(number) for number, item in enumerate(objects)]
    return [
        "objects = [",
        *(
            f"    feeler.Object(feature={_write_shape(wish.kind, wish.size)}, place={item.place!r},"
            f" forward={item.forward!r}, velocity={item.velocity!r}, friction={item.friction!r},"
            f" name={item.name!r}),"
            for wish, item in zip(objects, made, strict=True)
        ),
        "]",
    ]


def _write_hand(wish: TouchWish, commands: list[Command], n_samples: int) -> list[str]:
    lines = [
        *_write_objects(wish.objects),
        "# what the hand did: sample, object (-1: the base), velocity x, y, turn",
        "commands = [",
        *(f"    {tuple(command)!r}," for command in commands),
        "]",
    ]
    return [
        *lines,
        f"simulation = feeler.Simulation(antenna, [trial, *objects]{_step(wish)})",
        "rows = [simulation.angle]",
        f"for k in range(1, {n_samples}):",
        "    while commands and commands[0][0] <= k:",
        "        _, what, vx, vy, turn = commands.pop(0)",
        "        if what < 0:",
        "            simulation.move_base((vx, vy), turn)",
        "        else:",
        "            simulation.move_object(what, (vx, vy), turn)",
        f"    simulation.step({SAMPLE_INTERVAL})  # ms",
        "    rows.append(simulation.angle)",
        "angle = np.array(rows)[:, antenna.sensors - 1].T",
    ]
