"""How a hierarchy is resolved: many resolvers behind one interface."""

from solvers import augmented as augmented
from solvers import hcod as hcod
from solvers import hqp as hqp
from solvers import recursive as recursive
from solvers import reverse as reverse
from solvers import sns as sns
from solvers import tpm as tpm
from solvers import weighted as weighted
from solvers.certificate import Certificate, certify
from solvers.explain import explain
from solvers.resolver import Resolution, Resolver, make, names
from solvers.status import Status

__all__ = ["Certificate", "Resolution", "Resolver", "Status", "certify", "explain", "make", "names"]
