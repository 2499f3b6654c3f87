"""Execution of evaluations: threads, dask clusters, a cache that resumes."""
