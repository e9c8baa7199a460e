"""The convolutional network of Fig. S4."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from feeler.paper.context import Context
from feeler.paper.data import list_profiles, list_speeds, load_tensors
from feeler.report.section import Section


def make(context: Context, section: Section) -> None:
    """Fig. S4, which needs torch; below paper scale, how to add it."""
    if context.scale != "paper":
        section.text(
            "Left out at this scale: the network of Fig. S4 needs PyTorch. `make reproduce SCALE=paper` installs it and runs "
            "this section; `pip install 'feeler[cnn]'` adds it to an environment of yours."
        )
        return
    from feeler.decoding.cnn import import_torch
    from feeler.paper import figS4

    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets))
    with _one_thread(import_torch()):
        data = figS4.compute(sets, scale=context.scale, reference=first, random_state=context.seed)
    speeds = {f"{speed:g} m/s": name for name, speed in list_speeds(context, first).items()}
    section.figure(
        "figS4_cnn",
        "Accuracy of the paper's network against noise, by speed and by profile; mean ± 1 SD. (Fig. S4B–C)",
        lambda figure: figS4.plot(data, figure),
        height=3.2,
    )
    section.numbers(
        "figS4_cnn",
        **{
            comparison: {name: {"ratio": s.ratios, "accuracy": s.noisy} for name, s in sweeps.items()}
            for comparison, sweeps in data.sweeps.items()
        },
    )
    for name, spread in data.summarise().items():
        section.values[f"cnn.{speeds.get(name, name)}"] = spread


@contextmanager
def _one_thread(torch: Any) -> Iterator[None]:
    """Sums do not depend on the machine's cores; and beside another stage, threads only wait for each other."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
