"""The scene of a synthetic corridor.

- ``random_fields``, ``hashing``: random numbers and noise that depend on place and seed alone.
- ``terrain``: the ground.
- ``ground_cover``: grass, roads, railways and water on it.
- ``vegetation``, ``crowns``: trees, bushes and hedges, and the shape of their canopy.
- ``towers``: towers as members, and points on members.
- ``line``: where the towers are.
- ``strip``: the ground of one stretch of the corridor.
"""
