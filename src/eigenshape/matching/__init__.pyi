from .match import match_shapes as match_shapes
from .posing import take_pose as take_pose
from .shape_match import ShapeMatch as ShapeMatch
from .target import MatchTarget as MatchTarget
from .target import prepare_target as prepare_target
