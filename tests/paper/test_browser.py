"""The report in a real browser: nothing broken, nothing too wide, nothing on the console, from
phone to desktop.
"""

import html
import json
import re
import subprocess

import pytest

from tests.conftest import CHROMIUM, FLAGS

CHECK = """<script>
const problems = [];
window.addEventListener('error', e => problems.push('error: ' + (e.message || \
e.target.outerHTML.slice(0, 80))), true);
console.error = (...words) => problems.push('console: ' + words.join(' '));
document.addEventListener('DOMContentLoaded', () => { for (const i of document.images) i.loading = \
'eager'; });
window.addEventListener('load', () => setTimeout(() => {
  for (const i of document.images) if (!i.complete || !i.naturalWidth) problems.push('broken: ' + \
i.alt.slice(0, 40));
  const videos = [...document.querySelectorAll('video')];
  for (const v of videos) if (!v.videoWidth) problems.push('a movie does not play');
  const width = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > width) problems.push('the page is wider than the \
window');
  for (const e of document.querySelectorAll('body *'))
    if (!e.closest('.scroll, .pan, thead') && e.getBoundingClientRect().right > width + 1) \
problems.push('too wide: '
      + e.outerHTML);
  for (const e of document.querySelectorAll('.scroll'))
    if (e.scrollWidth > e.clientWidth + 1) problems.push('a table is cut off: ' + \
e.textContent.trim().slice(0, 60));
  for (const i of document.querySelectorAll('.pan img'))  // letters of 7 pt are 9 px where a \
picture has its own width
    if (i.getBoundingClientRect().width < i.getAttribute('width') - 1) problems.push('letters \
under 9 px: ' + i.alt.slice(0, 40));
  for (const e of document.querySelectorAll('body *'))
    if (parseFloat(getComputedStyle(e).fontSize) < 9) problems.push('letters under 9 px: ' + \
e.outerHTML.slice(0, 60));
  for (const i of document.querySelectorAll('#fig2e_exponential img')) {
    const r = i.getBoundingClientRect();
    i.dispatchEvent(new PointerEvent('pointermove', { clientX: r.left + r.width / 4, clientY: \
r.top + r.height / 3 }));
    const said = document.getElementById('tip').textContent;
    if (!/sensor [0-9]+, [0-9]+ ms: [0-9.e-]+ .mm/.test(said)) problems.push('no value under the \
pointer: ' + said);
  }
  parent.postMessage({width: innerWidth, images: document.images.length, videos: videos.length, \
problems}, '*');
}, 3000));
</script>"""
FRAME = """<body style="margin:0"><iframe src="page.html" \
style="border:0;width:{width}px;height:800px"></iframe><script>
window.addEventListener('message', e => {{ const found = document.createElement('pre'); found.id = \
'found';
  found.textContent = JSON.stringify(e.data); document.body.append(found); }});</script>"""


def look(page: str, width: int, folder) -> dict:
    """What Chromium finds at this width; in a frame, because its own window cannot be as narrow as
    a phone.
    """
    (folder / "page.html").write_text(page.replace("<head>", "<head>" + CHECK, 1))
    (folder / "frame.html").write_text(FRAME.format(width=width))
    options = [
        *FLAGS.split(),
        f"--user-data-dir={folder}/user",
        "--window-size=1600,900",
        "--virtual-time-budget=20000",
    ]
    command = [CHROMIUM, *options, "--dump-dom", f"file://{folder}/frame.html"]
    shown = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=True
    ).stdout
    return json.loads(html.unescape(re.search(r'<pre id="found">(.*?)</pre>', shown, re.S)[1]))


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
@pytest.mark.parametrize("width", [390, 820, 1440])
def test_the_report_holds_at_every_width(whole, tmp_path, width):
    found = look((whole / "report.html").read_text(), width, tmp_path)
    assert found["width"] == width
    assert found["problems"] == []
    assert found["images"] >= 10
    assert found["videos"] >= 3
