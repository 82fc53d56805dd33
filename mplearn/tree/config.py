"""What the tree's rules are: our improved ones by default, or those that the paper prints."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

from ..arguments import is_one_of, require_kind, require_number, require_numbers
from ..errors import InvalidValueError
from ..state import newer, saved_as

_MOST_POINTS, _MOST_SAMPLED = 1_000, 4_096  # all distances of the sample are kept


@dataclass(frozen=True)
class NormalisationConfig:
    """How a segment is normalised in time, weighted and partly centred, before it is compared.

    Neighbouring motions blend into each other, mostly into the start of a segment; where a person
    stands differs more than how the person moves.

    Attributes:
        n_points: Points over the segment, whatever its duration.
        head: Share of the segment's start that is left out.
        ramp: Share over which the weight then rises to 1.
        centring: Share of the mean posture that is taken away, in [0, 1].

    Example:
        >>> from mplearn.tree import TreeConfig
        >>> finer = NormalisationConfig(n_points=24)
        >>> TreeConfig(normalisation=finer).normalisation.n_points
        24
    """

    n_points: int = 16
    head: float = 0.22
    ramp: float = 0.3
    centring: float = 0.5

    def __post_init__(self) -> None:
        require_numbers(self)
        if not 2 <= self.n_points <= _MOST_POINTS:
            raise InvalidValueError(
                f"n_points must lie in [2, {_MOST_POINTS}], not {self.n_points}"
            )
        if not (self.head >= 0 and self.ramp >= 0 and self.head + self.ramp < 1):
            raise InvalidValueError(
                f"head and ramp must be at least 0 and below 1 together, "
                f"not {self.head} and {self.ramp}"
            )
        if not 0 <= self.centring <= 1:
            raise InvalidValueError(f"centring must lie in [0, 1], not {self.centring}")


@saved_as(normalisation="form")
@dataclass(frozen=True)
class TreeConfig:
    """Rules of the tree [Kulic2012, 2.2].

    Attributes:
        normalisation: How segments are normalised before they are compared.
        n_states: States of the models.
        max_chains: Most chains of a primitive's model: one is added while it cannot be told apart
            from its neighbour [Kulic2008b]; 1 for none.
        durations: How long a state of a primitive's model lasts: ``"geometric"``, as in a Markov
            chain, or ``"explicit"``, normally distributed: a hidden semi-Markov model [Yu2010].
        variance_floor: Smallest standard deviation of a model, as a share of that of all motion
            ever seen (of the channel's group).
        distance: How far two segments are apart: ``"likelihood"``, eq. 5 on the segments;
            ``"monte_carlo"``, eq. 5 on generated sequences, as printed; or one's own
            (`register_distance`).
        power: Power of that distance that everything below is measured in; of a likelihood distance
            [nat] 1 is eq. 5 itself, 0.5 makes it grow linearly with the difference of postures.
        tempo: Two segments, one of which lasts longer than the other by more than this factor, are
            the farther apart for it; inf for durations that do not matter.
        local: Whether a cluster is formed below mu - cutoff * sigma of the node that grew, as
            printed (eq. 7), or below a scale taken from a sample of all segments ever seen.
        cutoff: K_cutoff of eq. 7.
        scale_share: That scale over the mean distance, times r to the `scale_power`, r being the
            lower quartile of the distances to the nearest neighbour over the mean distance: small
            where repetitions are very like, and yet never nothing.
        scale_power: That power; 1 makes the scale a multiple of the quartile, 0 of the mean.
        scale_floor: Smallest r: people do not repeat themselves more exactly, and what does (a
            recording in a loop, a robot's playback) says nothing of how much they vary.
        spread: Largest scale over that quartile; inf for no such bound.
        mean_share: Largest scale over the mean distance; it holds while hardly any motion has been
            seen twice.
        rise: The scale ends where the known segments round a new one grow in number by this more,
            with the distance, than they do at the least (`exemplars.neighbours`): there other
            motions begin. A leaf that is wider by then keeps its core only. inf for neither.
        birth_cap: Largest diameter of what is born over the median of that of the leaves, once many
            are known; inf for the scale alone.
        extent_share: Largest distance between executions of one motion over that of each from
            standing still, by which two unrelated motions of one size are sqrt(2) apart; inf for
            no such bound.
        min_exemplars: Members from which on a cluster becomes a node. With 2 a motion is known as
            soon as it comes again, and a chance pair can take its place for a while; on people's
            takes 3 halves those and costs one demonstration, 4 leaves hardly any and costs two.
        pair_share: Two members alone become a node only below this share of the scale, and only
            while no larger cluster is below it.
        pair_extent: And below this share of how far each is from standing still, which is small
            only where they are like each other in shape; inf for no such bound.
        sequence_share: A sequence that came twice is hardly chance: two that wait become a node
            below this share of the scale where each is the other's nearest, the next being 1.2
            times as far, where the same holds for what came right before both, or right after
            (or that is in one node already), and where each is farther than the scale from the node
            that it fits best; among ten that wait or are known, for among few this may be chance. 0
            for `pair_share` alone; then no sequence tells a leaf's motions apart, either.
        sequence_extent: And below this share of how far each is from standing still.
        ignore_fragments: Whether nothing becomes a primitive that is, together with the segment
            right before or after it, an execution of a primitive that is sure by then, or nearer by
            far to the only other one that it is like: a motion that is cut in two where someone
            hesitated is not two motions.
        drop_fragments: Whether a primitive is dropped again, if no person had a hand in it, that
            was born of parts of a motion: all of whose exemplars are, each together with the
            segment right before or after it, executions of one other that is sure by then and came
            as often. Where one of the two that it was born of is a part of what came to it later,
            the others form a primitive anew. With each segment one is looked at, in turn.
        max_born: Clusters that become nodes with a segment, at most, so that no frame takes long:
            others become nodes with the next segments, one after another; inf for no such bound. A
            learner forms one a frame, so what a segment forms is there some frames later.
        confirmed: Members from which on a primitive is sure; with fewer it is provisional.
        patience: A provisional primitive that nothing has joined after so many further segments is
            forgotten; after four times as many as there are primitives, if that is more.
        reach: K_maxGD of eq. 6: a node's radius over the largest distance between its exemplars.
        young_reach: Smallest radius of a leaf of at most 3 exemplars over that scale, since few say
            little of how much executions vary; 0 for none.
        least_reach: Smallest radius of any other leaf over that scale: exemplars that are copies of
            each other say nothing of it, either.
        reach_cap: Largest radius over the median of that distance over all leaves.
        reach_limit: Largest radius over the scale below which clusters are formed.
        n_nearest: A segment's distance to a node is the mean of that to so many exemplars.
        split_ratio: A leaf is split when the mean distance between its two branches exceeds that
            inside them by this; inf for never.
        split_gap: And when the smallest distance between them exceeds that to a second neighbour
            inside them, the median of it, by this.
        split_scale: And when the mean between them exceeds the median diameter of the other leaves
            by this. Of two groups, each of which came right after, or before, a primitive of its
            own that mostly comes with the leaf, `min_exemplars` each are enough, and from three on
            0.8 of all three limits.
        min_branch: Members of each branch from which on it is one, where no sequence tells.
        merge_ratio: Two leaves that a segment lies in are merged when the distance between them is
            below that inside them times this; 0 for never.
        false_acceptance: Share of the motions of unknown kinds that a recogniser may take for
            known ones (`mplearn.tree.rejection`): its radii are the smaller for it; None leaves
            them as they are. What is learned does not depend on it.
        n_candidates: Leaves, by mean trajectory, that are looked at closely; 0 to search down from
            the root, as printed.
        max_exemplars: Exemplars kept by a node; a leaf that has so many may be split, whatever
            they came beside.
        max_unplaced: Segments that wait in the root.
        n_sampled: Segments, of all ever seen, that mu and sigma are taken over.
        seed: Seed of the choice of those.

    Example:
        >>> from dataclasses import replace
        >>> replace(TreeConfig(), min_exemplars=4).min_exemplars
        4
        >>> TreeConfig.printed().distance
        'monte_carlo'
    """

    normalisation: NormalisationConfig = field(default_factory=NormalisationConfig)
    n_states: int = 8
    max_chains: int = 1
    durations: Literal["geometric", "explicit"] = newer("geometric", absent="geometric")
    variance_floor: float = 0.6
    distance: str = newer("likelihood", absent="likelihood")
    power: float = 0.5
    tempo: float = 1.5
    local: bool = False
    cutoff: float = 1.0
    scale_share: float = newer(0.69, absent=1.0)
    scale_power: float = newer(0.3, absent=0.0)
    scale_floor: float = newer(0.03, absent=0.0)
    spread: float = math.inf
    mean_share: float = 0.45
    rise: float = newer(1.05, absent=math.inf)
    birth_cap: float = newer(1.75, absent=math.inf)
    extent_share: float = newer(1.4, absent=math.inf)
    min_exemplars: int = 2
    pair_share: float = newer(0.6, absent=1.0)
    pair_extent: float = newer(1.1, absent=math.inf)
    sequence_share: float = newer(1.2, absent=0.0)
    sequence_extent: float = newer(0.74, absent=0.74)
    ignore_fragments: bool = newer(True, absent=False)
    drop_fragments: bool = newer(True, absent=False)
    max_born: float = newer(2.0, absent=math.inf)
    confirmed: int = newer(3, absent=1)
    patience: int = newer(64, absent=64)
    reach: float = 1.6
    young_reach: float = newer(0.85, absent=0.0)
    least_reach: float = newer(0.4, absent=0.0)
    reach_cap: float = 2.0
    reach_limit: float = 1.0
    n_nearest: int = 2
    split_ratio: float = 2.0
    split_gap: float = 1.5
    split_scale: float = 0.9
    min_branch: int = 4
    merge_ratio: float = 1.4
    false_acceptance: float | None = None
    n_candidates: int = 6
    max_exemplars: int = 12
    max_unplaced: int = 200
    n_sampled: int = 128
    seed: int = 0

    @classmethod
    def printed(cls) -> TreeConfig:
        """Return the rules as the paper prints them: eq. 5 to 7, nothing else."""
        return replace(
            cls(),
            normalisation=NormalisationConfig(n_points=32, head=0.0, ramp=0.0, centring=0.0),
            distance="monte_carlo",
            power=1.0,
            tempo=math.inf,
            local=True,
            min_exemplars=4,
            rise=math.inf,
            birth_cap=math.inf,
            extent_share=math.inf,
            pair_share=1.0,
            pair_extent=math.inf,
            sequence_share=0.0,
            ignore_fragments=False,
            drop_fragments=False,
            max_born=math.inf,
            confirmed=1,
            reach=1.5,
            young_reach=0.0,
            least_reach=0.0,
            reach_cap=math.inf,
            n_nearest=1_000,
            split_ratio=math.inf,
            merge_ratio=0.0,
            n_candidates=0,
        )

    def __post_init__(self) -> None:
        require_numbers(self)
        require_kind("normalisation", self.normalisation, NormalisationConfig)
        for name in (
            "variance_floor",
            "power",
            "tempo",
            "scale_share",
            "spread",
            "mean_share",
            "rise",
            "birth_cap",
            "extent_share",
            "pair_share",
            "pair_extent",
            "sequence_extent",
            "reach",
            "reach_cap",
            "reach_limit",
        ):
            if not getattr(self, name) > 0:
                raise InvalidValueError(f"{name} must be positive, not {getattr(self, name)}")
        lowest = {
            "n_states": 1,
            "max_chains": 1,
            "scale_power": 0,
            "scale_floor": 0,
            "sequence_share": 0,
            "min_exemplars": 2,
            "max_born": 1,
            "confirmed": 1,
            "patience": 1,
            "young_reach": 0,
            "least_reach": 0,
            "n_nearest": 1,
            "n_candidates": 0,
            "max_exemplars": self.min_exemplars,
            "max_unplaced": self.min_exemplars,
            "n_sampled": 3,
            "seed": 0,
            "split_ratio": 1,
            "split_gap": 0,
            "split_scale": 0,
            "min_branch": 2,
            "merge_ratio": 0,
        }
        if self.n_sampled > _MOST_SAMPLED:
            raise InvalidValueError(
                f"n_sampled must be at most {_MOST_SAMPLED}, not {self.n_sampled}"
            )
        for name, low in lowest.items():
            if not getattr(self, name) >= low:
                raise InvalidValueError(f"{name} must be at least {low}, not {getattr(self, name)}")
        if self.false_acceptance is not None:
            require_number("false_acceptance", self.false_acceptance)
        if self.false_acceptance is not None and not 0 < self.false_acceptance < 1:
            raise InvalidValueError(
                f"false_acceptance must lie in (0, 1) or be None, not {self.false_acceptance}"
            )
        if not is_one_of(self.durations, ("geometric", "explicit")):
            raise InvalidValueError(
                f"durations must be 'geometric' or 'explicit', not {self.durations!r}"
            )
        if self.durations == "explicit" and self.max_chains > 1:
            raise InvalidValueError(
                f"models of explicit durations have one chain: max_chains must be 1, "
                f"not {self.max_chains}"
            )
        if self.normalisation.n_points < self.n_states:
            raise InvalidValueError(
                f"{self.n_states} states need n_points of at least that, "
                f"not {self.normalisation.n_points}"
            )
