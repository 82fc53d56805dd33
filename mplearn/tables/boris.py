"""BORIS: a project with an ethogram, the subjects, and an observation for each take [Friard2016].

A segment is a pair of events of a behaviour of type "State event". What BORIS has no place for is
the comment of the first, as JSON.
"""

from __future__ import annotations

import json
from typing import Any

from ..library import RecognisedSegment, SegmentTable

UNKNOWN = "unknown"
"""Behaviour of segments that are like no primitive."""
_NO_SUBJECT = "No focal subject"


def behaviour(segment: RecognisedSegment) -> str:
    """Return what a segment is called in an ethogram."""
    return segment.name or UNKNOWN


def as_project(table: SegmentTable) -> str:
    """Return a project file of BORIS (version 7 of its format)."""
    takes: dict[str, list[RecognisedSegment]] = {}
    for row in table:
        takes.setdefault(row.take, []).append(row)
    codes = dict.fromkeys(map(behaviour, table))
    people = dict.fromkeys(row.person for row in table if row.person)
    project = {
        "time_format": "s",
        "project_date": "1970-01-01T00:00:00",
        "project_name": "mplearn",
        "project_description": "motion primitives recognised by mplearn",
        "project_format_version": "7.0",
        "subjects_conf": {
            str(k): {"key": "", "name": who, "description": ""} for k, who in enumerate(people)
        },
        "behaviors_conf": {
            str(k): {
                "type": "State event",
                "key": "",
                "code": code,
                "description": "",
                "color": "",
                "category": "",
                "modifiers": "",
                "excluded": "",
                "coding map": "",
            }
            for k, code in enumerate(codes)
        },
        "observations": {take: _observation(rows) for take, rows in takes.items()},
        "behavioral_categories": [],
        "independent_variables": {},
        "coding_map": {},
        "behaviors_coding_map": [],
        "converters": {},
    }
    return json.dumps(project, indent=1, ensure_ascii=False)


def _observation(rows: list[RecognisedSegment]) -> dict[str, Any]:
    events = []
    for row in rows:
        subject, code = row.person, behaviour(row)
        comment = json.dumps(row.as_dict(), ensure_ascii=False)
        events += [[row.start_s, subject, code, "", comment], [row.end_s, subject, code, "", ""]]
    return {
        "type": "LIVE",
        "date": "1970-01-01T00:00:00",
        "description": "",
        "time offset": 0.0,
        "file": {},
        "media_info": {"length": {}, "fps": {}, "hasVideo": {}, "hasAudio": {}},
        "visualize_spectrogram": False,
        "close_behaviors_between_videos": False,
        "scan_sampling_time": 0,
        "start_from_current_time": False,
        "observation time interval": [0, 0],
        "independent_variables": {},
        "events": events,
    }


def from_project(text: str) -> SegmentTable:
    """Read a project: all pairs of events, those too that other programs or people wrote."""
    project = json.loads(text)
    rows = []
    for take, observation in project["observations"].items():
        begun: dict[tuple[str, str], tuple[float, str]] = {}
        for time_s, subject, code, _, comment, *_ in observation["events"]:
            who = "" if subject == _NO_SUBJECT else subject
            if (who, code) not in begun:
                begun[who, code] = float(time_s), comment
                continue
            start_s, said = begun.pop((who, code))
            rows.append(_segment(take, who, code, start_s, float(time_s), said))
    return SegmentTable(rows)


def _segment(
    take: str, person: str, code: str, start_s: float, end_s: float, comment: str
) -> RecognisedSegment:
    try:
        said = json.loads(comment)
    except ValueError:
        said = {}
    if not isinstance(said, dict):
        said = {}
    row = {**dict.fromkeys(RecognisedSegment._fields), **said}
    if (row["name"] or UNKNOWN) != code:  # somebody has named it anew, or it is not ours
        row |= {"name": "" if code == UNKNOWN else code, "primitive": None}
    row |= {"take": take, "person": person, "start_s": start_s, "end_s": end_s}
    return RecognisedSegment.from_dict(row)
