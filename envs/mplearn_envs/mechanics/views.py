"""What compiled code sees of a simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from mplearn.recording import FloatArray, IntArray

if TYPE_CHECKING:
    import mujoco


class Views(NamedTuple):
    """A simulation's state in MuJoCo's own memory, fields named as those of ``MjData``.

    Attributes:
        feet: Bodies of the feet, shape (2,).
    """

    feet: IntArray
    ctrl: FloatArray
    qpos: FloatArray
    qvel: FloatArray
    subtree_com: FloatArray
    subtree_linvel: FloatArray
    xpos: FloatArray
    xmat: FloatArray
    xaxis: FloatArray
    xfrc_applied: FloatArray

    @classmethod
    def of(cls, data: mujoco.MjData, feet: IntArray) -> Views:
        """Return views of a simulation's state."""
        return cls(feet, *(getattr(data, name) for name in cls._fields[1:]))
