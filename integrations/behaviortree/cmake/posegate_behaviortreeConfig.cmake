include(CMakeFindDependencyMacro)
find_dependency(behaviortree_cpp)
find_dependency(Threads)
include("${CMAKE_CURRENT_LIST_DIR}/posegate_behaviortreeTargets.cmake")
