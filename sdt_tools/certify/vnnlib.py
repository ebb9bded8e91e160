"""VNN-LIB files: a domain as other verifiers read it, and such files read back.

A file states what would be a counterexample, so its polarity is the opposite of the property's: ``sat`` means that a
scan of the domain is answered with a forbidden class (or ties with one), ``unsat`` that none is. Inputs ``X_0`` to
``X_540`` are ranges in metres, outputs ``Y_0`` to ``Y_6`` the logits.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from jaxtyping import Float, Float64

from sdt_tools.errors import ConfigError
from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.intervals import split_classes

_CLASSES: Final = len(MotionClass)
_TOKEN: Final = re.compile(r"[()]|[^\s()]+")
_NUMBER: Final = re.compile(r"-?\d+(\.\d+)?")
_VARIABLE: Final = re.compile(r"([XY])_(0|[1-9]\d*)")
_AT_LEAST: Final = ">="
_AT_MOST: Final = "<="


@dataclass(frozen=True)
class _Branch:
    """Parentheses and what is in them; ``line`` is where they open."""

    parts: tuple["_Tree", ...]
    line: int


@dataclass(frozen=True)
class _Leaf:
    text: str
    line: int


_Tree: TypeAlias = _Branch | _Leaf


@dataclass(frozen=True, eq=False)
class Query:
    """A file's content: is there a scan within the bounds whose logits fulfil one of ``cases`` whole?

    A case is a conjunction of pairs (a, b), each meaning logit a ≥ logit b.
    """

    lower_m: Float64[np.ndarray, "rays"]
    upper_m: Float64[np.ndarray, "rays"]
    cases: tuple[tuple[tuple[int, int], ...], ...]

    def asks_for(self, scan_m: Float64[np.ndarray, "rays"], logits: Float[np.ndarray, "classes"]) -> bool:
        """Whether a scan and a network's answer to it are a counterexample in the sense of the file."""
        inside = bool(np.all((self.lower_m <= scan_m) & (scan_m <= self.upper_m)))
        return inside and any(all(logits[a] >= logits[b] for a, b in case) for case in self.cases)


def vnnlib_text(boxes: DomainSet, domain: int) -> str:
    """One domain as VNN-LIB 1.0. Numbers are written so that they read back exactly."""
    kept, forbidden = split_classes(boxes.allowed)
    allowed_names = ", ".join(f"Y_{index} {MotionClass(index).label}" for index in kept)
    forbidden_names = ", ".join(f"Y_{index} {MotionClass(index).label}" for index in forbidden)
    lines = [
        f"; {' '.join(boxes.name.split())}, domain {domain}, ray {boxes.rays[domain]}",
        "; Polarity: this asks for a COUNTEREXAMPLE. sat: a forbidden class is at least as high as all allowed ones",
        "; somewhere in the box (violated). unsat: nowhere (certified).",
        "; X_i: range of ray i in metres, invalid codes resolved, before clipping and scaling.",
        f"; allowed: {allowed_names}",
        f"; forbidden: {forbidden_names}",
        *(f"(declare-const X_{ray} Real)" for ray in range(RAYS)),
        *(f"(declare-const Y_{index} Real)" for index in range(_CLASSES)),
    ]
    for ray, (lower, upper) in enumerate(zip(boxes.lower_m[domain], boxes.upper_m[domain], strict=True)):
        lines += [f"(assert (<= X_{ray} {_decimal(upper)}))", f"(assert (>= X_{ray} {_decimal(lower)}))"]
    cases = (" ".join(f"(>= Y_{wrong} Y_{right})" for right in kept) for wrong in forbidden)
    lines += ["(assert (or", *(f"    (and {case})" for case in cases), "))"]
    return "\n".join(lines) + "\n"


def read_vnnlib(path: Path) -> Query:
    """Read a file of the kind that ``vnnlib_text`` writes.

    Strict: every ray is declared and bounded once from each side, every class declared, and one assertion speaks of the
    outputs. Raises ConfigError, naming file and line, for anything else.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}; check path and rights") from None
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: not a text file: {error}") from None
    try:
        return _query(_trees(text))
    except _MalformedError as error:
        raise ConfigError(f"{path}: {error}; export the domains again") from None


def _decimal(number: float) -> str:
    """The shortest decimal number that reads back as ``number``; the format knows no exponents."""
    return np.format_float_positional(number, unique=True, trim="0")


class _MalformedError(Exception):
    """What is wrong with a text, and on which line."""


def _trees(text: str) -> Iterator[_Tree]:
    """The expressions of a text, one after the other."""
    open_parts: list[tuple[list[_Tree], int]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        for token in _TOKEN.findall(line.split(";", 1)[0]):
            if token == "(":  # noqa: S105 - a parenthesis
                open_parts.append(([], number))
                continue
            if token == ")":  # noqa: S105
                if not open_parts:
                    raise _MalformedError(f"line {number}: ')' closes nothing")
                parts, began = open_parts.pop()
                tree: _Tree = _Branch(tuple(parts), began)
            else:
                tree = _Leaf(token, number)
            if open_parts:
                open_parts[-1][0].append(tree)
            else:
                yield tree
    if open_parts:
        raise _MalformedError(f"line {open_parts[0][1]}: '(' is never closed")


def _query(trees: Iterator[_Tree]) -> Query:
    declared: set[str] = set()
    bounds: dict[str, dict[int, float]] = {_AT_LEAST: {}, _AT_MOST: {}}
    cases: tuple[tuple[tuple[int, int], ...], ...] | None = None
    for tree in trees:
        match _words(tree):
            case ["declare-const", _Leaf(name), _Leaf("Real")] if _VARIABLE.fullmatch(name) and name not in declared:
                declared.add(name)
            case ["assert", _Branch((_Leaf(side), _Leaf(name), _Leaf(value)), line)] if side in bounds:
                ray = _index(name, "X", declared, line)
                if ray in bounds[side]:
                    raise _MalformedError(f"line {line}: X_{ray} has two bounds '{side}'")
                bounds[side][ray] = _number(value, line)
            case ["assert", _Branch((_Leaf("or"), *alternatives), line)] if cases is None and alternatives:
                cases = tuple(_case(alternative, declared) for alternative in alternatives)
            case _:
                raise _MalformedError(f"line {tree.line}: neither a new declaration nor an assertion expected here")
    expected = {f"X_{ray}" for ray in range(RAYS)} | {f"Y_{index}" for index in range(_CLASSES)}
    for name in sorted(expected ^ declared):
        raise _MalformedError(f"{name} is {'not declared' if name in expected else 'one variable too many'}")
    for side, found in bounds.items():
        for ray in sorted(set(range(RAYS)) - found.keys()):
            raise _MalformedError(f"X_{ray} has no bound '{side}'")
    if cases is None:
        raise _MalformedError("no assertion speaks of the outputs")
    lower, upper = ([bounds[side][ray] for ray in range(RAYS)] for side in (_AT_LEAST, _AT_MOST))
    return Query(np.array(lower), np.array(upper), cases)


def _words(tree: _Tree) -> list[object]:
    """The parts of an expression, the first as text where it is a word."""
    if isinstance(tree, _Leaf) or not tree.parts:
        return []
    head, *rest = tree.parts
    return [head.text if isinstance(head, _Leaf) else head, *rest]


def _case(tree: _Tree, declared: set[str]) -> tuple[tuple[int, int], ...]:
    match _words(tree):
        case ["and", *comparisons] if comparisons:
            return tuple(_comparison(one, declared, tree.line) for one in comparisons)
    raise _MalformedError(f"line {tree.line}: an alternative that is no '(and …)'")


def _comparison(tree: object, declared: set[str], line: int) -> tuple[int, int]:
    match tree:
        case _Branch((_Leaf(">="), _Leaf(left), _Leaf(right)), at):
            return _index(left, "Y", declared, at), _index(right, "Y", declared, at)
    raise _MalformedError(f"line {line}: a comparison of outputs that is no '(>= Y_a Y_b)'")


def _index(name: str, kind: str, declared: set[str], line: int) -> int:
    found = _VARIABLE.fullmatch(name)
    if found is None or found[1] != kind or name not in declared:
        raise _MalformedError(f"line {line}: '{name}' is no declared {kind}")
    return int(found[2])


def _number(text: str, line: int) -> float:
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise _MalformedError(f"line {line}: '{text}' is no decimal number")
    return float(text)
