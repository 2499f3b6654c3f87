"""Second opinion on the equations: measured campaigns generated in plain numpy, without the kernel."""
