"""Files of every kind: recognition, checking, comparison, saving, JSON Schema."""
