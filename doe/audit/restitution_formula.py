"""Whether the formula of a restitution test gives back the restitution that was put in.

A body falls freely by `fall` on a plate inclined by α, leaves it and lands `landing` lower. Across the plate its speed
is reversed and multiplied by e, along the plate by k: 1 on a frictionless plate, 5/7 for a solid sphere that rolls
off, 0 where it sticks. With v = √(2 g fall) the speed after the impact is
    horizontal  vx = v sin α cos α (k + e),    upward  vy = v (e cos² α − k sin² α),
and the flight lasts t with landing = −vy t + g t²/2, so L = vx t. On a 45° plate the rebound is horizontal for k = e
only, and only then is L/(2 H) the restitution. Rigid point impact; no air drag.

A formula may use L (horizontal distance), H (fall), h (landing), v (impact speed), vx, vy, t and g; SI. It is evaluated
on printed numbers: +, −, ×, /, powers and a few functions. The text comes from a file, so nothing but arithmetic on
named numbers is carried out.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from doe.audit.finding import Figure, Finding, short
from doe.audit.study import DropTest
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
GRAVITY = 9.81
"""[m/s²]."""
TANGENTIAL = {"frictionless plate": 1.0, "solid sphere that rolls off": 5.0 / 7.0}
"""What k may be, in words; a body that sticks is between."""
TOLERANCE = 0.01
"""A formula that misses e by less than this, relative, gives it back: the scatter of such tests is larger."""


@dataclass(frozen=True)
class Flight:
    """What can be measured after one impact, SI."""

    distance: float
    fall: float
    landing: float
    impact_speed: float
    vx: float
    vy: float
    time: float

    def numbers(self) -> dict[str, float]:
        """By the names of a formula."""
        return {
            "L": self.distance,
            "H": self.fall,
            "h": self.landing,
            "v": self.impact_speed,
            "vx": self.vx,
            "vy": self.vy,
            "t": self.time,
            "g": GRAVITY,
        }


def flight(restitution: float, tangential: float, angle_deg: float, fall: float, landing: float) -> Flight:
    """Flight after an impact with normal restitution e and tangential ratio k on a plate inclined by `angle_deg`."""
    angle, v = math.radians(angle_deg), math.sqrt(2 * GRAVITY * fall)
    vx = v * math.sin(angle) * math.cos(angle) * (tangential + restitution)
    vy = v * (restitution * math.cos(angle) ** 2 - tangential * math.sin(angle) ** 2)
    time = (vy + math.sqrt(vy**2 + 2 * GRAVITY * landing)) / GRAVITY
    return Flight(vx * time, fall, landing, v, vx, vy, time)


def check_drop_test(test: DropTest) -> Iterator[Finding]:
    """The formula's answer for the printed restitutions, put in, on plates of different friction."""
    put_in = sorted({one.value for one in test.restitutions})
    landing = test.fall if test.landing is None else test.landing
    worst: tuple[float, float, float, str] = (0.0, put_in[len(put_in) // 2], put_in[len(put_in) // 2], "")
    for words, k in TANGENTIAL.items():
        for e in put_in:
            found = evaluated(test.formula, flight(e, k, test.plate_angle_deg, test.fall, landing).numbers())
            bias = abs(found - e) / e if e else abs(found)
            if not bias <= worst[0]:
                worst = (bias, e, found, words)
    bias, e, found, words = worst
    right = bias <= TOLERANCE
    horizontal = math.tan(math.radians(test.plate_angle_deg)) ** 2
    how = (
        "gives back what is put in, for rebounds of any direction"
        if right
        else f"put in e = {short(e)}, {words}: the formula gives {short(found, 3)}. It holds only for a horizontal "
        f"rebound off the {test.plate_angle_deg:g}° plate, which needs a tangential ratio of e"
        + ("" if abs(horizontal - 1) < 1e-9 else f"/{short(horizontal, 3)}")
        + "; the direction of the rebound is not printed"
    )
    yield Figure(
        "formula of the restitution test",
        test.where,
        f"e = {test.formula}, put in {short(e)}",
        "reproduced exactly" if right else "differs",
        short(e),
        found,
        0.0,
        how,
    )


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
        raise AuditError(f"formula of {len(formula)} characters; allowed: up to {LONGEST}")
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
