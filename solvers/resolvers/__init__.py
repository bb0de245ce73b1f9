"""The resolvers, one file each; importing this package registers all of them by name."""

from solvers.resolvers import augmented as augmented
from solvers.resolvers import hcod as hcod
from solvers.resolvers import hqp as hqp
from solvers.resolvers import merged as merged
from solvers.resolvers import recursive as recursive
from solvers.resolvers import reverse as reverse
from solvers.resolvers import set_based as set_based
from solvers.resolvers import smooth as smooth
from solvers.resolvers import sns as sns
from solvers.resolvers import tpm as tpm
from solvers.resolvers import weighted as weighted
