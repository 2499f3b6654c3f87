"""What the environment of this python holds, as JSON: name, version, licence of every distribution."""

import importlib.metadata
import json

TOOLS = ("pip", "setuptools", "railui")


def licence(about: importlib.metadata.PackageMetadata) -> str:
    """The licence as the distribution states it: an expression, classifiers, or its text's first line."""
    if expression := about.get("License-Expression"):
        return str(expression)
    classified = [c.rpartition(" :: ")[2] for c in about.get_all("Classifier") or [] if c.startswith("License ::")]
    return " AND ".join(classified) or str(about.get("License") or "").strip().partition("\n")[0]


print(json.dumps([
    {"name": d.metadata["Name"], "version": d.version, "licence": licence(d.metadata)}
    for d in sorted(importlib.metadata.distributions(), key=lambda d: d.metadata["Name"].lower())
    if d.metadata["Name"] not in TOOLS
]))  # fmt: skip
