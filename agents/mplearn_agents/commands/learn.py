"""``mplearn learn``: recordings in, a library out."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mplearn.errors import InvalidValueError, MPLearnError, RecordingError, StateError
from mplearn.threads import one_thread
from mplearn_agents.learning.keeping import keep, say_unkept
from mplearn_agents.learning.live import add_live_arguments, learn_from_source
from mplearn_agents.recordings.reading import (
    add_corpus_arguments,
    add_reading_arguments,
    hints_of,
    say_bodies,
    say_left_out,
    say_takes,
    shown_reading,
)
from mplearn_agents.terminal.arguments import count, positive
from mplearn_agents.terminal.exit_codes import INTERRUPTED, NOT_KEPT
from mplearn_agents.terminal.inert import printable

if TYPE_CHECKING:
    from rich.console import Console

    from mplearn.learner import LearnerConfig
    from mplearn.recording import Recording
    from mplearn.store import LifelongLearner
    from mplearn.tree import TreeConfig
    from mplearn_agents.learning.watched import LearningLog

_SAME_RATE = 1e-3  # rates that differ by a smaller share are one

HELP = "Learn primitives and their order from recordings, or from a live stream."
EXAMPLE = "mplearn learn recordings/ --out my.mplearn"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what the command takes."""
    parser.add_argument("data", type=Path, nargs="?", help="a recording, or a folder of them")
    add_live_arguments(parser)
    parser.add_argument("--out", type=Path, help="library file to write")
    parser.add_argument(
        "--store",
        type=Path,
        help="store that keeps all that is learned, as it is learned: stopped at any moment, the "
        "same command goes on; what it has learned from already is not learned again",
    )
    parser.add_argument(
        "--rate-hz",
        type=positive,
        help="resample to this rate [1/s] (default: the recordings' own)",
    )
    parser.add_argument(
        "--observe",
        choices=["robot", "positions", "channels"],
        default="robot",
        help="what is learned: the robot's features of the person in the recording (default), "
        "positions of markers and joints, or the file's own channels (a skeleton's joint angles)",
    )
    parser.add_argument("--segmenter", help="how the stream is cut (default: the learner's own)")
    parser.add_argument(
        "--demonstrations",
        type=count,
        metavar="N",
        help="how often a motion must be shown to be known (default: 2); with 1, what was shown "
        "once is kept as well, to be performed, not to be recognised. Where nothing was shown "
        "twice, that is the default",
    )
    parser.add_argument(
        "--person", action="append", help="learn from this person's takes only; may be repeated"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="another setting of the learner, as in LearnerConfig: --set tree.max_chains=3 for "
        "factorial models, --set tree.durations=explicit for semi-Markov ones; may be repeated",
    )
    add_corpus_arguments(parser, "learn")
    parser.add_argument(
        "--shards",
        type=Path,
        metavar="FOLDER",
        help="where the stores of --jobs and --ray are kept, from which the same command goes on "
        "(default: OUT.shards); --store then is a new store for what is merged",
    )
    add_reading_arguments(parser)


def run(args: argparse.Namespace) -> int:
    """Learn, save the library and print a summary; return a code of `terminal.exit_codes`."""
    if (args.data is None) == (args.live is None):
        raise InvalidValueError("give a recording, or --live SOURCE")
    if args.jobs is not None or args.ray is not None:
        if args.live is not None:
            raise InvalidValueError("--jobs and --ray learn recordings, not --live SOURCE")
        from mplearn_agents.learning.corpora import learn_in_shards

        return learn_in_shards(args, partial(_configured, args))
    if args.out is None and args.store is None:
        raise InvalidValueError("give a library to write, --out, or a store, --store, or both")
    with one_thread():
        if args.live is not None:
            return learn_from_source(args, partial(_configured, args))
        return _learn_from_files(args)


def _learn_from_files(args: argparse.Namespace) -> int:
    from mplearn.evaluation import observe
    from mplearn.learner import LearnerConfig, with_takes
    from mplearn.mocap import command_line, open_takes
    from mplearn.store import LifelongLearner, is_begun
    from mplearn_agents.learning.watched import learn, why_nothing
    from mplearn_agents.terminal.console import open_console
    from mplearn_agents.terminal.tables import primitive_table

    console = open_console()
    with command_line():
        with shown_reading(console) as through:
            takes = open_takes(
                args.data,
                positions=args.observe != "channels",
                hints=hints_of(args, joint_axes=args.observe == "robot"),
                strict=args.strict,
                through=through,
            )
        say_takes(console, takes)
        recordings = _of_persons(args, takes.recordings)
        recordings = _as_learned(args, recordings, console)
    has_begun = args.store is not None and is_begun(args.store)
    with ExitStack() as stack:
        life: LifelongLearner | None = None
        if has_begun:
            life = stack.enter_context(LifelongLearner.open(args.store))
            _check_rules(args, life.learner.config)
            args.rate_hz = args.rate_hz or life.learner.config.rate_hz
        recordings = _at_one_rate(args, recordings, console)
        first = recordings[0]
        if life is None:
            config = _configured(args, LearnerConfig(first.channels, first.rate_hz))
            life = _new_life(args, config, stack)
        try:
            log = learn(life, recordings, console, strict=args.strict, taken=life.taken)
        except MPLearnError as why:
            kept = keep(life, life.snapshot(), out=None, store=args.store)
            if not kept.problem:
                raise
            say_unkept(str(why))
            say_unkept(kept.problem)
            return NOT_KEPT
        learner = life.learner
        for name, error in log.refused.items():
            say_left_out(console, name, error)
        library = life.snapshot(shown_once=args.demonstrations == 1)
        n_known = len(learner.tree.leaves)
        if not len(library):
            library = life.snapshot(shown_once=True)
        if not len(library) and not log.stopped:
            library = with_takes(library, [observe(each).frames for each in recordings])
        kept = keep(life, library, out=args.out, store=args.store)
    console.print(primitive_table(library))
    console.print(
        f"{n_known} primitives from {_takes_of(recordings, log)}, "
        f"{log.watched_s / 60:.1f} minutes of motion in {len(log.moving)} segments, "
        f"{log.times_real_time:.0f} x real time"
        + (f"; written to {printable(str(kept))}" if kept.paths else ""),
        markup=False,
    )
    if log.already:
        console.print(f"{log.already} takes had been learned before, and are in the store already.")
    if log.stopped and not kept.problem:
        console.print(
            "Stopped: what was learned until then is written."
            + (" The same command goes on from there." if args.store is not None else "")
        )
    if not n_known:
        console.print(why_nothing(learner, len(log.moving), log.watched_s))
    if len(library) and not log.moving and not log.already:
        console.print(
            f"{len(library)} takes in which nothing moved are in the library, named once-...: "
            "their postures can be performed, and are recognised as nothing."
        )
    elif len(library) > n_known:
        console.print(
            f"{len(library) - n_known} motions that were shown once are in the library as they "
            "came, named once-...: they can be performed, and are recognised as nothing."
        )
    if log.lost:
        console.print(
            f"{log.n_lost / first.rate_hz:.1f} s in {len(log.lost)} stretches were left out: "
            f"{log.reasons}",
            markup=False,
        )
    if kept.problem:
        goes_on = "; the same command goes on from what the store holds" if args.store else ""
        say_unkept(f"{kept.problem}{goes_on}")
        return NOT_KEPT
    return INTERRUPTED if log.stopped else 0


def _new_life(args: argparse.Namespace, config: LearnerConfig, stack: ExitStack) -> LifelongLearner:
    """Return what learns, in a new store if one is wanted."""
    from mplearn.learner import MotionLearner
    from mplearn.store import LifelongLearner

    if args.store is None:
        return LifelongLearner(MotionLearner(config))
    args.store.parent.mkdir(parents=True, exist_ok=True)
    return stack.enter_context(LifelongLearner.open(args.store, lambda: MotionLearner(config)))


def _check_rules(args: argparse.Namespace, config: LearnerConfig) -> None:
    """Refuse options that contradict the rules that a store was made with."""
    asked = {"--segmenter": args.segmenter, "--demonstrations": args.demonstrations}
    named = [f"{name} {value}" for name, value in asked.items() if value is not None]
    if _configured(args, config) != config:
        raise InvalidValueError(
            f"{args.store} was made with other rules than --observe {args.observe}"
            f"{''.join(', ' + each for each in named)}: leave these out, or take another store"
        )


def _configured(args: argparse.Namespace, config: LearnerConfig) -> LearnerConfig:
    """Return what the options make of a learner's configuration."""
    config = replace(config, observe="robot" if args.observe == "robot" else "markers")
    if args.segmenter:
        config = replace(config, segmenter=args.segmenter)
    if args.demonstrations is not None:
        config = replace(config, tree=_shown_so_often(config.tree, args.demonstrations))
    return with_settings(config, args.set)


def with_settings(config: LearnerConfig, settings: Sequence[str]) -> LearnerConfig:
    """Return a configuration with other values for some of its settings.

    Args:
        config: The configuration.
        settings: Each as ``"tree.max_chains=3"``; a value is JSON, or else text.

    Raises:
        InvalidValueError: A setting is not known, or has no such value.
    """
    import json

    from mplearn.learner import LearnerConfig

    plain = config.to_dict()
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise InvalidValueError(f"--set takes NAME=VALUE, not {setting!r}")
        try:
            value = json.loads(text)
        except ValueError:
            value = text
        *rooms, last = name.strip().split(".")
        inside: Any = plain
        for room in rooms:
            inside = inside.get(room)
            if not isinstance(inside, dict):
                raise InvalidValueError(f"--set {setting}: there are no settings {room!r}")
        inside[last] = value
    try:
        return LearnerConfig.from_dict(plain) if settings else config
    except StateError as error:
        raise InvalidValueError(f"--set: {error}") from error


def _shown_so_often(rules: TreeConfig, demonstrations: int) -> TreeConfig:
    """Return the rules by which a motion must be shown so often to be a primitive."""
    if demonstrations < 1:
        raise InvalidValueError(f"--demonstrations must be at least 1, not {demonstrations}")
    return replace(rules, min_exemplars=demonstrations) if demonstrations > 1 else rules


def _takes_of(recordings: tuple[Recording, ...], log: LearningLog) -> str:
    """Return how many takes were learned, and by how many sets of markers."""
    learned = [recording for recording in recordings if recording.name not in log.refused]
    sets = len({recording.channels for recording in learned})
    return f"{len(learned)} takes" + (f" of {sets} marker sets" if sets > 1 else "")


def _of_persons(
    args: argparse.Namespace, recordings: tuple[Recording, ...]
) -> tuple[Recording, ...]:
    if not args.person:
        return recordings
    persons = sorted({recording.person for recording in recordings})
    chosen = tuple(r for r in recordings if r.person in args.person)
    if not chosen:
        raise RecordingError(
            f"no take of {' or '.join(args.person)} in {args.data}; there are takes of "
            f"{', '.join(person or 'a person unnamed' for person in persons)}"
        )
    return chosen


def _as_learned(
    args: argparse.Namespace, recordings: tuple[Recording, ...], console: Console
) -> tuple[Recording, ...]:
    """Return the takes as they are learned: as bodies, or joined by the channels they share."""
    from mplearn.anatomy import as_bodies, read_map
    from mplearn.mocap import join_by_name

    refused: Mapping[str, MPLearnError]
    if args.observe == "robot" and any(recording.is_markers for recording in recordings):
        names = None if args.map is None else read_map(args.map)
        bodies = as_bodies(recordings, names=names, strict=args.strict)
        say_bodies(console, bodies)
        refused, recordings = bodies.refused, bodies.recordings
    else:
        joined = join_by_name(recordings)
        refused, recordings = joined.refused, joined.recordings
        if joined.dropped:
            text = printable(f"not in every take, left out: {', '.join(joined.dropped)}")
            console.print(text, markup=False)
    for name, error in refused.items():
        if args.strict:
            raise error
        say_left_out(console, name, error)
    return recordings


def _at_one_rate(
    args: argparse.Namespace, recordings: tuple[Recording, ...], console: Console
) -> tuple[Recording, ...]:
    """Return the takes at the rate asked for, or at the usual one if that can be learned."""
    from mplearn.learner import learnable_rate
    from mplearn.mocap import resample

    rates = [recording.rate_hz for recording in recordings]
    rate_hz = args.rate_hz or learnable_rate(max(rates, key=rates.count))
    others = sorted({rate for rate in rates if abs(rate - rate_hz) > _SAME_RATE * rate_hz})
    if others:
        console.print(
            f"resampled from {', '.join(f'{rate:g}' for rate in others)} to {rate_hz:g} Hz"
        )
    return tuple(resample(r, rate_hz) if r.rate_hz in others else r for r in recordings)
