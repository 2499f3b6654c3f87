"""Execution of evaluations: threads, dask clusters, a result cache from which a search resumes."""
