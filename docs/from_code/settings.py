"""Page of the loop's settings: thresholds with unit, value, meaning and provenance, from their declarations."""

from markdown_text import code, plain, table

from railui.campaign.settings.declaration import Setting
from railui.campaign.settings.fleet import FLEET_SETTINGS, FleetSettings
from railui.campaign.settings.loop_settings import SETTINGS, LoopSettings

INTRODUCTION = """# Settings of the loop

Thresholds that steer the verdict of `railui loop`. A campaign changes them by name, as a number in the stated unit or with a unit;
`loop.json` records the value of every one under `settings`. Numbers of the methods themselves (windows of spectra, steps of
differences, grids of lags) are constants of their modules. A level of a test (`significance_level`, `run_dependence_level`) that its `bootstrap_draws`
do not resolve, (1 + draws) times the level below 16, is refused.

```yaml
settings:
  significance_level: 0.05
  window_duration: 4 s
```

The provenance says how a value came about: *derived* from theory, *conventional* in statistics, or from a *trial* on simulated
campaigns. Most are chosen by hand. A sensitivity study varies each setting of the loop by 20 % to either side and lists the verdicts and effects that
depend on it (settings of a fleet are not in it): `pytest -m slow tests/identification/test_settings_sensitivity.py`.
Constants of the numerical methods, such as the groups of a jackknife or the least number of merged blocks, are defined next to their code and
are not varied.
"""


def page() -> str:
    """Return one table for each stage of the loop."""
    groups: dict[str, list[Setting]] = {}
    for setting in SETTINGS.values():
        groups.setdefault(setting.group, []).append(setting)
    stages = "".join(_stage(group, settings, getattr(LoopSettings(), group)) for group, settings in groups.items())
    return INTRODUCTION + stages + _stage("settings of a fleet", list(FLEET_SETTINGS.values()), FleetSettings())


def _stage(group: str, settings: list[Setting], values: object) -> str:
    summary = (type(values).__doc__ or "").partition("\n")[0]
    rows = [
        (code(s.name), code(f"{s.default:g}"), code(s.unit), plain(s.meaning), plain(s.provenance)) for s in settings
    ]
    title = group.replace("_", " ").capitalize()
    return f"\n## {title}\n\n{plain(summary)}\n\n{table(('name', 'value', 'unit', 'meaning', 'provenance'), rows)}"
