"""A session: what one open page is shown; messages in, messages out, the newest request first."""

import json
import logging
import struct
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError
from functools import partial
from threading import Event, Lock, Thread, current_thread
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna
from feeler.errors import FeelerError, InvalidInput, SimulationDivergedError
from feeler.experiments.tactile import touch
from feeler.physics.contact import get_contact
from feeler.plotting.antennas import describe_turnable
from feeler.studio import study
from feeler.studio.export import make_file
from feeler.studio.live import Boards, Hand, listen, open_calibration, open_text, read_file
from feeler.studio.requests import (
    PREVIEW,
    AntennaRequest,
    TouchRequest,
    count_samples,
    describe_antenna,
    describe_mode,
    describe_scene,
    hash_tensor,
    make_catalogue,
    read_number,
    simulate_pieces,
)
from feeler.studio.study import ANSWERS, OUTSIDE, AntennaStudy
from feeler.validation import checked

# Messages between page and server: the page sends JSON, the server answers a JSON header and
# float32 numbers.
#
# A packed message is four bytes (length of the header, little-endian), the header as JSON
# padded with blanks to a multiple of four, and after it the arrays one after the other;
# ``arrays`` in the header lists their names and shapes.

MAX_MESSAGE = 8 * 2**20  # [C] of one message from the page: a recording dropped on it


def pack(header: Mapping[str, Any], **arrays: np.ndarray) -> bytes:
    """One message as bytes."""
    numbers = {
        name: np.ascontiguousarray(values, dtype="<f4") for name, values in arrays.items()
    }
    plan = [[name, list(values.shape)] for name, values in numbers.items()]
    text = json.dumps({**header, "arrays": plan}, ensure_ascii=True, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join(
        [struct.pack("<I", len(text)), text, *(values.tobytes() for values in numbers.values())]
    )


def _read_message(text: str | bytes) -> dict[str, Any]:
    """A message of the page.

    Raises
    ------
    InvalidInput
        No JSON object with a ``type``, or too long.
    """
    if len(text) > MAX_MESSAGE:
        raise InvalidInput(
            f"a message may have at most {MAX_MESSAGE:,} bytes, got {len(text):,}."
        )
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"a message must be JSON ({str(error)[:80]}).") from None
    if not isinstance(content, dict) or not isinstance(content.get("type"), str):
        raise InvalidInput("a message must be a JSON object with a type.")
    return content


# A desk: work of several kinds at once, and of each kind only what was wished for last.

_Work = Callable[[Event], None]


class Desk:
    """One thread per kind of work at most; new work of a kind stops the older, begins when it has
    ended, and takes the place of what has not begun.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._now: dict[str, tuple[Event, Thread]] = {}
        self._next: dict[str, _Work] = {}

    def give(self, kind: str, work: _Work) -> None:
        """Run ``work(stop)`` in its thread; it should end within milliseconds of ``stop``."""
        with self._lock:
            if kind in self._now:
                self._next[kind] = work
                self._now[kind][0].set()
                return
            thread = Thread(
                target=self._run, args=(kind, work), daemon=True, name=f"feeler studio {kind}"
            )
            self._now[kind] = (Event(), thread)
            thread.start()

    def _run(self, kind: str, work: _Work | None) -> None:
        try:
            while work is not None:
                stop = self._now[kind][0]
                if not stop.is_set():
                    work(stop)
                with self._lock:
                    work = self._next.pop(kind, None)
                    if work is not None:
                        self._now[kind] = (Event(), current_thread())
                    else:
                        del self._now[kind]
        except BaseException:
            with self._lock:
                self._now.pop(kind, None)
            raise

    def clear(self, wait: float = 0.0) -> None:
        """End all work, and wait for it up to so many seconds."""
        with self._lock:
            running = list(self._now.values())
            self._next.clear()
            for stop, _ in running:
                stop.set()
        for _, thread in running:
            if (
                thread is not current_thread()
            ):  # who finds that its page is gone clears the desk from within
                thread.join(wait)

    @property
    def busy(self) -> bool:
        """Whether anything still runs."""
        with self._lock:
            return bool(self._now)


# A touch of an antenna in space: computed whole, shown as a view that is turned by hand.


def _touch_in_space(wish: TouchRequest) -> xr.Dataset:
    """The touch, with every hinge as a sensor.

    Raises
    ------
    InvalidInput
        Further objects, which the view does not draw.
    """
    if wish.objects:
        raise InvalidInput(
            "the studio shows one object beside an antenna in space; take the others away, or touch"
            " it by feeler.Simulation."
        )
    antenna = wish.antenna.make_any()
    preview = get_contact(None, antenna).scale_timestep(PREVIEW)
    return touch(
        antenna,
        wish.make_trial(),
        duration=wish.duration,
        timestep=preview if wish.preview else None,
        all_hinges=True,
    )


# A session: what one open page is shown. Messages in, messages out; the newest wish ends the
# work on the older.

_SLOTS = ("A", "B")
_Put = Callable[[bytes], None]
_Task = Callable[[dict[str, Any], dict[str, Any], Event], None]
"""Given what its answer begins with (type, slot, id), the message, and what stops it."""


@checked
class Session:
    """One page's work. ``put`` takes packed messages from any thread and raises ConnectionError
    when nobody listens.
    """

    def __init__(
        self, put: _Put, antenna: AntennaRequest | None = None, boards: Boards | None = None
    ) -> None:
        self._put, self._desk, self._hand = put, Desk(), Hand()
        self._boards = boards or Boards()
        self._calibration = self._boards.calibration
        self._first, self._unsure = antenna or AntennaRequest(), study.UNSURE
        self._tasks: dict[str, tuple[str, _Task]] = {
            "hello": ("catalogue", self._greet),
            "touch": ("touch", self._touch),
            "study": ("study", self._study),
            "hand": ("touch", self._take_in_hand),
            "save": ("file", self._save),
            "open": ("opened", self._open),
            "ports": ("ports", self._list_ports),
            "listen": ("touch", self._listen),
        }

    @property
    def busy(self) -> bool:
        """Whether anything is being computed."""
        return self._desk.busy

    def close(self, wait: float = 0.0) -> None:
        """End all work."""
        self._hand.end()
        self._desk.clear(wait)

    def take(self, text: str | bytes) -> None:
        """One message of the page; what is wrong with it is answered and not raised."""
        try:
            message = _read_message(text)
            asked = message["type"]
            if asked == "aim":
                self._hand.aim(message)
                return
            if asked == "stop":
                self.close()
                return
            if asked not in self._tasks:
                raise InvalidInput(
                    f"unknown message {asked[:40]!r}; valid: {', '.join(self._tasks)}, aim, stop."
                )
            kind, task = self._tasks[asked]
            number = message.get("id", 0)
            if (
                isinstance(number, bool)
                or not isinstance(number, int)
                or not 0 <= number < 2**53
            ):
                raise InvalidInput(f"id must be a whole number, got {str(number)[:40]!r}.")
            slot = message.get("slot", "A")
            if slot not in _SLOTS:
                raise InvalidInput(f"slot must be A or B, got {str(slot)[:40]!r}.")
            about = {"type": kind, "slot": slot, "id": number}
        except InvalidInput as error:
            self._desk.give(
                "answer", partial(self._answer, {"type": "error", "message": str(error)})
            )
            return
        if asked == "hand":
            self._hand.begin()
        self._desk.give(f"{asked} {about['slot']}", partial(self._work, task, about, message))

    def _answer(self, header: dict[str, Any], stop: Event) -> None:
        if not stop.is_set():
            self._say(header)

    def _work(
        self, task: _Task, about: dict[str, Any], message: dict[str, Any], stop: Event
    ) -> None:
        wrong = {**about, "type": "error", "of": message["type"]}
        try:
            task(about, message, stop)
        except (CancelledError, ConnectionError):
            return
        except SimulationDivergedError:
            self._say({**wrong, "message": _advise(message["type"])})
        except FeelerError as error:
            self._say({**wrong, "message": str(error)})
        except Exception as error:  # a mistake of ours must not end the page
            logging.getLogger("feeler").warning(
                "studio: %s failed", message["type"], exc_info=True
            )
            words = f"feeler made a mistake: {type(error).__name__}: {error}"
            self._say({**wrong, "message": words})

    def _say(self, header: dict[str, Any], **arrays: np.ndarray) -> None:
        try:
            self._put(pack(header, **arrays))
        except ConnectionError:
            self._desk.clear()

    def _tell(
        self, about: dict[str, Any], header: dict[str, Any], **arrays: np.ndarray
    ) -> None:
        self._say({**about, **header}, **arrays)

    def _greet(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        self._say({**about, **make_catalogue(self._first)})

    def _touch(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        wish = TouchRequest.from_plain(message.get("wish"))
        antenna = wish.antenna.make_any()
        if antenna.spatial:
            self._turn(about, antenna, wish, stop)
            return
        self._say(
            {**about, "part": "begin", "total": count_samples(wish), **describe_scene(wish)}
        )
        angle = []
        for first, readings in simulate_pieces(wish, stop):
            angle.append(readings["angle"])
            self._say({**about, "part": "piece", "first": first}, **readings)
        if stop.is_set():
            return
        tensor = np.concatenate(angle)[:, antenna.sensors - 1].T
        end = {"part": "end", "hash": hash_tensor(tensor), "preview": wish.preview}
        self._say({**about, **end} | ({} if wish.preview else {"mode": describe_mode(antenna)}))
        self._read(about, antenna, wish, tensor)

    def _turn(
        self, about: dict[str, Any], antenna: Antenna, wish: TouchRequest, stop: Event
    ) -> None:
        """A touch in space, whole, and the view of it that is turned by hand."""
        begin = {"part": "begin", "total": count_samples(wish), "preview": wish.preview}
        self._say({**about, **begin, "antenna": describe_antenna(antenna), "rims": []})
        tensors = _touch_in_space(wish)
        if stop.is_set():
            return
        angle = tensors["angle"].values[0]
        piece = {
            "part": "piece",
            "first": 0,
            "scene": describe_turnable(antenna, wish.make_trial(), tensors),
        }
        self._say({**about, **piece}, angle=np.moveaxis(angle, 2, 0))
        tensor = angle[:, antenna.sensors - 1].reshape(-1, angle.shape[-1])  # plane by plane
        end = {"part": "end", "hash": hash_tensor(tensor)}
        mode = {} if wish.preview else {"mode": describe_mode(antenna)}
        self._say({**about, **end, "preview": wish.preview, **mode})

    def _read(
        self,
        about: dict[str, Any],
        antenna: Antenna,
        wish: TouchRequest,
        tensor: np.ndarray,
    ) -> None:
        """Code and verdict, where the antenna has been studied at this speed. Of a touch outside
        what the decoder was trained on there is no verdict but this.
        """
        if (trained := study.find_trained(antenna, wish.speed, self._unsure)) is None:
            return
        posterior, noticed = trained[0].decode(tensor[:, : round(study.DURATION)])
        if (outside := trained[1].find_outside(wish)) and noticed >= 0:
            posterior[noticed:] = np.array(ANSWERS) == OUTSIDE
        known = study.find_study(antenna, wish.speed, self._unsure)
        long = known is not None and tensor.shape[1] >= known.encoder.n_lags
        code = {"code": known.encode(tensor)} if known is not None and long else {}
        reading = {"type": "reading", "noticed": noticed, "outside": outside}
        self._say({**about, **reading}, posterior=posterior, **code)

    def _study(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        antenna = AntennaRequest.from_plain(message.get("antenna")).make()
        speed = read_number(message.get("speed"), "speed", 1e-3, 4.0)
        self._unsure = read_number(message.get("unsure", study.UNSURE), "unsure", 0.0, 0.5)

        def tell(doing: str, share: float) -> None:
            self._say({**about, "part": "doing", "doing": doing, "share": share})

        if (trained := study.find_trained(antenna, speed, self._unsure)) is not None:
            self._say({**about, "part": "decoder", **_describe_decoder(*trained)})
        made = study.make_study(antenna, speed, tell, stop, self._unsure)
        header = {
            "part": "end",
            "labels": made.labels,
            **_describe_decoder(made.decoder, made.range, made.scores),
            "averages": {name: made.average(name) for name in study.INDEX_NAMES},
            "peak": made.peak,
            "speed": speed,
        }
        similarity = {f"similarity {name}": matrix for name, matrix in made.similarity.items()}
        self._say(
            {**about, **header},
            bases=made.encoder.components_,
            tensors=made.tensors[:, ::2, ::4],
            **similarity,
        )

    def _take_in_hand(
        self, about: dict[str, Any], message: dict[str, Any], stop: Event
    ) -> None:
        wish = TouchRequest.from_plain(message.get("wish"))
        pace = read_number(message.get("pace", 0.1), "pace", 1e-3, 1.0)
        self._hand.run(wish, pace, partial(self._tell, {**about, "hand": True}), stop)

    def _save(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        name, mime, content = make_file(message)
        padded = np.frombuffer(content + b"\0" * (-len(content) % 4), "<f4")
        self._say(
            {**about, **{"name": name, "mime": mime, "bytes": len(content)}}, content=padded
        )

    def _open(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        name, text = read_file(message)
        about = {**about, "name": name}
        if name.lower().endswith(".json"):
            self._calibration = open_calibration(name, text)
            self._say({**about, "what": "calibration", "hinges": self._calibration.n_hinges})
            return
        header, arrays = open_text(message, self._calibration, self._find(message))
        self._say({**about, **header}, **arrays)

    def _list_ports(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        self._say(
            {**about, "ports": self._boards.find(), "calibrated": self._calibration is not None}
        )

    def _listen(self, about: dict[str, Any], message: dict[str, Any], stop: Event) -> None:
        if not message.get("port"):
            return  # who listened has stopped
        antenna = AntennaRequest.from_plain(message.get("antenna")).make()
        lines, say = (
            self._boards.open(message["port"]),
            partial(self._tell, {**about, "live": True}),
        )
        listen(lines, antenna, self._calibration, self._find(message), say, stop)

    def _find(self, message: dict[str, Any]) -> Callable[[Antenna], AntennaStudy | None]:
        """The study of an antenna at the speed of a message, once it was made."""
        speed = read_number(message.get("speed", 0.06), "speed", 1e-3, 4.0)
        return lambda antenna: study.find_study(antenna, speed, self._unsure)


def _describe_decoder(decoder: Any, trained: Any, scores: dict[str, float]) -> dict[str, Any]:
    """What a page says of a decoder."""
    known = {"range": trained.to_plain(), "scores": scores, "noise": decoder.noise}
    return {"answers": ANSWERS, **known}


def _advise(asked: str) -> str:
    """What to do on the page where a simulation has no finite numbers."""
    what = (
        "One of the touches that train this antenna's decoder"
        if asked == "study"
        else "This touch"
    )
    return (
        f"{what} cannot be computed: the softest hinges are too soft for it. Choose a gentler"
        " gradient, a stiffer antenna, or a slower or smaller object."
    )
