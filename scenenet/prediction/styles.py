"""How QGIS draws the layers of the GeoPackage."""

from __future__ import annotations

from collections.abc import Mapping

QML = """\
<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22" styleCategories="Symbology|Labeling">
<renderer-v2 type="singleSymbol">
<symbols><symbol name="0" type="{kind}" alpha="1">
<layer class="{symbol}">{options}</layer>
</symbol></symbols>
</renderer-v2>
{labels}</qgis>
"""

LABELS = """\
<labeling type="simple"><settings>
<text-style fieldName="{field}" isExpression="1" fontSize="9" textColor="30,30,30,255"/>
<placement placement="0" dist="2"/>
</settings></labeling>
"""


def _style(kind: str, symbol: str, labels: str = "", **options: str) -> str:
    """A style of one symbol for all features of a layer."""
    written = "".join(f'<prop k="{name}" v="{value}"/>' for name, value in options.items())
    return QML.format(kind=kind, symbol=symbol, options=written, labels=labels)


STYLES: Mapping[str, str] = {
    "towers": _style(
        "marker",
        "SimpleMarker",
        LABELS.format(field="'T' || &quot;id&quot;"),
        name="triangle",
        color="192,57,43,255",
        outline_color="255,255,255,255",
        size="3.4",
    ),
    "supports": _style(
        "marker",
        "SimpleMarker",
        LABELS.format(field="&quot;levels&quot;"),
        name="square",
        color="255,255,255,255",
        outline_color="60,60,60,255",
        size="1.8",
    ),
    "line_notes": _style(
        "marker",
        "SimpleMarker",
        LABELS.format(field="&quot;what&quot;"),
        name="circle",
        color="241,196,15,255",
        outline_color="60,60,60,255",
        size="3",
    ),
    "clearances": _style(
        "line",
        "SimpleLine",
        LABELS.format(
            field="if(&quot;what&quot; = 'danger', "
            "round(&quot;distance&quot;, 1) || ' m to ' || &quot;kind&quot;, '')"
        ),
        line_color="214,39,40,255",
        line_width="0.4",
    ),
    "clearance_profile": _style(
        "marker",
        "SimpleMarker",
        name="circle",
        color="120,120,120,255",
        outline_color="120,120,120,255",
        size="0.8",
    ),
    "fall_trees": _style(
        "marker",
        "SimpleMarker",
        LABELS.format(field="round(&quot;height&quot;) || ' m'"),
        name="circle",
        color="230,126,34,255",
        outline_color="60,60,60,255",
        size="2.6",
    ),
    "conductors": _style("line", "SimpleLine", line_color="41,98,165,255", line_width="0.4"),
    "rejected_conductors": _style(
        "line", "SimpleLine", line_color="120,120,120,255", line_style="dot", line_width="0.3"
    ),
    "spans": _style(
        "line",
        "SimpleLine",
        LABELS.format(field="round(&quot;length&quot;) || ' m'"),
        line_color="90,90,90,255",
        line_style="dash",
        line_width="0.2",
    ),
    "coverage": _style(
        "fill",
        "SimpleFill",
        color="52,110,140,40",
        outline_color="52,110,140,255",
        outline_width="0.2",
        style="solid",
    ),
    "tiles": _style(
        "fill",
        "SimpleFill",
        color="0,0,0,0",
        outline_color="90,90,90,255",
        outline_style="dash",
        style="no",
    ),
}
"""Layer -> style in the language of QGIS."""
