"""The domain gap: synthetic crops compared with real ones."""
