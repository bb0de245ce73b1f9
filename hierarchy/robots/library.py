"""pinocchio as everything here imports it: missing or old, named in one line."""

from hierarchy.errors import RobotError, missing

try:
    import pinocchio as pin
except ModuleNotFoundError as error:
    raise missing(error, "robots") from None

__all__ = ["pin"]

_OLDEST = 4  # as pyproject.toml asks

if int(getattr(pin, "__version__", "0").partition(".")[0]) < _OLDEST:
    raise RobotError(f"pinocchio {pin.__version__} in {pin.__file__} is older than {_OLDEST}.0; "
                     "remove it from the path, or pip install 'task-hierarchy[robots]'")
