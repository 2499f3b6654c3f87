"""Print the distributions of this Python environment as JSON: name, version, licence."""

import importlib.metadata
import json

TOOLS = ("pip", "setuptools", "maturin", "railui")


def licence(metadata: importlib.metadata.PackageMetadata) -> str:
    """Return the stated licence: the expression, the classifiers, or the first line of its text."""
    if expression := metadata.get("License-Expression"):
        return str(expression)
    classifiers = [c.rpartition(" :: ")[2] for c in metadata.get_all("Classifier") or [] if c.startswith("License ::")]
    return " AND ".join(classifiers) or str(metadata.get("License") or "").strip().partition("\n")[0]


print(
    json.dumps(
        [
            {"name": d.metadata["Name"], "version": d.version, "licence": licence(d.metadata)}
            for d in sorted(importlib.metadata.distributions(), key=lambda d: d.metadata["Name"].lower())
            if d.metadata["Name"] not in TOOLS
        ]
    )
)
