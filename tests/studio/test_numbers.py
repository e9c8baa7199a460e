"""Every number that the studio shows, in words or drawn, is feeler's, with its unit, in a real
Chromium: of a touch, of two antennae, of a study, of a wall, by hand and of a recording.
"""

import re
import time

import numpy as np
import pytest

import feeler
from feeler.analysis import find_closest
from feeler.objects.trials import trials as list_ninety
from feeler.spikes import place_sensilla
from feeler.studio import Studio, study
from feeler.studio.decoder import ANSWERS
from feeler.tensors.transforms import rectify, scale_common
from feeler.wall import FOLLOWING, calibrate, follow, make_turn

from ._page import APP

pytestmark = pytest.mark.long

LISTEN = """const plain = CanvasRenderingContext2D.prototype;
const keep = {
    clearRect(c) { Object.assign(c.canvas, { texts: [], inks: [], strokes: [], rects: [] }); },
    fillText(c, words) { (c.canvas.texts ||= []).push(words);
        (c.canvas.inks ||= []).push([words, c.fillStyle]); },
    fillRect(c, ...box) { (c.canvas.rects ||= []).push(box); },
    beginPath(c) { c.points = []; },
    moveTo(c, ...place) { (c.points ||= []).push(place); },
    lineTo(c, ...place) { (c.points ||= []).push(place); },
    arc(c, x, y, radius) { (c.points ||= []).push([x, y, radius]); },
    stroke(c) { (c.canvas.strokes ||= []).push(
        { ink: c.strokeStyle, dash: c.getLineDash(), points: c.points || [] }); },
};
for (const [name, note] of Object.entries(keep)) {
    const before = plain[name];
    plain[name] = function (...given) { note(this, ...given); return before.apply(this, given); };
}"""
SPEED, PLACE, SIZE = 0.37, 0.83, 2.2
WISH = (
    "s.touch.kind = 'triangle'; s.touch.size = 2.2; s.touch.location = 0.83; s.touch.speed = 0.37;"
    " s.touch.lead = 7; s.touch.side = 'right';"
)


def make_antenna():
    """What the page is asked for: the preset 'linear', 33 mm long, with 23 sensors."""
    antenna = feeler.presets.make_preset("linear")
    factor = 33 / antenna.length
    return antenna.replace(
        segment_length=factor * antenna.segment_length,
        segment_mass=factor * antenna.segment_mass,
        sensors=feeler.antenna.segments.make_even_sensors(antenna.n_segments, 23),
    )


def make_touch(antenna, **more):
    trial = feeler.Trial(
        feature=feeler.Triangle(half_width=SIZE),
        location=PLACE,
        speed=SPEED,
        lead=7,
        side="right",
    )
    return feeler.touch(antenna, trial, **more)


@pytest.fixture(scope="module")
def studio():
    running = Studio(port=0)
    yield running
    running.close()


@pytest.fixture(scope="module")
def page(studio, browser):
    """A page whose canvases remember what was written on them since they were cleared."""
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": LISTEN})
    browser.get(studio.address)
    return Page(browser)


class Page:
    """What can be asked of the page, and what it shows."""

    def __init__(self, browser):
        self.browser = browser
        self.wait("app && app.records.A.ended && app.status == 'exact'")
        self.run("app.play(false); clearTimeout(app.studyTimer)")

    def ask(self, words):
        return self.browser.execute_script(APP + "return " + words)

    def run(self, words):
        self.browser.execute_script(APP + words)

    def wait(self, words, seconds=240.0):
        end = time.monotonic() + seconds
        while not self.ask(words):
            assert time.monotonic() < end, f"never came true: {words}"
            time.sleep(0.05)

    def change(self, words, learn=False):
        self.run(f"app.store.change(s => {{ {words} }}); clearTimeout(app.studyTimer)")
        self.wait("app.records.A.ended && app.status == 'exact'")
        if learn:
            self.run("app.study()")
            self.wait(
                "app.studies.A && !app.studying.A && !app.isStale() && app.records.A.ended"
            )
            self.wait("app.records.A.reading && !app.records.A.reading.old", 30)
        self.run("app.play(false)")

    def draw(self):
        """Once more, and whole."""
        wait = "const tell = arguments[0]; app.refresh();"
        wait += " requestAnimationFrame(() => requestAnimationFrame(() => tell()));"
        self.browser.execute_async_script(APP + wait)

    def seek(self, ms):
        self.run(f"app.play(false); app.seek({ms})")
        self.draw()

    def drawn(self, css, what="texts"):
        """What is written on a canvas, or its ``strokes``, ``rects`` or ``inks``."""
        return self.ask(f"document.querySelector('canvas.{css}').{what}")

    def text(self, css):
        return " ".join(self.browser.find_element("css selector", css).text.split())


def read(words):
    """Numbers of a text as the page writes them: 3.21, −4, 1.2·10⁻⁴."""
    powers = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
    found = re.findall(r"-?\d+(?:\.\d+)?(?:·10[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)?", words)
    return [float(one.translate(powers).replace("·10", "e")) for one in found]


def shown(value, digits=3):
    """A number to the digits that the page gives."""
    return pytest.approx(
        float(f"{value:.{digits}g}"), rel=1.01 * 10 ** (1 - digits) / 2, abs=1e-12
    )


@pytest.fixture(scope="module")
def touched(page):
    """The page after a touch, and what feeler makes of the same."""
    page.change("s.A = { preset: 'linear', length: 33, sensors: 23 }; " + WISH)
    return make_touch(make_antenna())


def test_a_sensor_is_named_with_its_hinge_and_its_degrees(page, touched):
    degrees = np.degrees(touched["angle"].values[0])
    for sensor, ms in ((4, 60), (17, 91), (22, 140)):
        page.run(f"app.setHover({{ slot: 'A', sensor: {sensor} }})")
        page.seek(ms)
        words = next(text for text in page.drawn("tensor") if "sensor" in text)
        hinge = touched["segment"].values[sensor]
        assert hinge != sensor + 1
        at = int(np.abs(degrees[sensor]).argmax())
        assert words.startswith(f"sensor {sensor + 1}, hinge {hinge}, peak: ")
        assert f"{degrees[sensor, at]:.2f}° at {at} ms; now " in words
        assert words.endswith(f"; now {degrees[sensor, ms]:.2f}°")
    page.run("app.setHover(null)")
    page.seek(91)
    words = next(text for text in page.drawn("tensor") if "peak" in text)
    best, at = np.unravel_index(np.abs(degrees).argmax(), degrees.shape)
    said = f"{degrees[best, at]:.2f}° at {at} ms; now {degrees[best, 91]:.2f}°"
    assert words == f"peak: sensor {best + 1}, {said}"


def test_the_scale_is_the_greatest_angle_or_curvature(page, touched):
    page.draw()
    text = page.text(".tensor-panel .scale")
    assert text == f"± {np.degrees(np.abs(touched['angle'].values).max()):.2f}°"
    page.run("app.quantity = 'curvature'; app.refresh()")
    page.draw()
    text = page.text(".tensor-panel .scale")
    page.run("app.setHover({ slot: 'A', sensor: 17 })")
    page.seek(91)
    words = next(text for text in page.drawn("tensor") if "sensor" in text)
    page.run("app.setHover(null); app.quantity = 'angle'; app.refresh()")
    assert text.endswith(" /mm")
    assert read(text) == [shown(np.abs(touched["curvature"].values).max())]
    assert words.startswith("sensor 18, hinge ") and " /mm at " in words
    curvature = float(touched["curvature"].values[0, 17, 91])
    assert words.endswith(f"; now {curvature:.4f} /mm")


def test_the_line_of_contact_lies_on_the_sensor_at_which_the_object_is(page, touched):
    page.run("app.showContact = true; app.refresh()")
    page.draw()
    _, top, _, high = page.drawn("tensor", "rects")[0]
    (line,) = (one for one in page.drawn("tensor", "strokes") if one["dash"] == [3, 3])
    place = touched["contact_place"].values[0]
    sensor = np.searchsorted(touched["position"].values, place[np.isfinite(place)])
    expected = top + high * (1 - (np.minimum(sensor, 22) + 0.5) / 23)
    np.testing.assert_allclose([y for _, y in line["points"]], expected, atol=0.01)
    assert np.unique(sensor).size > 1


def test_spikes_follow_the_rates_of_sensilla_that_feel_this_touch(page, touched):
    page.run("document.querySelector('.spike-panel details').open = true; app.refresh()")
    page.draw()
    spikes, greatest = read(page.text(".spike-panel .scale"))
    rated = place_sensilla(touched["position"].values, 33.5).encode(touched)["rate"].values
    assert greatest == shown(rated.max())
    expected = rated.sum() * 1e-3
    assert abs(spikes - expected) < 5 * np.sqrt(expected)
    (_, top, _, high), *marks = page.drawn("raster", "rects")
    page.run("document.querySelector('.spike-panel details').open = false; app.refresh()")
    row = high / 23
    sensor = np.round(
        (top + high - np.array([y for _, y, wide, _ in marks if wide == 1])) / row
    )
    counts = np.bincount(sensor.astype(int) - 1, minlength=23)  # from the base below to the tip
    of_sensor = rated[0].sum(axis=-1).reshape(2, 23).sum(axis=0) * 1e-3
    assert np.all(np.abs(counts - of_sensor) < 6 * np.sqrt(of_sensor + 1))
    # likelier than upside down: the sum is as far below 0 where the raster is turned over
    assert np.sum(counts * np.log(of_sensor / of_sensor[::-1])) > 0


def test_the_force_is_in_micronewtons_and_the_clock_in_milliseconds(page, touched):
    force = np.hypot(*touched["force"].values[0].T)
    on = np.flatnonzero(np.isfinite(touched["contact_place"].values[0]) & (force > 0))
    for ms in (int(on[1]), int(on[on.size // 2])):
        page.seek(ms)
        words = next(text for text in page.drawn("stage") if text.endswith("µN"))
        assert read(words) == [shown(1e6 * force[ms])]
        assert page.text(".clock") == f"{ms} ms"
    page.seek(0)
    assert not [text for text in page.drawn("stage") if "N" in text.split()]


def test_the_force_is_that_of_all_objects_together(page, touched):
    ball = "{ kind: 'ball', size: 2, x: -4, y: 14, heading: 90, speed: 0.3, friction: 1 }"
    page.change(f"s.touch.objects = [{ball}];")
    try:
        force = np.array(page.ask("[...app.records.A.data.force]")).reshape(-1, 2, 2)
        both = np.flatnonzero((np.abs(force).max(axis=2) > 1e-7).all(axis=1))
        ms = int(both[both.size // 2])
        page.seek(ms)
        words = next(text for text in page.drawn("stage") if text.endswith("µN"))
        assert read(words) == [shown(1e6 * np.hypot(*force[ms].sum(axis=0)))]
    finally:
        page.change("s.touch.objects = [];")


@pytest.fixture(scope="module")
def learned(page, touched):
    """The page after a study of this antenna at this speed."""
    page.change("", learn=True)
    return study.find_study(make_antenna(), SPEED)


def tell(known, ms, angle):
    """The likeliest answer at a moment, its probability, since when it is sure, and when contact
    was noticed.
    """
    posterior, noticed = known.decoder.decode(angle)
    best = int(posterior[ms].argmax())
    decided = ms
    while decided > 0 and posterior[decided - 1, best] >= 0.9:
        decided -= 1
    return ANSWERS[best], posterior[ms, best], max(0, decided - noticed), noticed


def test_the_verdict_is_the_decoder_s_and_its_time_is_since_contact(page, touched, learned):
    angle = touched["angle"].values[0]
    said = []
    for ms in (40, 340):
        best, probability, decided, noticed = tell(learned, ms, angle)
        page.seek(ms)
        text = page.text(".verdict-panel .verdict")
        said.append(text)
        sure = bool(probability >= 0.9)
        words = (f"not sure yet perhaps a {best}, #", f"{best} # · decided # ms after contact")
        assert re.sub(r"[\d.]*\d", "#", text) == words[sure]
        assert read(text) == [round(probability, 2), decided][: 1 + sure]
    assert len(set(said)) == len(said)
    assert noticed > 5  # the lead, so that counting from the beginning would be seen
    page.seek(noticed - 2)
    assert page.text(".verdict-panel .verdict") == "no touch noticed yet"
    assert {"0 ms", "380"} <= {*page.drawn("chart")}


def test_the_set_s_numbers_are_those_of_thirty_touches(page, learned):
    made = list_ninety(speeds=[SPEED])
    tensors = scale_common(rectify(feeler.touch(make_antenna(), made)["angle"].values))
    for index, compute in study.INDEX_NAMES.items():
        matrix = np.asarray(compute(tensors))
        average = find_closest(matrix, greatest=True).value.mean()
        label = {"nmi": "NMI", "pearson": "Pearson", "ssim": "SSIM"}[index]
        page.browser.find_element("xpath", f"//button[text()='{label}']").click()
        page.draw()
        assert page.text(".set-panel .numbers").startswith("closest match, mean A: ")
        assert read(page.text(".set-panel .numbers")) == [shown(average, 2)]
        row, column = 4, 23
        aim(page, row, column)
        one, other = (
            f"{made[k].feature.kind} {made[k].feature.size:g} mm at {made[k].location:g} L"
            for k in (row, column)
        )
        words = page.text(".set-panel .caption")
        assert words.startswith(f"{one} · {other}: {label} ")
        assert read(words)[-1] == shown(matrix[row, column])


def aim(page, row, column):
    """The pointer on a pair of the matrix."""
    script = """const c = document.querySelector('canvas.matrix'), b = c.getBoundingClientRect();
    const size = Math.min(c.clientWidth, c.clientHeight) / 30, [row, column] = arguments;
    c.dispatchEvent(new PointerEvent('pointermove', { clientX: b.left + (column + 0.5) * size,
        clientY: b.top + (row + 0.5) * size, bubbles: true }));"""
    page.browser.execute_script(script, row, column)


@pytest.mark.parametrize("speed", [0.7, 0.2])
def test_a_wall_s_run_is_calibrated_at_its_own_speed(page, speed):
    """The second speed after the first: the map of the first is not kept for it."""
    page.run(
        "app.store.change(s => { s.mode = 'wall'; s.A = { preset: 'exponential' };"
        f" s.wall = {{ turn: -20, speed: {speed} }}; }})"
    )
    page.wait("app.walls.A.end && app.status == 'exact'")
    antenna, course = feeler.presets.cockroach(), make_turn(-20.0, (120.0, 150.0))
    known = calibrate(antenna, speed=speed)
    run = follow(antenna, course, speed=speed, distance_map=known)
    page.seek(50)
    words = page.ask("[...document.querySelectorAll('canvas.tensor')].at(-1).texts")
    assert not run.collided
    said = next(text for text in words if "target" in text)
    assert said.startswith("off target by ") and said.endswith(" mm (rms)")
    assert read(said) == [shown(run.error, 2)]
    assert "20 mm" in words and "0 ms" in words
    sent = np.array(page.ask("[...app.walls.A.end.distance]"))
    np.testing.assert_allclose(sent, run.distance, rtol=1e-6)
    felt = np.array(page.ask("[...app.walls.A.end.estimate]"), dtype=float)
    np.testing.assert_allclose(felt, run.estimate, rtol=1e-6)
    assert np.nanmax(np.abs(felt - sent)) > 0.1
    chart = "[...document.querySelectorAll('canvas.tensor')].at(-1)"
    inks = dict(page.ask(f"{chart}.inks"))
    curves = {one["ink"]: one["points"] for one in page.ask(f"{chart}.strokes")}
    for words, values in (("true distance", sent), ("felt, from the point", felt)):
        ink = next(ink for text, ink in inks.items() if text.startswith(words))
        heights = np.array([y for _, y in curves[ink]])
        known = values[np.isfinite(values)]
        assert heights.size == known.size
        assert np.corrcoef(heights, -np.minimum(known, 22.0))[0, 1] > 0.999, words
    bent = np.array(page.ask("app.walls.A.angle.map(a => [...a])"))
    bent = np.abs(bent - np.array(page.ask("app.walls.A.header.antenna.rest")))
    tops = bent.argmax(axis=1), (bent / antenna.segment_length).argmax(axis=1)
    page.seek(int(np.argmax((tops[0] != tops[1]) & (bent.max(axis=1) > 1e-4))))
    at = int(page.ask("Math.round(app.time)"))
    stages = "[...document.querySelectorAll('canvas.stage')].filter(one => one.offsetParent)"
    (strokes,) = page.ask(f"{stages}.map(one => one.strokes)")
    (ring,) = (k for k, one in enumerate(strokes) if [p[2:] for p in one["points"]] == [[7]])
    after = len(strokes) - 1 - ring  # the segments beyond, a stroke each
    assert antenna.n_segments - 1 - after == tops[1][at] != tops[0][at]
    assert page.ask("app.walls.A.header.heading") == FOLLOWING.base_angle
