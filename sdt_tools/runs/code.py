"""What code a unit of work depends on: its module, and all of the package that it imports, directly or not."""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from sdt_tools import __version__

_PACKAGE = Path(__file__).parents[1]


@cache
def code_version(module: str | None = None) -> str:
    """The package's version and a short hash of source files, as in ``0.1.0+3f2a9c1b``.

    With a ``module`` of the package, the hash is of that and of whatever it imports, in functions too; without one, or
    for a module from elsewhere, of the whole package. Data files of the package always count.
    """
    digest = hashlib.sha256()
    sources = set(_PACKAGE.rglob("*.py")) if module is None or _source(module) is None else _closure(module)
    for file in sorted([*sources, *_PACKAGE.rglob("*.toml")]):
        digest.update(str(file.relative_to(_PACKAGE)).encode() + b"\0" + file.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:8]}"


def _closure(module: str) -> set[Path]:
    found: set[Path] = set()
    open_modules = [module]
    while open_modules:
        source = _source(open_modules.pop())
        if source is not None and source not in found:
            found.add(source)
            open_modules += _imported(source)
    return found


@cache
def _imported(source: Path) -> tuple[str, ...]:
    return tuple(_names(ast.parse(source.read_text(encoding="utf-8"))))


def _names(tree: ast.Module) -> Iterator[str]:
    """Every name that an import may mean a module by; those that are none are sorted out later."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _source(module: str) -> Path | None:
    """The file of a module of this package; None for any other name."""
    root, *steps = module.split(".")
    if root != _PACKAGE.name:
        return None
    path = _PACKAGE.joinpath(*steps)
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None
