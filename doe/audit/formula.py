"""Formulas that a publication states, evaluated on printed numbers: +, −, ×, /, powers and a few functions.

The text comes from a file, so nothing but arithmetic on named numbers is carried out.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping

from doe.errors import AuditError

LONGEST = 200
FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "atan": math.atan,
    "radians": math.radians,
    "degrees": math.degrees,
    "log": math.log,
    "exp": math.exp,
    "abs": abs,
}
OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: math.pow(a, b),
}


def names_in(formula: str) -> tuple[str, ...]:
    """Names of the numbers that a formula asks for, in order of appearance. Raises AuditError if it is not one."""
    nodes = list(ast.walk(_parsed(formula)))
    called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
    found = (node.id for node in nodes if isinstance(node, ast.Name) and id(node) not in called)
    names = tuple(dict.fromkeys(name for name in found if name != "pi"))
    evaluated(formula, dict.fromkeys(names, 1.0))  # refuses what is no arithmetic before any number is looked up
    return names


def evaluated(formula: str, numbers: Mapping[str, float]) -> float:
    """Value of a formula such as ``E / (2 * G) - 1``; NaN where it is undefined (a division by zero, a root of −1).

    Raises AuditError for anything that is not arithmetic on ``numbers``, ``pi`` and ``FUNCTIONS``.
    """
    tree = _parsed(formula)
    try:
        return _value(tree.body, {"pi": math.pi} | dict(numbers), formula)
    except (ZeroDivisionError, OverflowError):
        return math.nan
    except AuditError:
        raise
    except ValueError:
        return math.nan


def _parsed(formula: str) -> ast.Expression:
    if len(formula) > LONGEST:
        raise AuditError(f"formula of {len(formula)} characters; allowed are up to {LONGEST}")
    try:
        return ast.parse(formula.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise AuditError(f"formula {formula!r} cannot be read; allowed: {_allowed()}") from None


def _value(node: ast.expr, numbers: Mapping[str, float], formula: str) -> float:
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as number):
            return float(number)
        case ast.Name(id=name):
            if name in numbers:
                return numbers[name]
            raise AuditError(f"formula {formula!r}: {name!r} is not among {', '.join(sorted(numbers))}")
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, numbers, formula)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _value(operand, numbers, formula)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATIONS:
            return OPERATIONS[type(op)](_value(left, numbers, formula), _value(right, numbers, formula))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](_value(argument, numbers, formula))
        case _:
            pass
    raise AuditError(f"formula {formula!r}: {ast.unparse(node)!r} is not arithmetic; allowed: {_allowed()}")


def _allowed() -> str:
    return f"numbers, columns, + - * / **, brackets, pi, {', '.join(FUNCTIONS)}"
