"""The compiled loops below the convolution: runs of voxels, planes of output, vector rows.

Nothing outside this package and its users, ``convolution``, ``observer`` and ``voxels``, needs to
know how the sum is organised; ``docs/method/performance.md`` says why it is organised like this.

- ``runs``: occupied voxels, gathered four by four along x.
- ``tables``: the kernel, laid out for every pattern of four voxels; and back, for its gradient.
- ``planes``: one horizontal plane of the answer in a cache-sized buffer, summed and read back.
- ``rows``: the vector instruction that all of it comes down to.
- ``activate``: tanh and ReLU.
- ``counting``: points counted into voxels, before any of this.
"""
