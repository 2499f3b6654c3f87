"""railui: bogie suspensions designed on models that measurement has corrected."""

__version__ = "0.1.0"
