"""One quantity, one unit: what stands in brackets behind a quantity on an axis, in a table or in
help is always its own.
"""

import ast
import re
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src" / "feeler"
UNIT = (
    r"(mm|cm|m|px|ms|s|Hz|kHz|°|degrees|rad|radians|%|‰|m/s|mm/s|mm/ms|cm/s|°/s|rad/s|rad/ms|mN|N|mg|g|µJ|mJ|bits|nats|1/mm"
    r"|N·mm/rad|N·mm·ms/rad|rad/N·mm|1/joint)"
)
LABEL = re.compile(rf"(?:^|[,;(] ?)([^\[\],;]*?) [\[(]{UNIT}[\])]")
OWN = {
    r"spacing of sensors": {"mm"},
    r"sampling rate": {"Hz"},
    r"noise borne|equal noise at|both noises are equal": {"rad"},
    r"best rate": {"1/joint"},
    r"angular speed|mean of peak speeds|\|speed\||^left$|^right$": {"°/s", "%"},
    r"distance since": {"mm"},
    r"processor time|^time$": {"s", "ms"},
    r"time|timestep|deadline|delay|duration|lag|integration step|"
    r"since contact|at the latest|last contact": {"ms"},
    r"simulated touches": {"ms"},
    r"speed|touches to tell apart": {"m/s"},
    r"firing rate": {"Hz"},
    r"frequency|mode \d|low-pass|mean rate|sets the gain|^$": {"Hz", "m/s", "mm"},
    r"^peak$": {"rad"},
    r"\bangle|^largest$|^least$|turn of the (wall|approach)|bend of": {"°", "degrees"},
    r"stiffness rate|^rate$": {"1/joint"},
    r"stiffness": {"N·mm/rad"},
    r"damping": {"N·mm·ms/rad"},
    r"Σ 1/k": {"rad/N·mm"},
    r"curvature": {"1/mm"},
    r"force": {"mN", "N"},
    r"work|budget": {"µJ"},
    r"entropy|information": {"bits"},
    r"gain: ω": {"rad/ms"},
    r"^noise$|of the sensors: common": {"%", "rad"},
    r"share of|accuracy|in whole touches|right|wrong|learned|steered|fixed|"
    r"null|twin|kept|avoided|sure within|new place|new size|ms$": {"%"},
    r"^[xyz]$": {"mm", "px"},
    r"distance|length|width|radius|sheet|thickness|error|"
    r"intercept|tip|sideways|from hinge|told apart|nearest": {"mm"},
}


def find_labels(path):
    """Quantity and unit of every label in a file's texts; docstrings and errors are sentences."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    sentences = [
        n.value
        for n in ast.walk(tree)
        if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)
    ]
    sentences += [
        part for n in ast.walk(tree) if isinstance(n, ast.Raise) for part in ast.walk(n)
    ]
    left = {id(one) for one in sentences}
    texts = (
        n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and id(n) not in left
    )
    return [
        match.groups()
        for text in texts
        if isinstance(text, str)
        for match in LABEL.finditer(text)
    ]


LABELS = [
    (path.relative_to(SOURCE).as_posix(), *label)
    for room in ("active", "cli", "design", "plotting", "studies")
    for path in sorted((SOURCE / room).rglob("*.py"))
    for label in find_labels(path)
]


def find_rule(quantity: str) -> set[str]:
    """The units that a quantity may have."""
    found = (rule for rule in OWN if re.search(rule, quantity.strip(), re.IGNORECASE))
    return OWN.get(next(found, ""), set())


def test_a_quantity_has_its_own_unit():
    """A quantity of which no unit is known is to be added to OWN."""
    assert [label for label in LABELS if label[2] not in find_rule(label[1])] == []


def test_labels_are_found():
    assert (
        len(LABELS) > 90 and ("studies/tradeoff/draw.py", "time since contact", "ms") in LABELS
    )
