"""clfractal: an OpenCL render engine for 3D fractals."""

__version__ = "0.1.0"
