"""The steps of EM, one by one."""

import numpy as np

from mplearn.hmm import SequenceBatch, em
from mplearn.hmm.parameters import as_model, empty_parameters


def no_statistics(n_states, n_channels):
    return em.Statistics(em.Emitted(*np.zeros((3, n_states, n_channels))), *np.zeros((2, n_states)))


def expected_statistics(model, sequences, weights=None):
    """Mass, first, second, stays, moves and the log-likelihood: the E-step by itself."""
    total = no_statistics(model.n_states, model.n_channels)
    parameters = em.Parameters(model.means, model.variances, model.log_stay, model.log_next)
    likelihood = em.expectation(SequenceBatch.of(sequences, weights), parameters, True, total)
    return (*total.emitted, total.stays, total.moves, likelihood)


def model_of(statistics, floor=1e-6):
    """The M-step by itself, from mass, first, second, stays and moves."""
    parameters = empty_parameters(*statistics[0].shape)
    floors = np.full(statistics[0].shape[1], floor)
    mass, first, second, stays, moves = statistics
    total = em.Statistics(em.Emitted(mass, first, second), stays, moves)
    em.maximisation(total, floors, 1.0, parameters)
    return as_model(parameters)
