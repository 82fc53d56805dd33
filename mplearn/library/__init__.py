"""The primitive library: frozen, versioned snapshots of what was learned."""

from .compact import CompactMotion as CompactMotion
from .library import PrimitiveLibrary as PrimitiveLibrary
from .library import TreeNode as TreeNode
from .primitive import Primitive as Primitive
