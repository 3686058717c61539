"""Boards that focus: what is asked for, the search, and how robust what it finds is."""

from chladni.design.front import Design
from chladni.design.search import design
from chladni.design.spec import Spec, read_spec, spec_of

__all__ = ["Design", "Spec", "design", "read_spec", "spec_of"]
