"""A command whose workers are killed: touches into a store, by processes or a cluster."""

import sys

import feeler
from feeler.cli.app import _run
from feeler.cli.choose import choose_executor


def touch(kind: str, store: str) -> None:
    trials = [
        feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.5 + 0.02 * k, speed=0.3)
        for k in range(12)
    ]
    cluster = None if kind == "processes" else kind
    with choose_executor(None if cluster else 2, cluster, processes=not cluster) as executor:
        done = feeler.touch(
            feeler.presets.cockroach(), trials, duration=8.0, store=store, executor=executor
        )
    print("finished", done.sizes["trial"], flush=True)


if __name__ == "__main__":
    import feeler.cli.app

    feeler.cli.app.app = lambda: touch(*sys.argv[1:])
    _run()
