"""The compiled loop of `raster`: a z-buffer.

Every number is rounded after each step in the order that is written here, so that the picture does
not depend on how faces are grouped.
"""

import numpy as np

from eigenshape._compile import njit


@njit
def fill_buffer(points, faces, least_doubled_area, slack, face_at, weights, depth):
    """Write the nearest face at the middle of each pixel, its weights there, and its height.

    `depth` is minus infinity on entry, `face_at` -1 and `weights` 0. Of faces at equal height the
    one with the lowest index stays, because later ones must be higher.
    """
    height, width = depth.shape
    for face in range(len(faces)):
        a, b, c = faces[face, 0], faces[face, 1], faces[face, 2]
        x, y = points[a, 0], points[a, 1]
        one_x, one_y = points[b, 0] - x, points[b, 1] - y
        two_x, two_y = points[c, 0] - x, points[c, 1] - y
        doubled_area = one_x * two_y - one_y * two_x
        if not abs(doubled_area) > least_doubled_area:
            continue

        # The box of pixels whose middles may lie in the face.
        left = min(max(np.ceil(min(x, points[b, 0], points[c, 0]) - 0.5), 0.0), width)
        right = min(max(np.floor(max(x, points[b, 0], points[c, 0]) - 0.5) + 1, 0.0), width)
        top = min(max(np.ceil(min(y, points[b, 1], points[c, 1]) - 0.5), 0.0), height)
        bottom = min(max(np.floor(max(y, points[b, 1], points[c, 1]) - 0.5) + 1, 0.0), height)

        # The weights of corners 1 and 2 are linear in the place: here at the first pixel of the
        # box, and their change per column and per row.
        scale = 1 / doubled_area
        across_one, across_two = two_y * scale, -one_y * scale
        down_one, down_two = -two_x * scale, one_x * scale
        here_x, here_y = left + 0.5 - x, top + 0.5 - y
        first_one = across_one * here_x + down_one * here_y
        first_two = across_two * here_x + down_two * here_y
        for row in range(int(top), int(bottom)):
            below = row - int(top)
            for column in range(int(left), int(right)):
                beside = column - int(left)
                weight_one = first_one + across_one * beside + down_one * below
                weight_two = first_two + across_two * beside + down_two * below
                weight = 1 - (weight_one + weight_two)
                if not (weight >= -slack and weight_one >= -slack and weight_two >= -slack):
                    continue
                found = (
                    weight * points[a, 2] + weight_two * points[c, 2] + weight_one * points[b, 2]
                )
                if found > depth[row, column]:
                    depth[row, column] = found
                    face_at[row, column] = face
                    weights[row, column, 0] = weight
                    weights[row, column, 1] = weight_one
                    weights[row, column, 2] = weight_two
