"""Any antennas side by side: dispersion, entropy, accuracy against noise, on one self-contained page."""

import base64
import html
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from feeler.decoding.codes import make_codes
from feeler.decoding.curves import Curves, Group, compute_curves
from feeler.decoding.plan import Plan, get_plan
from feeler.dispersion import INDICES, Dispersion, Interval, bootstrap_difference
from feeler.encoding import compute_histogram_entropy, hoyer_sparseness
from feeler.errors import InvalidInput
from feeler.paper.fig5 import LABELS, list_groups, plot_curves
from feeler.paper.figS6 import NAMES, compute_groups, plot_index

KINDS = ("sparse", "raw")
PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta name="viewport" content="width=device-width, initial-scale=1"><link rel="icon" href="data:,"><style>
body{{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#111;background:#fff}}
table{{border-collapse:collapse;font-size:.9rem}}
td,th{{padding:.2rem .7rem;border-bottom:1px solid #ccc;text-align:left}}
img{{max-width:100%;height:auto}}.scroll{{overflow-x:auto}}</style></head><body><h1>{title}</h1>{body}</body></html>
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """What the page shows."""

    names: tuple[str, ...]
    dispersion: dict[str, Dispersion]
    """By kind of code: sparse activations and tensors."""
    curves: Curves
    entropy: dict[str, float]
    """Mean grey-level histogram entropy of each antenna's bases [bits]."""
    sparseness: dict[str, float]
    """Mean Hoyer sparseness of each antenna's tensors."""
    differences: dict[tuple[str, str], Interval]
    """(measure, antenna): first antenna minus this one over the same stimuli."""
    peak: dict[str, float]
    """Greatest angle [rad]."""

    def list_rows(self) -> list[tuple[str, ...]]:
        """The table: a row per measure, a column per antenna."""
        rows = [("greatest angle (°)", *(f"{np.degrees(self.peak[n]):.2f}" for n in self.names))]
        rows.append(("entropy of the bases (bits)", *(f"{self.entropy[n]:.2f}" for n in self.names)))
        rows.append(("Hoyer sparseness of the tensors", *(f"{self.sparseness[n]:.2f}" for n in self.names)))
        for index in INDICES:
            average = self.dispersion["raw"].average[index]
            rows.append((f"{NAMES[index]} with the closest match, tensors", *(str(average[n]) for n in self.names)))
        for kind in KINDS:
            for level in ("relative", "common"):
                found = self.curves.find(kind, level)
                title = f"accuracy, {LABELS[kind]}, {level} noise (%)"
                rows.append((title, *(f"{100 * found[n].noisy.mean():.1f}" for n in self.names)))
        return rows


def compare(
    tensors: Mapping[str, Any],
    encoder: Any,
    *,
    scale: str | Plan = "quick",
    random_state: int = 0,
    report: Callable[[str], None] = lambda line: None,
) -> Comparison:
    """Compare antennas on the same touches.

    Parameters
    ----------
    tensors
        Datasets by antenna name, each with the same stimuli; only the slowest speed is compared.
    encoder
        An unfitted ``ConvolutiveNMF``; each antenna gets its own bases.
    """
    if len(tensors) < 2:
        raise InvalidInput("give at least two antennas to compare, for instance: exponential linear.")
    plan = get_plan(scale)
    listed = list_groups(tensors, reference=next(iter(tensors)))["profile"]
    groups, entropy = {}, {}
    for name, (array, labels) in listed.items():
        fitted = encoder.__class__(**encoder.get_params()).set_params(n_restarts=plan.n_restarts)
        codes = make_codes(array, fitted, KINDS)
        groups[name] = Group(tensors=array, labels=labels, encoder=fitted, codes=codes)
        entropy[name] = float(np.mean([compute_histogram_entropy(basis) for basis in fitted.components_]))
        report(f"{name}: encoded")
    return Comparison(
        names=tuple(listed),
        dispersion={kind: compute_groups({n: g.codes[kind] for n, g in groups.items()}) for kind in KINDS},
        curves=(curves := compute_curves(groups, plan, kinds=KINDS, random_state=random_state, report=report)),
        entropy=entropy,
        sparseness={n: float(np.mean([hoyer_sparseness(t.ravel()) for t in g.tensors])) for n, g in groups.items()},
        differences=_compute_differences(curves, random_state),
        peak={name: float(abs(data["angle"]).max()) for name, data in tensors.items()},
    )


def _compute_differences(curves: Curves, random_state: int) -> dict[tuple[str, str], Interval]:
    rng = np.random.default_rng(random_state)
    found = {}
    for kind in KINDS:
        for level in ("relative", "common"):
            (_, reference), *others = curves.find(kind, level).items()
            for name, sweep in others:
                measure = f"accuracy, {LABELS[kind]}, {level} noise"
                found[measure, name] = bootstrap_difference(reference.area, sweep.area, rng)
    return found


def plot(data: Comparison, figure: Figure) -> None:
    """Dispersion of tensors above, accuracy below."""
    top, bottom = figure.subfigures(2, 1)
    for index, ax in zip(INDICES, top.subplots(1, len(INDICES)), strict=True):
        plot_index(data.dispersion["raw"], index, ax)
        ax.set_title(f"{NAMES[index]}, tensors", fontsize=8)
    axes = bottom.subplots(1, 4, sharey=True)
    panels = [(kind, level) for kind in KINDS for level in ("relative", "common")]
    for (kind, level), ax in zip(panels, axes, strict=True):
        plot_curves(data.curves, kind, level, ax)
        ax.set_title(f"{LABELS[kind]}, {level} noise", fontsize=7)
        ax.set_xlabel("noise (%)", fontsize=7)
    axes[0].set_ylabel("accuracy (%)", fontsize=7)
    axes[0].legend(fontsize=5, frameon=False)


def write_page(data: Comparison, path: str | Path) -> Path:
    """One HTML file with everything inside."""
    figure = Figure(figsize=(10, 6.5), layout="constrained")
    FigureCanvasAgg(figure)
    plot(data, figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=130)
    picture = base64.b64encode(buffer.getvalue()).decode()
    head = "".join(f"<th>{html.escape(name)}</th>" for name in data.names)
    cells = ("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in data.list_rows())
    first = html.escape(data.names[0])
    items = "".join(
        f"<li>{html.escape(measure)}: {first} minus {html.escape(name)} {html.escape(str(interval))}, "
        f"d<sub>z</sub> {interval.effect:.2g}</li>"
        for (measure, name), interval in data.differences.items()
    )
    body = (
        "<p>The same touches at the slowest speed. Dispersion carries 95 % bootstrap intervals over stimuli; "
        "low Pearson r, SSIM and NMI and high MSE mean more dispersed. Dashed: the null, one tensor repeated.</p>"
        f'<img alt="Dispersion and accuracy of {html.escape(", ".join(data.names))}; the numbers are in the table" '
        f'src="data:image/png;base64,{picture}">'
        f'<div class="scroll"><table><thead><tr><th>measure</th>{head}</tr></thead>'
        f"<tbody>{''.join(cells)}</tbody></table></div>"
        f"<h2>Differences</h2><ul>{items}</ul>"
    )
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(PAGE.format(title=html.escape(" against ".join(data.names)), body=body), encoding="utf-8")
    return path


__all__ = ["Comparison", "compare", "plot", "write_page"]
