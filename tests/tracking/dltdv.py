"""Files as DLTdv8 writes them."""

import numpy as np


def save_dltdv(tracks, path):
    """pt1_cam1_X, …, first pixel 1, origin top-left, NaN where a point was lost."""
    points = range(1, len(tracks.landmarks) + 1)
    header = ",".join(f"pt{point}_cam1_{axis}" for point in points for axis in "XY")
    values = (tracks.position * (1.0, -1.0) + 1.0).reshape(tracks.n_frames, -1)
    header = f"# source: {tracks.source}\n{header}"
    np.savetxt(path, values, fmt="%.3f", delimiter=",", header=header, comments="")
