"""Contact of wheel and rail: from measured profiles to the parameters of the model."""

from railui.contact.conicity import Conicity, NoCentre, equivalent_conicity
from railui.contact.contacts import Contacts
from railui.contact.creep import CreepCoefficients, creep_coefficients
from railui.contact.hertz import Ellipse, hertz
from railui.contact.kalker import kalker
from railui.contact.linearise import Linearised, linearise
from railui.contact.pair import Pair
from railui.contact.profile import Profile, ProfileFault
from railui.contact.search import search
from railui.contact.shape import Shape, shape

__all__ = [
    "Conicity",
    "Contacts",
    "CreepCoefficients",
    "Ellipse",
    "Linearised",
    "NoCentre",
    "Pair",
    "Profile",
    "ProfileFault",
    "Shape",
    "creep_coefficients",
    "equivalent_conicity",
    "hertz",
    "kalker",
    "linearise",
    "search",
    "shape",
]
