"""Train the decoders that come with the studio, so that its first touches have a verdict at once.

python -m docs.make_decoders
"""

import json
from pathlib import Path
from threading import Event

from feeler.presets import make_preset
from feeler.provenance import PHYSICS
from feeler.studio import study

FILE = Path(study.__file__).with_name("trained.json")
SHIPPED = (
    *(("exponential", 0.06), ("matched", 0.06), ("exponential", 0.6)),
    *(("uniform", 0.06), ("linear", 0.06)),
)
"""Presets and speeds [m/s] that the first page and its tour show."""
STEP = 0.008  # rad; rounding of what a decoder expects


def main() -> None:
    """Write them."""
    made = []
    for preset, speed in SHIPPED:
        antenna = make_preset(preset)
        train = (antenna, speed, lambda doing, share: None, Event(), study.UNSURE, STEP)
        decoder, _, scores = study.train(*train)
        about = {"preset": preset, "speed": speed, "unsure": study.UNSURE, "physics": PHYSICS}
        made.append({**about, **decoder.to_plain(), "scores": scores})
        print(preset, speed, scores)
    FILE.write_text(json.dumps(made) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
