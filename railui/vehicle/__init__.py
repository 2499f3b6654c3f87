"""Vehicle models: parameters, designs, bodies and joints, effects, simulation."""
