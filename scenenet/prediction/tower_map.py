"""The tower list of a survey as GeoJSON."""

from __future__ import annotations

from typing import Any

from scenenet.prediction.tile_answers import SurveyTower


def geojson(towers: list[SurveyTower], geneos: list[str], crs: Any) -> dict[str, Any]:
    """The tower list as a GeoJSON feature collection in the survey's own CRS."""
    features = [
        {
            "type": "Feature",
            "id": entry.id,
            "geometry": {"type": "Point", "coordinates": [entry.tower.x, entry.tower.y]},
            "properties": {
                "id": entry.id,
                "height": entry.tower.height,
                "base_elevation": entry.tower.base,
                "width": entry.tower.width,
                "wire_directions": len(entry.tower.spans),
                "wire_bearings": [span.bearing for span in entry.tower.spans],
                "probability": entry.tower.probability,
                "points": entry.points,
                "edge_distance": entry.edge_distance,
                "contributions": {
                    geneo: float(share) for geneo, share in zip(geneos, entry.shares, strict=True)
                },
            },
        }
        for entry in towers
    ]
    collection: dict[str, Any] = {"type": "FeatureCollection", "features": features}
    if crs is not None:
        epsg = crs.to_epsg()
        crs_name = f"urn:ogc:def:crs:EPSG::{epsg}" if epsg else crs.to_string()
        collection["crs"] = {"type": "name", "properties": {"name": crs_name}}
    return collection
