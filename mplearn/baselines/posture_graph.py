"""The posture motion graph: frames split into clusters of like posture, and their transitions.

It is what the paper compares its graph of primitives with [Yamane2009], [Kulic2012, 4.2.3].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import FrameError, InvalidValueError
from ..recording import FloatArray, IntArray
from .splitting import minimum_error_split, principal_projection

_VELOCITY_S = 0.1  # a velocity counts as the way covered in this time [s]


@dataclass(frozen=True, eq=False)
class PostureGraph:
    """A binary tree of postures with the transitions between its leaves.

    All frames must be at hand at once: it is built off-line.

    Attributes:
        parents: Node above each node of the binary tree, -1 at the root, shape (n,).
        means: Mean state of the frames in each node, shape (n, 2 D).
        leaf_of: Leaf that each frame lies in, shape (T,).
        edges: Leaves that followed each other and how often: source, target, count, shape (E, 3).

    Example:
        >>> import numpy as np
        >>> t = np.arange(2000) / 100.0
        >>> markers = np.stack((np.sin(t), np.cos(t)), axis=1)  # round and round
        >>> graph = PostureGraph.build(markers, 100.0)
        >>> len(graph.leaf_of), bool((graph.edges[:, 2] > 0).all())
        (2000, True)
    """

    parents: IntArray
    means: FloatArray
    leaf_of: IntArray
    edges: IntArray

    @classmethod
    def build(cls, markers: FloatArray, rate_hz: float, smallest: int = 32) -> PostureGraph:
        """Build the graph of a stream.

        A frame's state is the positions and velocities of its virtual markers. All frames are
        split in two along their first principal component, where the error of the two is least,
        and so on, as long as both parts hold ``smallest`` frames.

        Args:
            markers: Positions of virtual markers on the body, in a frame that moves and turns with
                it [m], shape (T, D), finite.
            rate_hz: Frames per second [1/s].
            smallest: Fewest frames of a node.

        Raises:
            FrameError: There are fewer than two frames, or values are missing.
            InvalidValueError: The rate or ``smallest`` is not positive.
        """
        if not (rate_hz > 0 and smallest >= 1):
            raise InvalidValueError(
                f"rate_hz > 0 and smallest >= 1 are needed, not {rate_hz} and {smallest}"
            )
        markers = np.asarray(markers, dtype=np.float64)
        if markers.ndim != 2 or len(markers) < 2 or not np.isfinite(markers).all():
            raise FrameError(
                f"a posture graph needs at least two finite frames (T, D), not {markers.shape}"
            )
        states = np.hstack([markers, _VELOCITY_S * rate_hz * np.gradient(markers, axis=0)])
        parents, means = [-1], [states.mean(axis=0)]
        leaf_of = np.zeros(len(states), dtype=np.int64)
        waiting = [(0, np.arange(len(states)))]
        while waiting:
            node, frames = waiting.pop()
            values = principal_projection(states[frames])
            threshold = minimum_error_split(values, smallest)
            if threshold is None:
                leaf_of[frames] = node
                continue
            for part in (frames[values <= threshold], frames[values > threshold]):
                waiting.append((len(parents), part))
                parents.append(node)
                means.append(states[part].mean(axis=0))
        pairs, counts = np.unique(
            np.stack([leaf_of[:-1], leaf_of[1:]], axis=1), axis=0, return_counts=True
        )
        edges = np.column_stack([pairs, counts])
        return cls(np.array(parents), np.array(means), leaf_of, edges)

    @property
    def leaves(self) -> IntArray:
        """The nodes of the transition graph: leaves of the tree, ascending."""
        return np.setdiff1d(np.arange(len(self.parents)), self.parents)

    @property
    def n_bytes(self) -> int:
        """Memory of the tree, the transitions, and which frame lies where [bytes].

        The frames themselves, which must be kept to move along the graph, come on top.
        """
        return sum(each.nbytes for each in (self.parents, self.means, self.leaf_of, self.edges))
