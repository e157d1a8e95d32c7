from . import lapy as lapy
