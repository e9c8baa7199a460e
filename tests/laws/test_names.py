"""One name, one thing: no two public things share a name, none hides a module, and every parameter
is read.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import feeler

SOURCE = Path(feeler.__file__).parent
FILES = sorted(SOURCE.rglob("*.py"))
INNER = (
    "feeler.studies.paper.",
    "feeler.cli.",
)  # figures and verbs: called by their module's name
GIVEN = {
    "y",
    "kws",
    "lane",
}  # handed in, read or not, by scikit-learn, numba, and to steppers that have but one lane


def name_module(path: Path) -> str:
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def list_public() -> Iterator[tuple[str, str, ast.AST]]:
    """Module, name and definition of every public function and class."""
    for path in FILES:
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith(
                "_"
            ):
                yield name_module(path), node.name, node


def test_no_two_public_things_share_a_name():
    homes = defaultdict(set)
    for module, name, _ in list_public():
        if not module.startswith(INNER):
            homes[name].add(module)
    assert {name: sorted(modules) for name, modules in homes.items() if len(modules) > 1} == {}


def test_no_function_hides_a_module():
    """``import feeler.room.name`` gives the module, whatever else the room offers."""
    modules = {name_module(path) for path in FILES}
    hidden = set()
    for path in SOURCE.glob("*/__init__.py"):
        room = name_module(path)
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                names = {
                    alias.asname or alias.name for alias in node.names if node.module != room
                }
                hidden |= {f"{room}.{name}" for name in names} & modules
    assert hidden == set()


def find_unread(function: ast.FunctionDef) -> set[str]:
    """Parameters that the body never mentions; those of a protocol or an abstract method have no
    body to read them.
    """
    body = [
        line
        for line in function.body
        if not (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant))
    ]
    if (
        not body
        or isinstance(body[0], ast.Raise)
        or any(isinstance(mark, ast.Name) for mark in function.decorator_list)
    ):
        return set()
    asked = {
        arg.arg
        for arg in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)
    }
    read = {node.id for line in body for node in ast.walk(line) if isinstance(node, ast.Name)}
    return {name for name in asked - read if not name.startswith("_")} - {"self", "cls"} - GIVEN


def list_functions(path: Path) -> Iterator[ast.FunctionDef]:
    """Public functions and methods of a file."""
    for scope in ast.walk(ast.parse(path.read_text())):
        if isinstance(scope, ast.Module | ast.ClassDef):
            for node in scope.body:
                if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                    yield node


def test_every_public_parameter_is_read():
    unread = {
        f"{name_module(path)}.{function.name}": find_unread(function)
        for path in FILES
        for function in list_functions(path)
    }
    assert {name: parameters for name, parameters in unread.items() if parameters} == {}


def list_constants() -> dict[str, set[str]]:
    """By name, the modules that give a public constant a meaning; rows of an engine's table are
    read through their module (``f.N_OBJECT``).
    """
    homes: dict[str, set[str]] = defaultdict(set)
    for path in (path for path in FILES if path.name != "fields.py"):
        for node in ast.parse(path.read_text()).body:
            targets = node.targets if isinstance(node, ast.Assign) else []
            targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
            for part in (inner for target in targets for inner in ast.walk(target)):
                if isinstance(part, ast.Name) and part.id.isupper() and part.id[0] != "_":
                    homes[part.id].add(name_module(path))
    return homes


def test_no_public_constant_has_two_meanings():
    """One that is read in its own file alone begins with an underscore."""
    assert {
        name: sorted(homes) for name, homes in list_constants().items() if len(homes) > 1
    } == {}
