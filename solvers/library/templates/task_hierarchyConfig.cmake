# find_package(task_hierarchy @VERSION@), then link task_hierarchy::task_hierarchy (static) or, where
# it was made, task_hierarchy::shared.
get_filename_component(_th_root "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET task_hierarchy::task_hierarchy)
  add_library(task_hierarchy::task_hierarchy STATIC IMPORTED)
  set_target_properties(task_hierarchy::task_hierarchy PROPERTIES
    IMPORTED_LOCATION "${_th_root}/lib/libtask_hierarchy.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_th_root}/include"
    INTERFACE_LINK_LIBRARIES m)
endif()
if(NOT TARGET task_hierarchy::shared AND EXISTS "${_th_root}/lib/libtask_hierarchy.so")
  add_library(task_hierarchy::shared SHARED IMPORTED)
  set_target_properties(task_hierarchy::shared PROPERTIES
    IMPORTED_LOCATION "${_th_root}/lib/libtask_hierarchy.so"
    INTERFACE_INCLUDE_DIRECTORIES "${_th_root}/include")
endif()
unset(_th_root)
