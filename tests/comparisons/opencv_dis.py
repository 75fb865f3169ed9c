#!/usr/bin/env python3
"""Times what one would do without depth and motion: optical flow and a remap, by OpenCV.

Takes two successive key frames as PNG files. Milliseconds, medians: grey of the new key, DIS flow
(ultrafast preset) from it to the old one, and one in-between frame by remapping the new key half a
key interval onwards. The flow is the least that a key costs; every in-between frame adds a remap.

    python3 -m venv cv && cv/bin/pip install opencv-python-headless
    foreframe scenes atrium --size 1920x1080 --rate 40 --seconds 0.025 --png keys
    cv/bin/python tests/comparisons/opencv_dis.py keys/*.png
    foreframe bench --sizes 1920x1080 --methods linear --scenes atrium
"""

import statistics
import sys
import time

import cv2
import numpy as np

ROUNDS = 40
WARM_UP = 5


def main():
    if len(sys.argv) != 3:
        sys.exit("expected two PNG files, found %d arguments" % (len(sys.argv) - 1))
    older, newer = (cv2.imread(path) for path in sys.argv[1:])
    if older is None or newer is None or older.shape != newer.shape:
        sys.exit("expected two pictures of one size")
    newer = cv2.cvtColor(newer, cv2.COLOR_BGR2BGRA)
    older_grey = cv2.cvtColor(older, cv2.COLOR_BGR2GRAY)
    height, width = older_grey.shape
    columns, rows = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_ULTRAFAST)

    times = {"grey": [], "flow": [], "maps": [], "remap": []}
    for round_ in range(WARM_UP + ROUNDS):
        ends = [time.perf_counter()]
        grey = cv2.cvtColor(newer, cv2.COLOR_BGRA2GRAY)
        ends.append(time.perf_counter())
        # Of each pixel of the new key, where it was in the old one.
        flow = dis.calc(grey, older_grey, None)
        ends.append(time.perf_counter())
        # Half an interval later: what is at p now was at p + flow / 2, to first order.
        map_x = cv2.scaleAdd(flow[..., 0], 0.5, columns)
        map_y = cv2.scaleAdd(flow[..., 1], 0.5, rows)
        ends.append(time.perf_counter())
        cv2.remap(newer, map_x, map_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        ends.append(time.perf_counter())
        if round_ >= WARM_UP:
            for name, start, end in zip(times, ends, ends[1:]):
                times[name].append(1000 * (end - start))

    medians = {name: statistics.median(values) for name, values in times.items()}
    print("OpenCV %s, %dx%d, %d threads" % (cv2.__version__, width, height, cv2.getNumThreads()))
    for name, median in medians.items():
        print("%-6s %6.2f ms" % (name, median))
    print("flow and one in-between frame %.2f ms" % sum(medians.values()))


if __name__ == "__main__":
    main()
