from .landmark_files import read_landmarks as read_landmarks
from .landmark_files import read_specimens as read_specimens
from .landmark_files import write_landmarks as write_landmarks
from .landmarks import Landmarks as Landmarks
