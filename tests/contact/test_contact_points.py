"""Rigid contact with roll: cones and arcs in closed form, the reference pair, and pairs that do not fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from railui.contact.conicity import equivalent_conicity
from railui.contact.contact_points import find_contacts
from railui.contact.geometry import ContactGeometry
from railui.contact.linearisation import linearise
from railui.contact.profile import Profile, ProfileError
from railui.contact.profile_reader import read_profile
from railui.contact.wheelset_on_track import WheelRailPair
from tests.contact.shapes import coned_wheel, cones, conicity_of_cones, hollow_wheel, reference, round_rail


def near(contacts: ContactGeometry, reach: float) -> slice:
    at = np.flatnonzero(np.abs(contacts.displacement) < reach + 1e-9)
    return slice(at[0], at[-1] + 1)


def test_cones_have_a_rolling_radius_difference_of_twice_the_conicity() -> None:
    # and of a twentieth more, since the axle rolls
    contacts = find_contacts(cones(0.05))
    n, expected = near(contacts, 4e-3), conicity_of_cones(0.05, contacts)
    assert contacts.delta_r[n] == pytest.approx(2 * expected * contacts.displacement[n], rel=1e-3, abs=2e-8)
    assert equivalent_conicity(contacts.displacement, contacts.delta_r).at(3e-3) == pytest.approx(expected, rel=1e-3)


def test_cones_roll_about_the_point_where_their_normals_meet() -> None:
    # phi = -sigma e/b: the axle rises by gamma e on one side and sinks on the other over the distance of the contacts,
    # and its centre lies r above them: sigma = b gamma/(b' - r gamma), b' where they touch
    contacts = find_contacts(cones(0.05))
    result = linearise(contacts, 1e-3)
    pair = contacts.pair
    touching = float(contacts.rail[0, contacts.index_at(0.0)])
    expected = pair.half_distance * 0.05 / (touching - 0.46 * 0.05)
    assert result.roll == pytest.approx(expected, rel=2e-3)
    assert result.contact_angle == pytest.approx(0.05, rel=1e-3)


def test_two_arcs_have_the_conicity_of_wickens() -> None:
    # lambda = gamma R_w/(R_w - R_r) (b + R_r gamma)/(b - r gamma), b the half distance of the contacts
    # epsilon/b = 1/(R_w - R_r) (b + R_r gamma)/(b - r gamma) ... of both wheels and of the roll
    wheel_radius, rail_radius, r = 0.5, 0.3, 0.46
    pair = WheelRailPair(hollow_wheel(wheel_radius), round_rail(rail_radius), radius=r)
    contacts = find_contacts(pair)
    i = contacts.index_at(0.0)
    b, angle = float(contacts.rail[0, i]), float(contacts.angle[0, i])
    expected = angle * wheel_radius / (wheel_radius - rail_radius) * (b + rail_radius * angle) / (b - r * angle)
    assert linearise(contacts, 4e-4).conicity == pytest.approx(expected, rel=0.01)
    assert contacts.angle[1, i] == pytest.approx(angle, abs=1e-6)


def test_both_sides_change_places_with_the_sign_of_the_displacement() -> None:
    contacts = find_contacts(cones(0.05))
    assert contacts.delta_r == pytest.approx(-contacts.delta_r[::-1], abs=1e-8)
    assert contacts.angle[0] == pytest.approx(contacts.angle[1, ::-1], abs=1e-5)
    assert contacts.roll == pytest.approx(-contacts.roll[::-1], abs=1e-8)


def test_unequal_diameters_shift_the_centre_of_cones() -> None:
    # r_1 - r_2 = 2 gamma e + (d_1 - d_2)/2, and of a twentieth less as the axle rolls
    contacts = find_contacts(cones(0.05, diameter_difference=4e-4))
    result = equivalent_conicity(contacts.displacement, contacts.delta_r)
    assert result.centre == pytest.approx(-4e-4 / (4 * 0.05), rel=0.01)
    assert result.at(2e-3) == pytest.approx(conicity_of_cones(0.05, contacts), rel=0.01)


def test_the_inclination_of_the_rail_moves_the_contact_of_a_cone_across_the_head() -> None:
    # the crown of an arc of 0.3 m moves by 0.3/40 with the rail, the contact stays where the slope is that of the cone
    upright, canted = (find_contacts(cones(0.05, inclination=a)) for a in (0.0, np.arctan(1 / 40)))
    assert canted.angle[0, canted.index_at(0.0)] == pytest.approx(upright.angle[0, upright.index_at(0.0)], abs=1e-4)


def test_flange_contact_begins_at_the_end_of_the_clearance() -> None:
    contacts = find_contacts(cones(0.05))
    left, right = contacts.flange_displacements
    assert left is not None and right is not None
    assert left == pytest.approx(-right, abs=2e-5)
    assert contacts.jumps and contacts.jumps[0].wheel in (1, 2)
    assert any(max(jump.angle) > np.pi / 4 and jump.displacement == pytest.approx(right, abs=1.5e-4)
               for jump in contacts.jumps if jump.wheel == 1)  # fmt: skip
    wider = find_contacts(cones(0.05, gauge=1.439))
    assert wider.flange_displacements[1] == pytest.approx(right + 2e-3, abs=1.5e-4)


@pytest.mark.parametrize(("gauge", "conicity"), [(1.432, 0.225), (1.435, 0.181), (1.437, 0.148)])
def test_s1002_on_uic60_has_the_published_conicity(gauge: float, conicity: float) -> None:
    wheel = read_profile(reference("profiles/S1002.prw"), "wheel")
    rail = read_profile(reference("profiles/UIC60.prr"), "rail")
    contacts = find_contacts(WheelRailPair(wheel, rail, gauge=gauge))
    result = equivalent_conicity(contacts.displacement, contacts.delta_r)
    assert result.at(3e-3) == pytest.approx(conicity, abs=0.01)


def test_noise_is_smoothed_away() -> None:
    pair = cones(0.05)
    rng = np.random.default_rng(1)
    rough = replace(pair.wheel, h=pair.wheel.h + 10e-6 * rng.standard_normal(len(pair.wheel.h)))
    smooth = rough.smoothed(5e-3)
    # the end of a head of 300 mm radius feels every wave: a tenth of the noise's effect is left
    errors = []
    for wheel in (rough, smooth):
        contacts = find_contacts(replace(pair, wheel=wheel))
        n = near(contacts, 4e-3)
        errors.append(np.abs(contacts.delta_r[n] - 0.1 * contacts.displacement[n]).max())
    assert errors[1] < 0.4 * errors[0]
    assert rough.roughness() == pytest.approx(10e-6, rel=0.3)


# ---------------------------------------------------------------------------------------------------- what does not fit


def test_a_gauge_too_narrow_for_the_flanges_is_reported() -> None:
    with pytest.raises(ProfileError, match=r"1405 mm.*flange"):
        find_contacts(cones(0.05, gauge=1.405))


def test_a_gauge_too_wide_for_the_wheels_is_reported() -> None:
    with pytest.raises(ProfileError, match=r"no contact at gauge 1630 mm"):
        find_contacts(cones(0.05, gauge=1.63))


def test_exchanged_wheel_and_rail_are_reported() -> None:
    with pytest.raises(ProfileError, match="the first profile is of a rail, the second of a wheel"):
        WheelRailPair(round_rail(), coned_wheel(0.05))


def test_a_gauge_in_another_unit_is_reported() -> None:
    with pytest.raises(ProfileError, match="in one unit"):
        cones(0.05, gauge=1435.0)


def test_a_rail_without_its_gauge_face_is_reported() -> None:
    rail = round_rail()
    kept = rail.h > -0.008
    short = replace(rail, y=rail.y[kept], h=rail.h[kept])
    with pytest.raises(ProfileError, match="below its top on the gauge side"):
        find_contacts(WheelRailPair(coned_wheel(0.05), short))


def test_profiles_of_the_wrong_kind_are_rejected() -> None:
    wheel, rail = coned_wheel(0.05), round_rail()
    with pytest.raises(ProfileError, match="that is a rail"):
        Profile.from_points("wheel", rail.y, rail.h)
    with pytest.raises(ProfileError, match="that is a wheel"):
        Profile.from_points("rail", wheel.y, wheel.h)
