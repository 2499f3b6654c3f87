"""Benchmarks of the kernel and of searches."""
