"""What ``feeler info`` says of a design file."""

from feeler.design.plan import DesignPlan, load_plan
from feeler.tensors.formats import Format


def _describe(plan: DesignPlan) -> list[str]:
    task = plan.task
    return [
        f"objects     {', '.join(item.name for item in task.objects)}",
        f"locations   {', '.join(f'{place:g}' for place in task.locations)}",
        f"speeds      {', '.join(f'{speed:g}' for speed in task.speeds)} m/s",
        f"deadline    {task.deadline} ms",
        f"noise       {task.noise}",
        f"begins at   {plan.reference.name}",
    ]


DESIGN_FILES = {
    "design": Format(
        words="design (TOML)",
        kind="design",
        detect=lambda path, start: b"feeler.design/" in start,
        load=lambda path, limits, trusted: load_plan(path),
        tell=_describe,
    ),
}
