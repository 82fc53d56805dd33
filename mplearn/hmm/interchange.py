"""Exchange of models with hmmlearn, the reference engine."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import MissingDependencyError, ModelError
from .model import LeftRightHMM


def to_hmmlearn(model: LeftRightHMM) -> Any:
    """Return the model as a ``hmmlearn.hmm.GaussianHMM`` (diagonal, log implementation).

    hmmlearn sums over all last states: its ``score`` is `LeftRightHMM.score` with
    ``complete=False``.

    Raises:
        MissingDependencyError: hmmlearn is not installed.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import fit
        >>> swing = np.sin(np.linspace(0, np.pi, 40))[:, None]
        >>> model = fit([swing], n_states=4, variance_floor=1e-3)
        >>> theirs = to_hmmlearn(model)
        >>> bool(np.isclose(theirs.score(swing), model.score(swing, complete=False)))
        True
    """
    try:
        from hmmlearn.hmm import GaussianHMM
    except ImportError as error:
        raise MissingDependencyError("to_hmmlearn needs hmmlearn: pip install hmmlearn") from error
    other = GaussianHMM(model.n_states, covariance_type="diag", implementation="log")
    other.n_features = model.n_channels
    other.startprob_ = np.eye(model.n_states)[0]
    other.transmat_ = np.diag(np.exp(model.log_stay)) + np.diag(np.exp(model.log_next[:-1]), 1)
    other.means_ = np.array(model.means)
    other.covars_ = np.array(model.variances)
    return other


def from_hmmlearn(other: Any) -> LeftRightHMM:
    """Return a left-right model from a fitted ``hmmlearn.hmm.GaussianHMM``.

    Raises:
        ModelError: It is not diagonal, or not a left-right chain from its first state.

    Example:
        >>> import numpy as np
        >>> from mplearn.hmm import LeftRightHMM, to_hmmlearn
        >>> ours = LeftRightHMM(np.array([[0.0], [1.0]]), np.full((2, 1), 0.1), np.log([0.9, 1.0]))
        >>> from_hmmlearn(to_hmmlearn(ours)).means.ravel().tolist()
        [0.0, 1.0]
    """
    if getattr(other, "covariance_type", None) != "diag":
        kind = getattr(other, "covariance_type", type(other).__name__)
        raise ModelError(f"the covariance must be 'diag', not {kind!r}")
    start, transitions = np.asarray(other.startprob_), np.asarray(other.transmat_)
    chain = np.triu(np.tril(transitions, 1))
    if not np.isclose(start[0], 1.0) or not np.allclose(chain, transitions, atol=1e-12):
        raise ModelError("the model must be a left-right chain without skips from its first state")
    with np.errstate(divide="ignore"):
        log_stay = np.log(np.diag(transitions))
    log_stay[-1] = 0.0
    variances = np.array([np.diag(covariance) for covariance in other.covars_])
    return LeftRightHMM(np.asarray(other.means_), variances, log_stay)
