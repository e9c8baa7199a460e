"""Three questions of our own, computed whole: which receptor noise makes the published gradient the
best, an antenna designed for sizes and places never met, and contact out of the plane.

    python benchmarks/questions.py [receptor unseen space]

What is asked stands in src/feeler/studies/paper/open_receptor.toml, open_unseen.toml and
open_space.toml, declared before anything was run. What is found is stored beside them as JSON, with
date and seed; the report shows it, and made.json notes the code. The first two take some ten
minutes of one core, the third about ten minutes a set; with a journal it goes on where it stopped:
out/open_space.jsonl.
"""

import sys
import time
from pathlib import Path

from kept import note_kept

from feeler.presets import cockroach
from feeler.studies.paper import open_receptor, open_space, open_unseen
from feeler.studies.paper.open_space_study import run_space

_JOURNAL = Path("out/open_space.jsonl")
_STORED = {"receptor": open_receptor, "unseen": open_unseen}


def compute(name: str) -> Path:
    """Compute a question and store what is found."""
    if name == "space":
        return open_space.store_found(run_space(_JOURNAL))
    question = _STORED[name]
    return question._store_found(question.compute(cockroach(), workers=1))


def main() -> None:
    for name in sys.argv[1:] or [*_STORED, "space"]:
        began = time.process_time()
        note_kept(compute(name))
        print(f"{name}: {time.process_time() - began:.0f} s of a core", flush=True)


if __name__ == "__main__":
    main()
