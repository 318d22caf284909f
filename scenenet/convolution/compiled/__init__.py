"""The compiled loops of the convolution: runs of voxels, planes of output, vector rows.

Only ``scenenet.convolution`` uses this package. ``docs/method/performance.md`` explains how the sum
is organised and why.

- ``runs``: occupied voxels, grouped by four along x.
- ``kernel_tables``: the kernel, arranged for every pattern of four voxels; and back, for its
  gradient.
- ``planes``: one horizontal plane of the output in a buffer that fits the cache.
- ``volumes``: all planes of the output, with or without activation.
- ``rows``: a multiply-add over a row, as one vector instruction.
- ``activation``: tanh and ReLU.
- ``options``: how a batch is divided among cores.
"""
