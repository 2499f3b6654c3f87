"""Structure detection: which effect the model lacks."""
