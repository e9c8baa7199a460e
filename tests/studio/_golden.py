"""What the studio's page shows in a real Chromium, step by step, as lines of text: its words, and
for each canvas what is written and drawn on it, in which colour and where.

``make golden`` keeps a meant change anew and prints what has changed, for review.
"""

from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

from feeler.studio.export import make_file, write_touch_page
from tests import golden

from .test_numbers import SPEED, WISH, Page, aim

KEPT = Path(__file__).with_name("golden.txt")
TOLERANCES = {
    r"^\w+: (texts|strokes|fills|rects|images) ": (
        0.02,
        1.0,
        "pixels: letters are as wide as the machine's",
    ),
}
LISTEN = """const later = window.setTimeout, served = location.protocol !== 'file:';
// what a server would have to learn is learned only when a step asks for it
window.setTimeout = (act, ...more) =>
    served && String(act).includes('.study()') ? 0 : later(act, ...more);
let seed = 7;  // the same spikes each time
Math.random = () => (seed = (16807 * seed) % 2147483647) / 2147483647;
const plain = CanvasRenderingContext2D.prototype;
const add = (c, kind, ...told) => (c.canvas.drawn ||= []).push([kind, ...told]);
const mean = (image) => [0, 1, 2].map((n) => { let sum = 0;
    for (let k = n; k < image.data.length; k += 4) sum += image.data[k] * (1 + (k % 977) / 977);
    return (4 * sum) / image.data.length; });
const keep = {
    clearRect(c) { c.canvas.drawn = []; },
    fillText(c, words, x, y) { add(c, 'texts', `${words} ${c.fillStyle}`, [x, y]); },
    fillRect(c, ...box) { add(c, 'rects', c.fillStyle, box); },
    beginPath(c) { c.points = []; },
    moveTo(c, ...place) { (c.points ||= []).push(...place); },
    lineTo(c, ...place) { (c.points ||= []).push(...place); },
    arc(c, x, y, radius) { (c.points ||= []).push(x, y, radius); },
    ellipse(c, ...all) { (c.points ||= []).push(...all); },
    stroke(c, path) { const look = `${c.strokeStyle} ${c.getLineDash()} ${c.lineWidth.toFixed(2)}`;
        add(c, 'strokes', look, path ? [] : c.points || []); },
    fill(c, path) { add(c, 'fills', c.fillStyle, path ? [] : c.points || []); },
    putImageData(c, image) { add(c, 'images', '', [image.width, image.height, ...mean(image)]); },
    drawImage(c, image, ...box) { add(c, 'images', 'copied', box); },
};
for (const [name, note] of Object.entries(keep)) {
    const before = plain[name];
    plain[name] = function (...given) { note(this, ...given); return before.apply(this, given); };
}"""
SHOWN = """const seen = [...document.querySelectorAll('canvas')].filter((one) => one.offsetParent);
return [app.root.innerText, seen.map((one) => [one.className || 'canvas', one.drawn || []])];"""
BALL = "{ kind: 'ball', size: 2, x: -4, y: 14, heading: 90, speed: 0.3, friction: 1 }"
OTHER = "app.quantity = '{}'; app.showContact = {}; app.refresh()"


def write_golden(browser, address: str) -> list[str]:
    """The lines of all steps; the page must not have been opened before."""
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": LISTEN})
    browser.get(address)
    page = Page(browser)
    lines: list[str] = []
    with TemporaryDirectory() as folder:
        for name in chain(take_steps(page), take_steps_alone(page, Path(folder))):
            page.draw()
            lines += [f"# {name}", *read_page(page)]
    return lines


def take_steps(page: Page):
    """Brings the page to what is looked at, and names it."""
    page.change("s.A = { preset: 'linear', length: 33, sensors: 23 }; " + WISH)
    page.run("app.setHover({ slot: 'A', sensor: 4 })")
    page.seek(60)
    yield "a touch and a sensor"
    page.run("app.setHover(null);" + OTHER.format("curvature", "true"))
    page.seek(141)
    yield "curvature and contact"
    page.run(OTHER.format("angle", "false"))
    page.run("for (const one of document.querySelectorAll('details')) one.open = true")
    page.draw()
    yield "all that is folded"
    page.run("for (const one of document.querySelectorAll('details')) one.open = false")
    page.change(f"s.touch.objects = [{BALL}];")
    page.seek(77)
    yield "two objects"
    page.change("s.touch.objects = []; s.B = { preset: 'exponential' };")
    page.wait("app.records.B.ended")
    page.run("app.setHover({ slot: 'B', sensor: 51 })")
    page.seek(88)
    yield "two antennae"
    page.run("app.setHover(null)")
    page.change("s.B = null;", learn=True)
    for ms in (20, 200, 340):
        page.seek(ms)
        yield f"a study of touches at {SPEED} m/s, {ms} ms"
    for label in ("Pearson", "SSIM"):
        page.browser.find_element("xpath", f"//button[text()='{label}']").click()
        page.draw()
        aim(page, 4, 23)
        yield f"pairs of the set by {label}"
    page.run(
        "app.store.change(s => { s.mode = 'wall'; s.A = { preset: 'exponential' };"
        " s.wall = { turn: -20, speed: 0.7 }; })"
    )
    page.wait("app.walls.A.end && app.status == 'exact'")
    for ms in (50, 170):
        page.seek(ms)
        yield f"a wall, {ms} ms"
    page.change(  # nearer to the tip a whisker sticks and slips, on each processor otherwise
        "s.mode = 'touch'; s.A = { preset: 'rat-whisker' };"
        " s.touch.azimuth = 35; s.touch.location = 0.55;"
    )
    page.seek(40)
    yield "a whisker in space"


def take_steps_alone(page: Page, folder: Path):
    """Pages that compute by themselves: of touches that can be dragged, and of a run by hand."""
    path, computed = folder / "page.html", "app && app.status == 'here' && app.records.A.ended"
    path.write_text(write_touch_page(), encoding="utf-8")
    page.browser.get(path.as_uri())
    page.wait(f"{computed} && app.records.A.reading && !app.records.A.reading.old")
    page.seek(203)
    yield "the page alone"
    for change in (
        "s.touch.speed = 0.6; s.touch.location = 0.55",
        "s.touch.kind = 'box'; s.touch.size = 2.3; s.touch.side = 'right'",
        "s.A = JSON.parse(document.getElementById('config').textContent).antennas[1].wish",
        "s.touch.kind = 'ball'; s.touch.size = 1.5; s.touch.speed = 0.06; s.touch.location = 0.7",
    ):
        page.run(f"app.store.change(s => {{ {change} }})")
        page.wait(f"{computed} && !app.records.A.preview")
        page.wait("app.records.A.reading && !app.records.A.reading.old")
        page.seek(41)
        yield f"the page alone, {change}"
    commands = [[1, 0, 0.0, 0.0, 0.0], [3, 0, 0.4, -0.1, 0.0], [9, -1, 0.05, 0.1, 0.004]]
    wish = {"antenna": {"preset": "matched"}, "location": 0.6, "lead": 2.0}
    _, _, content = make_file(
        {"what": "html", "wish": wish, "commands": commands, "samples": 40}
    )
    path.write_bytes(content)
    page.browser.get(path.as_uri())
    page.wait("app && app.records.A.hand && app.records.A.ended")
    page.seek(33)
    yield "a run by hand, computed again"


def read_page(page: Page) -> list[str]:
    """Words, and what each canvas that is seen shows: one line for each text and each look."""
    words, canvases = page.browser.execute_script(
        "const app = document.getElementById('studio').studio;" + SHOWN
    )
    lines = [f"says {' '.join(line.split())}" for line in words.splitlines() if line.strip()]
    for name, drawn in canvases:
        looks: dict[str, list[float]] = {}
        for kind, look, numbers in drawn:
            looks.setdefault(f"{name.split()[0]}: {kind} {look}", []).extend(numbers)
        lines += [f"{look} at {golden.digest(numbers)}" for look, numbers in looks.items()]
    return lines


def main() -> None:
    """Look at the page; keep and print what has changed."""
    from feeler.studio import Studio
    from tests.conftest import open_chromium

    with open_chromium() as browser:
        running = Studio(port=0)
        try:
            golden.keep(KEPT, write_golden(browser, running.address), TOLERANCES)
        finally:
            running.close()


if __name__ == "__main__":
    main()
