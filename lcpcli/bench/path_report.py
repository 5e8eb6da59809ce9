"""The report on paths, in one of suites.FORMATS; only JSON and CSV have all digits."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict

from lcpcli.bench import recording
from lcpcli.bench.paths import Row, sheet
from lcpcli.bench.report import typeset
from lcpcli.bench.statistics import summary
from lcpcli.errors import count
from lcpcli.peers.registry import FOLLOWERS, installed
from lcpcli.report.result_csv import written

TIMES = ("seconds", "peer_seconds")  # of each repeat; in CSV their medians


def render(rows: Sequence[Row], form: str, width: int | None, color: bool) -> str:
    """Return the report as text; the arguments are as for `report.render`."""
    machine = recording.machine()
    versions = recording.software([]) | {name: installed(name) for name, _ in FOLLOWERS.values()}
    records = [asdict(row) | {"ratio": row.ratio} for row in rows]
    if form == "json":
        return json.dumps({"machine": asdict(machine), "versions": versions, "paths": records}, indent=1) + "\n"
    programs = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
    head = [f"lcp bench path: {count(len(rows), 'path')}", f"{machine.processor}, {machine.system}", programs]
    if form == "csv":
        cells = [record | {name: _median(record[name]) for name in TIMES} for record in records]
        return written([list(cells[0]) if cells else [], *(list(cell.values()) for cell in cells)], head[1:])
    return typeset(head, [sheet(list(rows))], form, width, color)


def _median(seconds: Sequence[float]) -> float | None:
    return summary(seconds).median if seconds else None
