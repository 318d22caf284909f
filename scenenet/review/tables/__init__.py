"""Tables that people write: CSV files of spreadsheets, layers of GeoPackages and Shapefiles."""
