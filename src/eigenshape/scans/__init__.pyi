from .depth_camera import DepthCamera as DepthCamera
from .depth_camera import DepthScan as DepthScan
from .depth_camera import simulate_scan as simulate_scan
from .partial import MeshPart as MeshPart
from .partial import cut_by_planes as cut_by_planes
from .partial import partial_scan as partial_scan
from .partial import random_planes as random_planes
