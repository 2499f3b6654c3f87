"""How the desk writes a parameter: its symbol, its value, its usual range."""

from __future__ import annotations

from railui.desk.state.draft import Field
from railui.io.number_format import display, pretty

GREEK = {"lambda": "λ", "kappa": "κ", "epsilon": "ε", "delta": "δ", "sigma": "σ", "psi": "ψ", "phi": "φ"}
LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def symbol(text: str) -> str:
    """A symbol as it is printed.

    >>> symbol("kappa_x_1"), symbol("c_spsi"), symbol("I_zb")
    ('κ_x₁', 'c_sψ', 'I_zb')
    """
    for name, letter in GREEK.items():
        text = text.replace(name, letter)
    for digit in "0123456789":
        text = text.replace(f"_{digit}", digit.translate(LOWERED))
    return text


def value_text(field: Field) -> str:
    """The value as one would write it by hand."""
    if field.value is None:
        return "-"
    if isinstance(field.value, bool):
        return "yes" if field.value else "no"
    if isinstance(field.value, str):
        return field.value.replace("_", " ") if field.choices else field.value
    return pretty(display(field.value, field.unit))


def range_text(field: Field) -> str:
    """The usual range in words."""
    if field.choices:
        return " / ".join(str(c).lower() for c in field.choices)
    if isinstance(field.value, str):
        return ""
    return pretty(f"{display(field.low, field.unit, 5)} to {display(field.high, field.unit, 5)}")
