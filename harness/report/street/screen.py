"""What ``navbench map osm`` and ``navbench map routes`` found."""

from typing import Any

from harness.report.blocks import Block, Chart, Table, Text
from harness.report.numbers import counted, number_text

Row = dict[str, Any]
_SHOWN = 8  # kinds of furniture on the screen


def street_blocks(document: Row) -> list[Block]:
    """The imported district in short."""
    width, depth = document["size_m"]
    graph = document["graph"]
    connected = 100.0 * graph["connected_share"]
    lines = [
        f"{document['file']}: {width:.0f} x {depth:.0f} m, seed {document['seed']}; "
        f"{counted(len(document['maps']), 'map')}, {document['buildings']} buildings",
        f"ways: {graph['length_m'] / 1000.0:.1f} km, {connected:.0f} % of it connected; "
        f"walkable {document['walkable_area_m2']:.0f} m2",
    ]
    return [*(Text(line) for line in lines), _ways(document), _furniture(document, _SHOWN)]


def street_page(document: Row, picture: str) -> list[Block]:
    """The page of statistics."""
    first, second, ways, _ = street_blocks(document)
    crossings = document["crossings"]
    found = (
        f"{crossings['n']} crossings, {crossings['signals']} with signals, "
        f"{crossings['raised_kerbs']} with raised kerbs; filled in: "
        f"{_percent(crossings['filled_share'])} %. {document['furniture_moved']} pieces stood in "
        "the middle of a way and were moved beside it."
    )
    pieces = _furniture(document, len(document["furniture"]))
    credit = Text(document["credit"], "note")
    return [first, second, Chart(picture, document["credit"]), Text(found), ways, pieces, credit]


def _ways(document: Row) -> Table:
    rows = []
    for kind, found in document["walks"].items():
        widths = found["widths_m"]
        rows.append(
            (
                kind,
                f"{found['length_m']:.0f}",
                f"{widths['least']:.1f}-{widths['median']:.1f}-{widths['most']:.1f}",
                _percent(found["tagged_width_share"]),
                _percent(found["filled_share"]),
            )
        )
    headers = ("Ways", "Length [m]", "Width [m], least-median-most", "Tagged (%)", "Filled in (%)")
    return Table("", headers, rows)


def _furniture(document: Row, most: int) -> Table:
    rows = [
        (
            kind,
            str(found["n"]),
            number_text(found["per_100m"], 2),
            _percent(found["filled_share"]),
        )
        for kind, found in list(document["furniture"].items())[:most]
    ]
    return Table("", ("Furniture", "n", "Per 100 m of way", "Filled in (%)"), rows)


def _percent(share: float | None) -> str:
    return number_text(None if share is None else 100.0 * share, 0)


def routes_blocks(document: Row) -> list[Block]:
    """How many of the drawn missions have a route, and what the routes are like."""
    share, lengths = document["routed_share"], document["lengths_m"]
    low, high = document["distance_km"]
    text = (
        f"{document['graph']}: {counted(share['n'], 'mission')} of {low:g} to {high:g} km, seed "
        f"{document['seed']}; with a route: {share['value']:.3f} "
        f"[{share['low']:.3f}, {share['high']:.3f}]"
    )
    if document["beyond_box"]:
        anew = counted(document["beyond_box"], "pair")
        text += f"; {anew} whose ways could meet beyond the box only, drawn anew"
    rows = [(f"{percent} %", number_text(length, 0)) for percent, length in lengths.items()]
    crossed = (
        f"crossings per route: {number_text(document['crossings_mean'], 1)}, with signals "
        f"{number_text(document['signals_mean'], 1)}"
    )
    table = Table("", ("Routes", "Length [m]"), rows)
    return [Text(text), Text(crossed), table, Text(document["credit"], "note")]
