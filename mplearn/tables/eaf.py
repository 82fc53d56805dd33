"""ELAN: an annotation document of version 3.0 [Wittenburg2006].

A take is a tier of time-aligned annotations, which name the primitives. ELAN counts whole
milliseconds; what that leaves out is in a tier below, one annotation to one, as JSON.
"""

from __future__ import annotations

import json
from xml.etree import ElementTree as Xml

from ..library import RecognisedSegment, SegmentTable
from .boris import UNKNOWN, behaviour

_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_DETAILS = " details"
_MOST_MS = 1000.0


def as_document(table: SegmentTable) -> str:
    """Return an annotation document."""
    Xml.register_namespace("xsi", _XSI)
    root = Xml.Element(
        "ANNOTATION_DOCUMENT",
        {
            "AUTHOR": "mplearn",
            "DATE": "1970-01-01T00:00:00+00:00",
            "FORMAT": "3.0",
            "VERSION": "3.0",
            f"{{{_XSI}}}noNamespaceSchemaLocation": "http://www.mpi.nl/tools/elan/EAFv3.0.xsd",
        },
    )
    header = Xml.SubElement(root, "HEADER", MEDIA_FILE="", TIME_UNITS="milliseconds")
    last = Xml.SubElement(header, "PROPERTY", NAME="lastUsedAnnotationId")
    last.text = str(2 * len(table))
    order = Xml.SubElement(root, "TIME_ORDER")
    slots: dict[tuple[int, ...], str] = {}
    times = sorted(
        (round(_MOST_MS * time_s), 2 * k + end)
        for k, row in enumerate(table)
        for end, time_s in enumerate((row.start_s, row.end_s))
    )
    for n, (time_ms, which) in enumerate(times, start=1):
        slots[divmod(which, 2)] = f"ts{n}"
        Xml.SubElement(order, "TIME_SLOT", TIME_SLOT_ID=f"ts{n}", TIME_VALUE=str(time_ms))
    tiers: dict[str, list[int]] = {}
    for k, row in enumerate(table):
        tiers.setdefault(row.take, []).append(k)
    names = {_legal(take) for take in tiers}
    for take, rows in tiers.items():
        take, person = _legal(take), _legal(table[rows[0]].person)
        name_below = take + _DETAILS
        while name_below in names:  # a take may be called so
            name_below += _DETAILS
        names.add(name_below)
        tier = Xml.SubElement(
            root, "TIER", LINGUISTIC_TYPE_REF="primitive", PARTICIPANT=person, TIER_ID=take
        )
        below = Xml.SubElement(
            root,
            "TIER",
            LINGUISTIC_TYPE_REF="details",
            PARENT_REF=take,
            PARTICIPANT=person,
            TIER_ID=name_below,
        )
        for k in rows:
            aligned = Xml.SubElement(
                Xml.SubElement(tier, "ANNOTATION"),
                "ALIGNABLE_ANNOTATION",
                ANNOTATION_ID=f"a{2 * k + 1}",
                TIME_SLOT_REF1=slots[k, 0],
                TIME_SLOT_REF2=slots[k, 1],
            )
            Xml.SubElement(aligned, "ANNOTATION_VALUE").text = _legal(behaviour(table[k]))
            reference = Xml.SubElement(
                Xml.SubElement(below, "ANNOTATION"),
                "REF_ANNOTATION",
                ANNOTATION_ID=f"a{2 * k + 2}",
                ANNOTATION_REF=f"a{2 * k + 1}",
            )
            value = json.dumps(table[k].as_dict())
            Xml.SubElement(reference, "ANNOTATION_VALUE").text = value
    no, yes = "false", "true"
    Xml.SubElement(
        root,
        "LINGUISTIC_TYPE",
        GRAPHIC_REFERENCES=no,
        LINGUISTIC_TYPE_ID="primitive",
        TIME_ALIGNABLE=yes,
    )
    Xml.SubElement(
        root,
        "LINGUISTIC_TYPE",
        CONSTRAINTS="Symbolic_Association",
        GRAPHIC_REFERENCES=no,
        LINGUISTIC_TYPE_ID="details",
        TIME_ALIGNABLE=no,
    )
    said = {
        "Time_Subdivision": "Time subdivision of parent annotation's time interval, no time gaps "
        "allowed within this interval",
        "Symbolic_Subdivision": "Symbolic subdivision of a parent annotation. Annotations refering "
        "to the same parent are ordered",
        "Symbolic_Association": "1-1 association with a parent annotation",
        "Included_In": "Time alignable annotations within the parent annotation's time interval, "
        "gaps are allowed",
    }
    for name, description in said.items():
        Xml.SubElement(root, "CONSTRAINT", DESCRIPTION=description, STEREOTYPE=name)
    Xml.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + Xml.tostring(root, "unicode") + "\n"


def _legal(text: object) -> str:
    """Return a text as XML can hold it: what is not printable is spelled out."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(text or ""))


def from_document(text: str) -> SegmentTable:
    """Read a document: all time-aligned annotations, with what is said of them in tiers below."""
    root = Xml.fromstring(text)
    slots = {
        slot.attrib["TIME_SLOT_ID"]: float(slot.get("TIME_VALUE", "nan")) / _MOST_MS
        for slot in root.iter("TIME_SLOT")
    }
    details = {
        each.attrib["ANNOTATION_REF"]: each.findtext("ANNOTATION_VALUE") or ""
        for each in root.iter("REF_ANNOTATION")
    }
    rows = [
        _segment(tier, each, slots, details.get(each.attrib["ANNOTATION_ID"], ""))
        for tier in root.iter("TIER")
        for each in tier.iter("ALIGNABLE_ANNOTATION")
    ]
    return SegmentTable(rows)


def _segment(
    tier: Xml.Element, annotation: Xml.Element, slots: dict[str, float], details: str
) -> RecognisedSegment:
    try:
        said = json.loads(details)
    except ValueError:
        said = {}
    row: dict[str, object] = dict.fromkeys(RecognisedSegment._fields)
    if isinstance(said, dict):
        row |= {key: said[key] for key in row.keys() & said}
    name = annotation.findtext("ANNOTATION_VALUE") or ""
    if _legal(row["name"] or UNKNOWN) != name:  # somebody has named it anew, or it is not ours
        row |= {"name": "" if name == UNKNOWN else name, "primitive": None}
    for key, value in (("take", tier.attrib["TIER_ID"]), ("person", tier.get("PARTICIPANT", ""))):
        if _legal(row[key]) != value:
            row[key] = value
    for key, which in (("start_s", "TIME_SLOT_REF1"), ("end_s", "TIME_SLOT_REF2")):
        time_s, exact = slots[annotation.attrib[which]], row[key]
        moved = not isinstance(exact, float) or abs(exact - time_s) > 1 / _MOST_MS
        row[key] = time_s if moved else exact
    return RecognisedSegment.from_dict(row)
