"""The plan view: every part once, sensors at their places, effects where they act, labels that do not overlap."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import pytest

from railui.campaign.campaign import load_campaign
from railui.report.schematic.axis import longitudinal_axis
from railui.report.schematic.end_view import HALF_WIDTH, SCALE, EndView
from railui.report.schematic.equivalent import drawn_topology
from railui.report.schematic.highlights import Highlight
from railui.report.schematic.labels import GAP, Label, place_labels
from railui.report.schematic.places import Places, joint_key
from railui.report.schematic.plan import draw_schematic
from railui.report.schematic.subjects import schematic_of_campaign, schematic_of_design, schematic_of_report
from railui.runs.run import load_run
from railui.vehicle.design import Design
from railui.vehicle.design_reader import load_design, parse_design

DESIGNS = Path(__file__).parents[3] / "designs"
NAMES = ("test_bogie", "cooperrider", "bogie_under_coach", "manchester_coach", "profiled_bogie", "check_bogie")
COACH_CAMPAIGN, BOGIE_CAMPAIGN = DESIGNS / "campaigns/worn_centre_guide", DESIGNS / "campaigns/worn_axle_box"
SVG = "{http://www.w3.org/2000/svg}"
# a two-axle wagon with a bolster, rods, a stop along it, one element on one side, and a damper in yaw to the ground
WAGON = """
vehicle:
  bodies:
    frame: {mass: 3000, yaw_inertia: 3000}
    bolster: {mass: 500}
    body: {mass: 9000, yaw_inertia: 9e4, roll_inertia: 9e3, height: 1.6}
  elements:
    wheelset: {kind: wheelset, under: frame, half_wheelbase: 1.1, mass: 1000, yaw_inertia: 700, rolling_radius: 0.4,
               wheel_load: 45 kN}
    primary: {kind: spring, between: [wheelset, frame], y: 1.0, lateral_stiffness: 3e6, longitudinal_stiffness: 3e6}
    rod: {kind: link, between: [frame, bolster], x: 0.2, y: 0.9, x_to: 0.8, y_to: 0.9, stiffness: 5e6}
    swing: {kind: spring, between: [frame, bolster], y: 0.8, lateral_stiffness: 2e5}
    end_stop: {kind: stop, between: [frame, bolster], y: 0.5, side: left, direction: longitudinal, gap: 0.01,
               stiffness: 1e6}
    centre: {kind: spring, between: [bolster, body], height: 0.9, lateral_stiffness: 1e7, roll_stiffness: 1e6}
    drag: {kind: damper, between: [body, ground], height: 0.9, yaw_damping: 1e4}
contact:
  wheels: {conicity: 0.1, longitudinal_creep: 140, lateral_creep: 125, gravitational_stiffness: 6}
"""


def designs() -> list[Design]:
    return [*(load_design(DESIGNS / f"{name}.yaml") for name in NAMES), parse_design(WAGON)]


def campaign_svg(folder: Path) -> tuple[str, list[str]]:
    campaign = load_campaign(folder)
    runs = [load_run(entry.file, campaign.design.run_form) for entry in campaign.runs]
    return schematic_of_campaign(campaign, [name for run in runs for name in run.columns]), list(runs[0].columns)


def groups(svg: str, style: str) -> list[ElementTree.Element]:
    return [g for g in ElementTree.fromstring(svg).iter(f"{SVG}g") if g.get("class") == style and g.get("data-key")]


def keys(svg: str, style: str) -> list[str]:
    return [str(g.get("data-key")) for g in groups(svg, style)]


def texts(svg: str, style: str) -> list[str]:
    return [str(t.text) for t in ElementTree.fromstring(svg).iter(f"{SVG}text") if t.get("class") == style]


@pytest.mark.parametrize("design", designs(), ids=lambda d: d.name)
def test_every_element_is_drawn_and_labelled_once(design: Design) -> None:
    structure, _ = drawn_topology(design)
    svg = schematic_of_design(design)
    assert sorted(keys(svg, "element")) == sorted(joint_key(joint) for joint in structure.joints)
    parts = {part.name.replace("_", " ") for part in structure.elements if part.kind != "wheelset"}
    assert Counter(texts(svg, "name")) == Counter(parts)
    assert keys(svg, "wheelset") == [wheelset.name for wheelset in structure.wheelsets]
    assert texts(svg, "number") == [str(wheelset.number) for wheelset in structure.wheelsets]


@pytest.mark.parametrize("design", designs(), ids=lambda d: d.name)
def test_a_vehicle_whose_bodies_roll_is_drawn_from_behind_too(design: Design) -> None:
    structure, values = drawn_topology(design)
    svg, rolls = schematic_of_design(design), any(m.has_rotation("roll") for m in structure.members.values())
    parts = {part.name.replace("_", " ") for part in structure.elements if part.kind != "wheelset"}
    labels = Counter(text for text in texts(svg, "end") if text in parts)
    assert labels == (Counter(parts) if rolls else Counter())
    assert ("from behind" in svg) == rolls
    if rolls:
        drawn = EndView(Places(structure, values))
        boxes = [box for level in drawn.occupied.values() for box in level]
        assert all(abs(box.x) + box.half_width <= HALF_WIDTH * SCALE for box in boxes)
        for level in drawn.occupied.values():
            assert not any(one.overlaps(other) for one in level for other in level if one is not other)


@pytest.mark.parametrize("folder", [COACH_CAMPAIGN, BOGIE_CAMPAIGN], ids=lambda folder: folder.name)
def test_every_sensor_of_a_campaign_has_one_marker_and_one_label(folder: Path) -> None:
    svg, columns = campaign_svg(folder)
    measured = sorted(set(columns) - {"t", "s", "v", "yw", "phiw", "gauge"})
    assert measured and sorted(keys(svg, "sensor")) == measured
    labels = Counter(texts(svg, "sensor"))
    assert all(labels[name] == 1 for name in measured)


def marker(svg: str, name: str) -> tuple[float, float]:
    (group,) = [g for g in groups(svg, "sensor") if g.get("data-key") == name]
    move = next(str(g.get("transform")) for g in group.iter(f"{SVG}g") if g.get("transform"))
    x, y = re.findall(r"-?\d+\.\d+", move)
    return float(x), float(y)


def test_a_sensor_stands_where_it_is_mounted() -> None:
    svg, _ = campaign_svg(COACH_CAMPAIGN)
    x = {name: marker(svg, name)[0] for name in keys(svg, "sensor")}
    rank = ["ay4", "ay_rear", "ay3", "floor_middle", "ay2", "ay_front", "ay1"]
    assert sorted(rank, key=x.__getitem__) == rank
    assert abs(x["floor_front"] - x["swing_front"]) < 70 and abs(x["rf_rear"] - x["ay_rear"]) < 70
    design = load_campaign(COACH_CAMPAIGN).design
    right = draw_schematic(design, ["floor_front"], lateral={"floor_front": 1.2}).svg()
    left = draw_schematic(design, ["floor_front"], lateral={"floor_front": -1.2}).svg()
    assert marker(right, "floor_front")[1] > marker(left, "floor_front")[1] + 200


def halos(design: Design, at: str, number: int | None, channels: tuple[str, ...] = ()) -> list[tuple[float, float]]:
    """Return the middles of what is highlighted."""
    svg = draw_schematic(design, channels, [Highlight(at, number, "the effect")]).svg()
    assert texts(svg, "effect") == ["the effect"]
    rects = [r for g in groups(svg, "halo") for r in g.iter(f"{SVG}rect")]
    sizes = [[float(str(r.get(key))) for key in ("x", "y", "width", "height")] for r in rects]
    return [(x + w / 2, y + h / 2) for x, y, w, h in sizes]


def test_the_place_of_an_effect_is_highlighted() -> None:
    coach = load_design(DESIGNS / "manchester_coach.yaml")
    svg = schematic_of_design(coach)
    axles = [float(str(g.find(f"{SVG}circle").get("cx"))) for g in groups(svg, "wheelset")]  # type: ignore[union-attr]
    third = halos(coach, "primary_lateral", 3)
    assert [x for x, _ in third] == pytest.approx([axles[2]] * 2) and third[0][1] != third[1][1]
    assert len(halos(coach, "primary_lateral", None)) == 8
    assert {x for x, _ in halos(coach, "contact", 2)} == {axles[1]}
    assert [x for x, _ in halos(coach, "wheelset_yaw", 4)] == pytest.approx([axles[3]])
    rear = halos(coach, "frame_yaw", 2)
    assert len(rear) == 1 and axles[3] < rear[0][0] < axles[2]
    front = halos(coach, "secondary_lateral", 1)
    assert len(front) == 2 and all(axles[1] < x < axles[0] for x, _ in front)
    assert len(halos(coach, "ay1", None, ("ay1",))) == 1
    bogie = load_design(DESIGNS / "test_bogie.yaml")
    assert len(halos(bogie, "primary_lateral", 1)) == 2 and len(halos(bogie, "secondary_yaw", None)) >= 1


def test_an_effect_without_a_place_is_only_described() -> None:
    svg = draw_schematic(load_design(DESIGNS / "test_bogie.yaml"), (), [Highlight("ay1", None, "gain of <ay1>")]).svg()
    assert keys(svg, "halo") == [] and texts(svg, "effect") == []
    description = ElementTree.fromstring(svg).find(f"{SVG}desc")
    assert description is not None and "gain of <ay1>" in str(description.text)


@pytest.mark.parametrize(("at", "expected"), [(None, False), ("secondary_yaw", True)])
def test_only_a_located_discrepancy_is_highlighted(at: str | None, expected: bool) -> None:
    """A discrepancy on a single channel, or one whose locations cannot be separated, has no location."""
    campaign = load_campaign(BOGIE_CAMPAIGN)
    report = {"effects": [], "outside": {"at": at, "wheelset": None}}
    picture = schematic_of_report(campaign.design, campaign, ["t", "v", "yw", "ayf"], report)
    assert ("highlighted: discrepancy" in picture.alt) == expected


def test_every_location_of_a_discrepancy_is_highlighted() -> None:
    campaign = load_campaign(BOGIE_CAMPAIGN)
    locations = [{"at": at, "wheelset": None} for at in ("frame", "primary_lateral")]
    report = {"effects": [], "outside": {"at": None, "wheelset": None, "locations": locations}}
    picture = schematic_of_report(campaign.design, campaign, ["t", "v", "yw", "ayf"], report)
    one = report | {"outside": {"at": None, "wheelset": None, "locations": locations[1:]}}
    fewer = schematic_of_report(campaign.design, campaign, ["t", "v", "yw", "ayf"], one)
    halos = [len(keys(p.svg.decode("utf-8"), "halo")) for p in (picture, fewer)]
    assert halos[0] > halos[1] > 0


def test_a_picture_has_a_title_and_stands_alone() -> None:
    svg, _ = campaign_svg(COACH_CAMPAIGN)
    root = ElementTree.fromstring(svg)
    assert root.get("role") == "img" and "seen from above" in str(root.findtext(f"{SVG}title"))
    assert "secondary 2: spring between frame 2 and body" in str(root.findtext(f"{SVG}desc"))
    assert "http" not in svg.replace("http://www.w3.org/2000/svg", "")
    assert svg == campaign_svg(COACH_CAMPAIGN)[0]


def test_labels_overlap_neither_each_other_nor_leader_lines() -> None:
    labels = [Label("x" * (3 + 5 * (i % 4)), 17.0 * (i // 2), 0.0, "name") for i in range(40)]
    placed = place_labels(labels)
    assert len(placed) == len(labels)
    for one in placed:
        for other in placed:
            if one is not other and one.x <= other.x < one.x + one.label.width + GAP:
                assert other.row < one.row  # its line ends before it reaches this text


@pytest.mark.parametrize("folder", [COACH_CAMPAIGN, BOGIE_CAMPAIGN], ids=lambda folder: folder.name)
def test_symbols_of_bundled_campaigns_do_not_cover_each_other(folder: Path) -> None:
    svg, _ = campaign_svg(folder)
    places = [marker(svg, name) for name in keys(svg, "sensor")]
    assert all(abs(a[0] - b[0]) >= 14 or abs(a[1] - b[1]) >= 14 for a in places for b in places if a is not b)


def test_only_the_length_between_bogies_is_shortened() -> None:
    axis = longitudinal_axis([10.78, 8.22, -8.22, -10.78])
    assert axis(10.78) - axis(8.22) == pytest.approx(2.56) and len(axis.breaks) == 1
    assert axis(8.22) > axis(3.0) > axis(0.0) > axis(-8.22)
    assert longitudinal_axis([1.28, -1.28]).breaks == []


def test_a_rig_is_drawn_with_its_effects_and_sensors() -> None:
    rig = parse_design(
        "vehicle: {rig: {mass: 95, gain: 2}}\neffects: [{kind: dry_friction, at: rig, force: 3, slip_speed: 1}]"
    )
    svg = schematic_of_design(rig)
    assert keys(svg, "element") == ["stiffness", "damping"] and keys(svg, "halo") == ["rig"]
    assert texts(svg, "effect") == ["dry friction, force 3"] and "mass" in texts(svg, "body")
    late = draw_schematic(rig, ["t", "u", "z", "az"], [Highlight("az", None, "time delay")]).svg()
    assert keys(late, "sensor") == ["u", "z", "az"] and keys(late, "halo") == ["az"]
    component, columns = campaign_svg(DESIGNS / "campaigns/mr_damper")
    assert "mass" not in texts(component, "body") and set(keys(component, "sensor")) == set(columns) - {"t"}
