"""Scripts of docs and benchmarks, which are no part of the package, as modules."""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

ROOT = Path(__file__).parents[1]


def load_script(folder: str, name: str) -> ModuleType:
    """The script ``name`` of ``folder``, run as a module that finds its neighbours."""
    path = ROOT / folder / f"{name}.py"
    if str(path.parent) not in sys.path:
        sys.path.append(str(path.parent))
    spec = spec_from_file_location(f"{folder}_{name}", path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
