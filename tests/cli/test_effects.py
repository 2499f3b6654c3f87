"""railui effects: the library as numbers."""

from __future__ import annotations

import pytest

from tests.cli.runner import document, run


def test_every_parameter_of_the_library_has_default_and_range() -> None:
    effects = {e["kind"]: e for e in document(run("effects", "--json", "-"))["effects"]}
    assert {"kind", "title", "at", "source", "parameters"} <= set(effects["free_play"])
    for effect in effects.values():
        for p in effect["parameters"]:
            assert {"key", "symbol", "unit", "default", "minimum", "maximum", "origin"} <= set(p)
            assert all(isinstance(p[key], float) for key in ("default", "minimum", "maximum")), (effect["kind"], p)
    half_width = effects["free_play"]["parameters"][0]
    assert (half_width["unit"], half_width["default"]) == ("m", pytest.approx(3e-4))
    assert effects["spring"]["parameters"][0]["maximum"] == pytest.approx(100 * 0.2e6)


def test_one_effect_is_printed_with_ranges_origins_and_source() -> None:
    found = run("effects", "free_play")
    assert found.exit_code == 0 and "half_width" in found.stdout and "source: " in found.stdout
    assert "bump_stop" not in found.stdout
    assert [e["kind"] for e in document(run("effects", "free_play", "--json", "-"))["effects"]] == ["free_play"]
    wrong = run("effects", "freeplay")
    assert wrong.exit_code == 2 and "did you mean 'free_play'?" in wrong.stderr
