"""Write README's table (figure → command → seconds → headline) from the sections of a finished run in out/."""

import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
HEADLINES = {
    "antenna": ("Fig. 2A, C", "antenna.n_segments", "{:.0f} segments"),
    "calibration": ("Fig. 2B, S1, Movie S1", "calibration.frequency", "{:.1f} Hz damped tip frequency"),
    "tensors": ("Fig. 2D–E, S3, Movie S2", "tensors.count", "{:.0f} tensors of one antenna"),
    "wall": ("Fig. 3, Movie S3", "wall.r2.exponential", "R² {:.3f}, exponential profile"),
    "encoding": ("Fig. 4, 5F–G, S5", "encoding.location_p", "bases map to location: p = {:.3f}"),
    "reading": ("Fig. 5A–E, S6", "dispersion.tensor.nmi.slow", "closest-match NMI {:.2f} at slow touch"),
    "cnn": ("Fig. S4", "cnn.slow", "{:.2f} accuracy at slow touch"),
    "robot": ("Fig. 6, S7, Movie S4", "robot.transfer", "{:.2f} of surrogate contacts read right"),
    "tracking": ("Fig. S2", "tracking.mean", "{:.1f} °/s, synthetic tracks"),
}


def make_rows(cache: Path) -> list[str]:
    rows = []
    for name, (figures, key, form) in HEADLINES.items():
        files = sorted((cache / name).glob("*/section.json"), key=lambda path: path.stat().st_mtime)
        data = json.loads(files[-1].read_text()) if files else {"values": {}, "seconds": 0.0}
        value = data["values"].get(key)
        value = value.get("value") if isinstance(value, dict) else value
        command = "`make reproduce SCALE=paper`" if name == "cnn" else "`make reproduce`"
        headline = form.format(value) if value is not None else "–"
        rows.append(f"| {figures} | {command} | {data['seconds']:.0f} | {headline} |")
    return rows


def main() -> None:
    cache = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "out") / "cache"
    table = "\n".join(["| figure | command | seconds | headline |", "|---|---|---|---|", *make_rows(cache)])
    readme = ROOT / "README.md"
    pattern = r"(<!-- figures: .*? -->\n).*(<!-- end of figures -->)"
    readme.write_text(re.sub(pattern, lambda found: f"{found[1]}{table}\n{found[2]}", readme.read_text(), flags=re.S))


if __name__ == "__main__":
    main()
