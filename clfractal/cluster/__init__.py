"""Rendering on the workers of a Dask cluster: tasks, retries, data movement and security are Dask's."""
