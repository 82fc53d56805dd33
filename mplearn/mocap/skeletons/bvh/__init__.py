"""BVH: hierarchy and motion as text, in all its dialects."""

from .reader import BVHReader as BVHReader
