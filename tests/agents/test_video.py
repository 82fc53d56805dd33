"""What is written is read back by ffmpeg, frame by frame."""

import subprocess

import numpy as np
import pytest

from mplearn.errors import InvalidValueError, MissingDependencyError
from mplearn.extras import require
from mplearn_agents.video import write_video

ffmpeg = pytest.importorskip("imageio_ffmpeg")


def pictures(n, shape=(64, 96)):
    for k in range(n):
        picture = np.full((*shape, 3), 30, dtype=np.uint8)
        picture[:, 4 * k : 4 * k + 16] = (220, 120, 40)
        yield picture


def decode(path):
    """Return the frames (n, 64, 96, 3) and what ffmpeg says about the file."""
    command = [ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    return np.frombuffer(done.stdout, np.uint8).reshape(-1, 64, 96, 3), done.stderr.decode()


def test_a_video_decodes_to_the_frames_that_were_written(tmp_path):
    path = tmp_path / "new" / "clip.mp4"
    assert write_video(path, pictures(17), 20.0) == 17
    read, said = decode(path)
    assert "h264" in said and "yuv420p" in said and "96x64" in said and "20 fps" in said
    assert len(read) == 17
    for frame, written in zip(read, pictures(17), strict=True):
        assert np.abs(frame.astype(int) - written).mean() < 8


@pytest.mark.parametrize(
    ("frames", "said"),
    [
        ([], "no pictures"),
        ([np.zeros((4, 4, 3))], "uint8"),
        ([np.zeros((4, 4), np.uint8)], r"\(H, W, 3\)"),
        ([np.zeros((5, 4, 3), np.uint8)], "even"),
        ([np.zeros((64, 64, 3), np.uint8), np.zeros((32, 64, 3), np.uint8)], "all have shape"),
    ],
)
def test_pictures_that_make_no_video_are_refused(tmp_path, frames, said):
    with pytest.raises(InvalidValueError, match=said):
        write_video(tmp_path / "clip.mp4", frames, 20.0)


def test_a_rate_that_is_none_is_refused(tmp_path):
    with pytest.raises(InvalidValueError, match="rate_hz"):
        write_video(tmp_path / "clip.mp4", pictures(2), float("nan"))


def test_a_missing_package_is_named_with_the_command_that_brings_it():
    with pytest.raises(
        MissingDependencyError, match=r"'no_such_thing'.*pip install 'mplearn\[report\]'"
    ):
        require("no_such_thing", "report")
