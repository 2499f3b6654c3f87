"""Parameters of a campaign that differ between joints or wheelsets."""

from __future__ import annotations

from pathlib import Path

import pytest

from railui.campaign.campaign import Campaign, load_campaign
from railui.documents.saving import save_campaign, save_design
from railui.io.problems import FileProblems

COACH = Path(__file__).parents[2] / "designs/manchester_coach.yaml"
DAMPING, CONICITY = "vehicle.elements.lateral_damper.lateral_damping", "contact.wheels.conicity"


def campaign(folder: Path, text: str, vehicle: Path = COACH) -> Path:
    for name in ("a.csv", "b.csv"):
        (folder / name).write_text("t [s], v [m/s], yw [m], e1 [m]\n0, 40, 0, 0\n")
    path = folder / "campaign.yaml"
    path.write_text(
        f"vehicle: {vehicle}\nruns: [{{file: a.csv, role: adjust}}, {{file: b.csv, role: validate}}]\n{text}\n"
    )
    return path


def estimated(folder: Path, text: str) -> tuple[str, ...]:
    return load_campaign(campaign(folder, text)).estimated_parameters


def test_a_freed_number_is_estimated_at_each_joint(tmp_path: Path) -> None:
    before, paths = estimated(tmp_path, ""), estimated(tmp_path, f"free: [{DAMPING}]")
    assert {f"{DAMPING}.1", f"{DAMPING}.2"} == set(paths) - set(before) and set(before) - set(paths) == {DAMPING}


def test_a_freed_group_is_its_estimated_numbers(tmp_path: Path) -> None:
    paths = estimated(tmp_path, f"adjust: [{CONICITY}, contact.wheels.roll, {DAMPING}]\nfree: [contact.wheels]")
    assert paths == (*(f"contact.wheels.{k}.{n}" for k in ("conicity", "roll") for n in (1, 2, 3, 4)), DAMPING)


def test_a_freed_number_need_not_be_estimated_otherwise(tmp_path: Path) -> None:
    paths = estimated(tmp_path, f"adjust: [{DAMPING}]\nfree: [{CONICITY}]")
    assert paths == (DAMPING, *(f"{CONICITY}.{n}" for n in (1, 2, 3, 4)))


def test_a_written_campaign_keeps_its_freed_numbers(tmp_path: Path) -> None:
    first: Campaign = load_campaign(campaign(tmp_path, f"free: [{DAMPING}, {CONICITY}]"))
    save_design(first.design, tmp_path / "freed.yaml")
    again = load_campaign(save_campaign(first, tmp_path / "again.yaml", tmp_path / "freed.yaml"))
    assert again.estimated_parameters == first.estimated_parameters and again.design.values == first.design.values


def test_a_written_campaign_frees_numbers_of_its_undivided_design(tmp_path: Path) -> None:
    first: Campaign = load_campaign(campaign(tmp_path, f"adjust: [{DAMPING}]\nfree: [{CONICITY}]"))
    again = load_campaign(save_campaign(first, tmp_path / "again.yaml"))
    assert again.estimated_parameters == first.estimated_parameters and again.design.values == first.design.values
    assert again.freed == first.freed == (CONICITY,)


@pytest.mark.parametrize(
    ("free", "says", "remedy"),
    [
        ("[contact.wheel.conicity]", "no such parameter 'contact.wheel.conicity'", CONICITY),
        ("[contact.spin_creep]", "belongs to one joint", ""),
        ("[vehicle.bodies.body.mass]", "belongs to one joint", ""),
        ("[vehicle.elements.primary.y]", "belongs to one joint", "vehicle.elements.primary"),
        (
            "[vehicle.elements.anti_roll_bar]",
            "no number of 'vehicle.elements.anti_roll_bar'",
            "anti_roll_bar.stiffness",
        ),
        (CONICITY, "is not a list", ""),
    ],
)
def test_a_wrong_path_is_reported_with_its_place(tmp_path: Path, free: str, says: str, remedy: str) -> None:
    with pytest.raises(FileProblems) as caught:
        estimated(tmp_path, f"free: {free}")
    (problem,) = caught.value.problems
    assert says in problem.message and remedy in problem.remedy and problem.line == 3


def test_yaw_dampers_on_their_mountings_are_estimated_by_default(tmp_path: Path) -> None:
    vehicle = COACH.with_name("bogie_under_coach.yaml")
    paths = load_campaign(campaign(tmp_path, "", vehicle)).estimated_parameters
    assert [p for p in paths if p.endswith(".damping")] == ["vehicle.elements.yaw_damper.damping"]


def test_a_bogie_frees_nothing(tmp_path: Path) -> None:
    with pytest.raises(FileProblems, match="a bogie has no numbers that several joints share"):
        load_campaign(campaign(tmp_path, "free: [contact.leading.conicity]", COACH.with_name("test_bogie.yaml")))
