# The target posegate::posegate: the library for firmware in C. Set these variables before, if the defaults are not yours:
#   POSEGATE_CORE   cortex-m0plus, cortex-m3, cortex-m4 (no floating-point unit), cortex-m4f, cortex-m33 or rv32imc;
#                   else `-mcpu` or `-march` in CMAKE_C_FLAGS decides, or CMAKE_SYSTEM_PROCESSOR
#   POSEGATE_PARTS  boxes, turning or all (the default): what the tables of the firmware need
#   POSEGATE_LEVEL  3 (the default) or s, which is smaller and slower
# A component such as `turning-s` sets the parts and the level.
cmake_policy(VERSION 3.16)

set(_posegate_set "${POSEGATE_PARTS}")
if(NOT _posegate_set)
  set(_posegate_set all)
endif()
if(POSEGATE_LEVEL)
  string(APPEND _posegate_set "-${POSEGATE_LEVEL}")
else()
  string(APPEND _posegate_set "-3")
endif()
if(posegate_FIND_COMPONENTS)
  # Two components name no folder, so they are refused below.
  set(_posegate_set "${posegate_FIND_COMPONENTS}")
endif()

set(_posegate_core "${POSEGATE_CORE}")
if(NOT _posegate_core)
  if("${CMAKE_C_FLAGS}" MATCHES "-mcpu=(cortex-m[0-9a-z]+)|-march=(rv32[a-z]+)")
    set(_posegate_core "${CMAKE_MATCH_1}${CMAKE_MATCH_2}")
  else()
    string(TOLOWER "${CMAKE_SYSTEM_PROCESSOR}" _posegate_core)
  endif()
  if(_posegate_core MATCHES "^cortex-m[47]$" AND "${CMAKE_C_FLAGS}" MATCHES "-mfloat-abi=hard")
    string(APPEND _posegate_core f)
  endif()
endif()
if(_posegate_core MATCHES "^cortex-m(0|0plus|1)$")
  set(_posegate_target thumbv6m-none-eabi)
elseif(_posegate_core STREQUAL "cortex-m3")
  set(_posegate_target thumbv7m-none-eabi)
elseif(_posegate_core MATCHES "^cortex-m[47]$")
  set(_posegate_target thumbv7em-none-eabi)
elseif(_posegate_core MATCHES "^cortex-m[47]f$")
  set(_posegate_target thumbv7em-none-eabihf)
elseif(_posegate_core STREQUAL "cortex-m33")
  set(_posegate_target thumbv8m.main-none-eabihf)
elseif(_posegate_core MATCHES "^rv32ima?c$")
  set(_posegate_target riscv32imc-unknown-none-elf)
else()
  set(posegate_FOUND FALSE)
  set(posegate_NOT_FOUND_MESSAGE
    "no archive for the core `${_posegate_core}`: set POSEGATE_CORE to cortex-m0plus, cortex-m3, cortex-m4, cortex-m4f, cortex-m33 or rv32imc")
  return()
endif()

get_filename_component(_posegate_root "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
set(_posegate_archive "${_posegate_root}/lib/${_posegate_target}/${_posegate_set}/libposegate_c.a")
if(NOT EXISTS "${_posegate_archive}")
  set(posegate_FOUND FALSE)
  set(posegate_NOT_FOUND_MESSAGE
    "no archive `${_posegate_set}`: POSEGATE_PARTS is boxes, turning or all, and POSEGATE_LEVEL is 3 or s; a component is one such as turning-s")
  return()
endif()

if(NOT TARGET posegate::posegate)
  add_library(posegate::posegate STATIC IMPORTED)
endif()
set_target_properties(posegate::posegate PROPERTIES
  IMPORTED_LOCATION "${_posegate_archive}"
  INTERFACE_INCLUDE_DIRECTORIES "${_posegate_root}/include")
foreach(_posegate_component IN LISTS posegate_FIND_COMPONENTS)
  set(posegate_${_posegate_component}_FOUND TRUE)
endforeach()
set(posegate_FOUND TRUE)
