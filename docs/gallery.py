"""Hook of the documentation site: run every example and show its code, its words and its picture."""

import ast
import contextlib
import io
import runpy
from pathlib import Path
from tempfile import TemporaryDirectory

from mkdocs.structure.files import File

EXAMPLES = Path(__file__).parent.parent / "examples"
INTRODUCTION = "# Gallery\n\nEach example was run when this page was built; what it printed stands below its picture.\n"


def on_files(files, config):
    """Add ``gallery.md`` and the pictures to the site."""
    page = [INTRODUCTION]
    with TemporaryDirectory() as folder:
        for path in sorted(EXAMPLES.glob("*.py")):
            words = _run(path, Path(folder))
            picture = f"gallery/{path.stem}.png"
            files.append(File.generated(config, picture, content=(Path(folder) / f"{path.stem}.png").read_bytes()))
            page.append(_write_entry(path, picture, words))
    files.append(File.generated(config, "gallery.md", content="\n".join(page)))
    return files


def _run(path: Path, folder: Path) -> str:
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        runpy.run_path(str(path))["main"](folder)
    return printed.getvalue().strip()


def _write_entry(path: Path, picture: str, words: str) -> str:
    code = path.read_text()
    title = ast.get_docstring(ast.parse(code))
    name = path.stem.replace("_", " ").capitalize()
    return f"## {name}\n\n{title}\n\n![{title}]({picture})\n\n```text\n{words}\n```\n\n```python\n{code}```\n"
