"""Diagnosis of data faults: the smallest set of faulty channels that explains all contradictions of the data."""
