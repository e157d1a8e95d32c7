from .installation import install as install
from .installation import uninstall as uninstall
from .solver import Solver as Solver
