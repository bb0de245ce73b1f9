"""How a hierarchy is resolved: many resolvers behind one interface."""

from solvers import resolvers as resolvers
from solvers.certificate import Certificate, certify
from solvers.explain import explain
from solvers.resolver import Resolution, Resolver, make, names, variants
from solvers.status import Status

__all__ = ["Certificate", "Resolution", "Resolver", "Status", "certify", "explain", "make", "names",
           "variants"]
