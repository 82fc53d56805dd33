"""Who is mirrored is told by feet and knees; who kneels, and who stands among noise, is not."""

from __future__ import annotations

import numpy as np
import pytest

from mplearn.anatomy.facing import MirroredError, check_facing

FEET = {"heel_back": -0.05, "ball": 0.14, "toe_tip": 0.2}
Places = dict[str, np.ndarray]


def places(n_frames: int, *, hip: float, knee: float, foot: float, feet: tuple[str, ...]) -> Places:
    """Somebody who looks along x; thighs and shanks lean by angles, feet point ahead or back."""
    at = {}
    for side, y in (("l", 0.1), ("r", -0.1)):
        at[f"shoulder_{side}"] = np.array([0.0, 1.8 * y, 1.4])
        at[f"hip_{side}"] = np.array([0.0, y, 0.9])
        thigh = np.array([np.sin(hip), 0.0, -np.cos(hip)])
        shank = np.array([np.sin(hip - knee), 0.0, -np.cos(hip - knee)])
        at[f"knee_{side}"] = at[f"hip_{side}"] + 0.42 * thigh
        at[f"ankle_{side}"] = at[f"knee_{side}"] + 0.42 * shank
        for name in feet:
            at[f"{name}_{side}"] = at[f"ankle_{side}"] + [foot * FEET[name], 0.0, -0.05]
    return {name: np.tile(place, (n_frames, 1)) for name, place in at.items()}


def mirrored(at: Places) -> Places:
    return {name: points * [1.0, -1.0, 1.0] for name, points in at.items()}


@pytest.mark.parametrize("feet", [("toe_tip",), ("heel_back", "toe_tip"), tuple(FEET), ()])
def test_who_kneels_or_sits_is_not_mirrored(feet: tuple[str, ...]) -> None:
    kneels = places(20, hip=0.2, knee=1.7, foot=-1.0, feet=feet)
    sits = places(20, hip=1.5, knee=1.5, foot=1.0, feet=feet)
    for at in (kneels, sits):
        check_facing("a", at)
    with pytest.raises(MirroredError):
        check_facing("a", mirrored(sits))


@pytest.mark.parametrize("n_frames", [3, 12, 60])
@pytest.mark.parametrize("noise_m", [0.01, 0.02, 0.03])
def test_straight_knees_among_noise_say_nothing(n_frames: int, noise_m: float) -> None:
    stands = places(n_frames, hip=0.0, knee=0.0, foot=1.0, feet=())
    squats = mirrored(places(n_frames, hip=0.5, knee=1.0, foot=1.0, feet=()))
    for seed in range(30):
        rng = np.random.default_rng(seed)
        noise = {name: noise_m * rng.normal(size=points.shape) for name, points in stands.items()}
        check_facing("a", {name: stands[name] + noise[name] for name in stands})
        if n_frames > 3:
            with pytest.raises(MirroredError):
                check_facing("a", {name: squats[name] + noise[name] for name in squats})
