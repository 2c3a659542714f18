#!/usr/bin/env python3
"""Renders an exported scene with Mitsuba 3 for `clerestory compare`: check_mitsuba.py SCENE.xml PICTURE.exr

Mitsuba averages over a pixel what Clerestory takes at its centre, so pixels that the sphere's rim cuts are left out:
they get alpha 0. Needs `pip install mitsuba numpy`.
"""
import sys

import mitsuba
import numpy

WHOLLY_COVERED = 0.9999  # alpha is a mean over samples, in float32


def main(scene_file, picture_file):
    mitsuba.set_variant("scalar_rgb")
    picture = numpy.array(mitsuba.render(mitsuba.load_file(scene_file)), dtype=numpy.float32)
    picture[picture[..., 3] < WHOLLY_COVERED] = 0
    mitsuba.Bitmap(picture).write(picture_file)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
