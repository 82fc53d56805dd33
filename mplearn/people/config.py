"""What makes motions of different people one primitive."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..arguments import require_numbers
from ..errors import InvalidValueError
from ..state import newer


@dataclass(frozen=True)
class PeopleConfig:
    """Rules by which leaves of several people's trees become one primitive.

    Distances are those between mean trajectories (`shapes`), in units of how far a person's own
    primitives usually lie apart (`matching.unit_of`): no label sets the scale, and neither does the
    number of people.

    Attributes:
        posture: Weight of the mean posture beside the movement about it, in [0, 1].
        repertoire: Primitives of a person from which on that scale is taken as it is; the fewer
            are known, the farther they lie apart.
        link: Two groups of leaves by different people are one primitive up to this tension
            (`matching.tension`), taken of the average distance over all pairs of leaves.
        link_own: Two leaves of one person are one primitive only up to this distance.
        join: A segment that is in none of its person's leaves joins another person's primitive up
            to this tension, unless its person has a leaf in it.
        reach: Distance up to which the next candidate counts in a tension.
        sided: A motion is another's mirror image, not the same, if its distance to the mirror image
            is below its distance to the motion itself times this; of groups of leaves both are
            averages over all pairs.
        min_exemplars: Members from which on a cluster becomes a leaf while there are several
            people, if that is more than by the rules of the trees. Which leaves are one motion is
            judged by their means, and those of two or three are too rough for it; a newcomer's
            motions are known from others meanwhile.
        offset_prior: Primitives that a person must share before half of his or her usual deviation
            in posture is allowed for.

    Example:
        >>> from mplearn import LearnerConfig
        >>> eager = PeopleConfig(min_exemplars=2)  # a newcomer's motions are born sooner
        >>> LearnerConfig(("x", "y"), people=eager).people.min_exemplars
        2
    """

    posture: float = 0.5
    repertoire: int = 30
    link: float = 0.9
    link_own: float = 0.3
    join: float = 0.85
    reach: float = 1.5
    sided: float = 0.75
    min_exemplars: int = newer(4, absent=2)
    offset_prior: float = 1.0

    def __post_init__(self) -> None:
        require_numbers(self)
        for name in ("repertoire", "link", "link_own", "join", "reach", "sided", "offset_prior"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise InvalidValueError(f"{name} must be positive, not {getattr(self, name)}")
        if self.min_exemplars < 2:
            raise InvalidValueError(f"min_exemplars must be at least 2, not {self.min_exemplars}")
        if not 0 <= self.posture <= 1:
            raise InvalidValueError(f"posture must lie in [0, 1], not {self.posture}")
