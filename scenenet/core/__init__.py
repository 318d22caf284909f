"""What every package uses: errors, files, settings, progress, provenance."""
