"""The report on sequences, in one of `formats.FORMATS`; only JSON and CSV have all digits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from lcpcli.bench import recording
from lcpcli.bench.sequences import PEER, SequenceRow, report
from lcpcli.bench.statistics import summary
from lcpcli.bench.suites import SEQUENCES
from lcpcli.errors import count
from lcpcli.peers.registry import installed
from lcpcli.report.document import Document, Section
from lcpcli.report.formats import typeset
from lcpcli.report.result_csv import written


def render(rows: Sequence[SequenceRow], form: str, width: int | None, color: bool) -> str:
    """Return the report as text; the other arguments are as for `report.render`."""
    machine = recording.machine()
    versions = recording.software([]) | {PEER: installed(PEER)}
    records = [asdict(row) | {"ratio": row.ratio} for row in rows]
    if form == "json":
        return json.dumps({"machine": asdict(machine), "versions": versions, SEQUENCES: records}, indent=1) + "\n"
    programs = ", ".join(f"{program} {version}" for program, version in versions.items() if version)
    conditions = [f"{machine.processor}, {machine.system}", programs]
    if form == "csv":
        cells = [dict(_cells("", record)) for record in records]
        return written([list(cells[0]) if cells else [], *(list(cell.values()) for cell in cells)], conditions)
    title = f"lcp bench {SEQUENCES}: {count(len(rows), 'sequence')}"
    return typeset(Document(title, [Section(title, facts=conditions), report(rows)]), form, width, color)


def _cells(name: str, value: Any) -> list[tuple[str, Any]]:
    """Return the cells of a value in CSV, with their columns: the medians of times, and one for each member of a
    record."""
    if isinstance(value, dict):
        return [
            cell
            for key, own in value.items()
            for cell in _cells(key if name in ("", "sides") else f"{name}_{key}", own)
        ]
    return [(name, (summary(value).median if value else None) if isinstance(value, list) else value)]
