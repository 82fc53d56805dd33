import numpy as np
from mplearn import open_recording
from mplearn.mocap import open_recordings, find_takes
P = np.load("/tmp/corpus8/slp_points.npy")
for f in ("dlc_single_table.h5", "dlc_single_fixed.h5"):
    r = open_recording("/tmp/corpus8/" + f); c = open_recording("/tmp/corpus8/dlc_single.csv"); print(f, r.report.format, r.frames.shape, abs(r.frames - c.frames).max(), r.channels == c.channels)
for f in ("dlc_multi_table.h5", "dlc_multi_fixed.h5"):
    r = open_recordings("/tmp/corpus8/" + f); c = open_recordings("/tmp/corpus8/dlc_multi.csv"); print(f, [x.person for x in r], [x.person for x in c], [abs(a.frames - b.frames).max() for a, b in zip(r, c)])
for f in ("slp.analysis.h5", "slp_matlab.h5", "slp_standard.h5"):
    r = open_recordings("/tmp/corpus8/" + f)
    from mplearn.mocap.keypoints.egocentric import seen_from_the_body
    e, ch, _ = seen_from_the_body(P[:, 1] * [1, -1], ("snout", "left_ear", "right_ear", "tail_base"), 30.0)
    print(f, [x.person for x in r], len(r[0]), abs(r[1].frames - e).max(), r[1].channels == ch)
