"""Two questions of our own, computed whole: which receptor noise makes the published gradient the
best, and an antenna designed for sizes and places never met.

    python benchmarks/questions.py [receptor unseen]

What is asked stands in src/feeler/studies/paper/open_receptor.toml and open_unseen.toml, declared
before anything was run. What is found is stored beside them as JSON, with date and seed; the report
shows it, and made.json notes the code. Some ten minutes of one core.
"""

import sys
import time

from kept import note_kept

from feeler.presets import cockroach
from feeler.studies.paper import open_receptor, open_unseen

QUESTIONS = {"receptor": open_receptor, "unseen": open_unseen}


def main() -> None:
    for name in sys.argv[1:] or QUESTIONS:
        question, began = QUESTIONS[name], time.process_time()
        note_kept(question.store_found(question.compute(cockroach(), workers=1)))
        print(f"{name}: {time.process_time() - began:.0f} s of a core", flush=True)


if __name__ == "__main__":
    main()
