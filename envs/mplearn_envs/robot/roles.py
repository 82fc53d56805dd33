"""Which segments a robot may have, which it needs, and the channels of its base."""

from __future__ import annotations

BASE_CHANNELS = ("base_height", "base_roll", "base_pitch")
#: Segments that a robot may have, as the library's bodies name them; a standing robot needs legs.
TRUNK_ROLES = ("pelvis", "chest", "head")
LIMB_ROLES = ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
ROLES = (*TRUNK_ROLES, *(f"{role}_{side}" for side in "lr" for role in LIMB_ROLES))
NEEDED_ROLES = ("pelvis", *(f"{role}_{side}" for side in "lr" for role in LIMB_ROLES[3:]))
