"""How many of the mistakes made by hand were noticed: by area and batch, with intervals."""

from collections.abc import Iterable, Mapping
from itertools import groupby

from scipy.stats import binomtest

Mistake = Mapping[str, str]


def read_first(mistakes: Iterable[Mistake]) -> dict[str, bool]:
    """Which were noticed before a law was written for them; those not judged are left out."""
    return {each["name"]: each["first"] != "" for each in mistakes if "first" in each}


def tabulate(mistakes: Iterable[Mistake], noticed: Mapping[str, bool]) -> str:
    """Rows of a table for each batch (the letter of its names): area, rate, not judged."""
    lines = ["| batch | area | noticed | 95% interval | not judged |", "|---|---|---|---|---|"]
    for batch, those in groupby(sorted(mistakes, key=_get_batch), key=_get_batch):
        made = list(those)
        for area in sorted({each["area"] for each in made}):
            names = [each["name"] for each in made if each["area"] == area]
            lines.append(_write_row(batch, area, names, noticed))
        lines.append(_write_row(batch, "together", [each["name"] for each in made], noticed))
    return "\n".join(lines)


def write_rate(noticed: int, judged: int) -> tuple[str, str]:
    """A rate in words, and Wilson's interval at 95 % (https://doi.org/10.1080/01621459.1927.10502953)."""
    if judged == 0:
        return "not judged", "–"
    found = binomtest(noticed, judged)
    low, high = found.proportion_ci(0.95, method="wilson")
    return f"{noticed} of {judged}, {found.statistic:.0%}", f"{low:.0%} to {high:.0%}"


def _get_batch(mistake: Mistake) -> str:
    return mistake["name"][0]


def _write_row(batch: str, area: str, names: list[str], noticed: Mapping[str, bool]) -> str:
    judged = [noticed[name] for name in names if name in noticed]
    cells = batch, area, *write_rate(sum(judged), len(judged)), str(len(names) - len(judged))
    return f"| {' | '.join(cells)} |"
