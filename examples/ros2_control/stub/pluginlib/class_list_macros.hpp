// Stands in for pluginlib: nothing is registered.
#include <type_traits>

#define PLUGINLIB_EXPORT_CLASS(name, base) static_assert(std::is_base_of_v<base, name>);
